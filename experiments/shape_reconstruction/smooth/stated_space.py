"""Check readings and answers against where the scene says that the object is, and how large it may be."""

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import ShapeEvidence
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.mesh import Mesh

_YAWS = 45
_HORIZON = 1.0e-3
_FAR = 100.0


def max_offset(evidence: ShapeEvidence) -> float:
    """Greatest distance between the stated place and the support under the object, m."""
    return limits.MAX_PLACE_SIGMAS * evidence.place_error + limits.MAX_CENTRE_OFFSET * evidence.largest


def require_stated_space(evidence: ShapeEvidence) -> None:
    """Refuse readings that no object of the stated size at the stated place can cause.

    Raises:
        FitRefused: the silhouette, or a contact, is too far from the stated place, or two contacts are
            farther apart than the stated size allows.
    """
    look = evidence.look
    if look is not None and look.mask.any():
        # Compare the place where the filled silhouette meets the support with the stated place.
        rows, columns = np.nonzero(look.mask)
        height, width = look.mask.shape
        pixels = np.column_stack([columns + 0.5 - 0.5 * width, rows + 0.5 - 0.5 * height]) / look.focal_length
        rays = np.column_stack([pixels, np.ones(len(pixels))]) @ look.stand_from_camera[:3, :3].T
        eye = look.stand_from_camera[:3, 3]
        down, away = rays[:, 2] < -_HORIZON, _FAR
        if eye[2] > 0.0 and down.any():
            feet = eye[:2] - (eye[2] / rays[down, 2])[:, None] * rays[down, :2]
            away = min(float(np.linalg.norm(feet, axis=1).min()), _FAR)
        limit = max_offset(evidence)
        if away > limit:
            seen = (
                "above the horizon" if away >= _FAR else f"{away:.2f} m from the stated place at the nearest"
            )
            raise FitRefused(
                f"in the picture the object stands {seen}; with [shape] place_error "
                f"{evidence.place_error * 1e3:g} mm and largest {evidence.largest:g} m it must be within "
                f"{limit:.2f} m; correct object.pose.position or these two, or check the camera's pose"
            )
    if not evidence.contacts:
        return
    points = np.concatenate([touch.points for touch in evidence.contacts])
    reach = evidence.largest / np.sqrt(2.0) + limits.MAX_PLACE_SIGMAS * evidence.place_error
    off = float(np.linalg.norm(points[:, :2], axis=1).max())
    longest = longest_side(points)
    if off > reach:
        raise FitRefused(
            f"a press met something {off:.2f} m from the stated place; with [shape] place_error "
            f"{evidence.place_error * 1e3:g} mm and largest {evidence.largest:g} m the object ends within "
            f"{reach:.2f} m; correct object.pose.position or these two"
        )
    if longest > limits.MAX_LENGTH_RATIO * evidence.largest:
        raise FitRefused(
            f"contacts are {longest:.2f} m apart, and [shape] largest is {evidence.largest:g} m; raise "
            "largest, or check whether the presses met one object"
        )


def require_stated_size(mesh: Mesh, evidence: ShapeEvidence, method: str) -> None:
    """Refuse an answer that is larger than the scene allows.

    Args:
        mesh: the answer, m in ``stand``.
        evidence: states ``largest``.
        method: name of the estimator, for the message.

    Raises:
        FitRefused: its longest side is more than ``MAX_LENGTH_RATIO`` times ``largest``.
    """
    longest = longest_side(mesh.vertices)
    if longest > limits.MAX_LENGTH_RATIO * evidence.largest:
        raise FitRefused(
            f"the readings fit a body {longest:.2f} m long (method {method}), and [shape] largest is "
            f"{evidence.largest:g} m; check the camera's pose and where the object stands, or raise largest"
        )


def longest_side(points: FloatArray) -> float:
    """Longest side of the upright box around points whose longest side is least, m.

    Args:
        points: ``(n, 3)`` m.
    """
    yaws = np.arange(_YAWS) * 0.5 * np.pi / _YAWS
    turned = points[:, :2] @ np.array([np.cos(yaws), np.sin(yaws)])
    across = points[:, :2] @ np.array([-np.sin(yaws), np.cos(yaws)])
    level = np.maximum(np.ptp(turned, axis=0), np.ptp(across, axis=0)).min()
    return float(max(level, np.ptp(points[:, 2])))
