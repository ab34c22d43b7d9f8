"""The glance: a shipped network from the silhouette to points all over the object, a prior of its shape.

The silhouette is resampled in a window about the object. The frame is rotated about the vertical until the
camera is above its x axis, so that the hidden side of the object is always the same side.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.smooth.free_space import (
    Silhouette,
    known_by,
    limited_sides,
    not_bounded,
    silhouette_of,
)
from experiments.shape_reconstruction.smooth.grid import BodySurface, Grid
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import DataRefused, FitRefused
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.runtime import Network

POINTS_GIVEN = 1024
"""Points that the network gives."""

SIDE = 96
"""Side of the window in pixels: 4 mm per pixel for an object of 0.2 m."""

SPAN = 1.0
"""Half the width of the window, relative to the reach of the frame."""


@dataclass(frozen=True, eq=False)
class PointFrame:
    """The frame of a network's points: their unit is the reach, their origin is on the support."""

    middle: FloatArray  #: ``(3,)`` origin in ``stand``, m.
    reach: float  #: unit of the network's points, m.

    def inward(self, points: FloatArray) -> FloatArray:
        """Transform ``(n, 3)`` points in ``stand``, m, to the network's units."""
        return np.asarray((points - self.middle) / self.reach)

    def outward(self, numbers: FloatArray) -> FloatArray:
        """Transform ``(n, 3)`` points in the network's units to ``stand``, m."""
        return np.asarray(numbers * self.reach + self.middle)


NOMINAL_FRAME = PointFrame(np.zeros(3), 0.2)
"""The frame of a picture alone: the nominal place of the object and about the size of one."""


@dataclass(frozen=True)
class CameraYaw:
    """A rotation about the vertical through the origin of ``stand``."""

    angle: float  #: angle from the x axis of ``stand`` to the camera, rad.

    @classmethod
    def towards(cls, look: SeenMask | None) -> "CameraYaw":
        """Rotate the x axis under the camera of a picture; no rotation without a picture."""
        x, y = (1.0, 0.0) if look is None else look.stand_from_camera[:2, 3]
        return cls(float(np.arctan2(y, x)))

    def inward(self, points: FloatArray) -> FloatArray:
        """Rotate ``(n, 3)`` points in ``stand`` until the camera is above the x axis."""
        return points @ self._stand_from_turned

    def outward(self, points: FloatArray) -> FloatArray:
        """Rotate ``(n, 3)`` points back to ``stand``."""
        return points @ self._stand_from_turned.T

    @property
    def _stand_from_turned(self) -> FloatArray:
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def window_points(frame: PointFrame, eye: FloatArray) -> FloatArray:
    """Compute the centres of the window's pixels, ``(SIDE * SIDE, 3)`` m, row by row from the top.

    The window faces the camera and is upright; its centre is half the reach above the support.

    Args:
        frame: frame of the points.
        eye: ``(3,)`` position of the camera in the same coordinates, m.
    """
    middle = frame.middle + np.array([0.0, 0.0, 0.5 * frame.reach])
    ahead = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    steps = SPAN * frame.reach * ((np.arange(SIDE) + 0.5) * 2.0 / SIDE - 1.0)
    across, down = np.meshgrid(steps, steps)
    return np.asarray(middle + across.reshape(-1, 1) * right - down.reshape(-1, 1) * up)


def window_of(look: SeenMask, frame: PointFrame, turned: CameraYaw) -> FloatArray:
    """Resample a silhouette: ``(1, SIDE, SIDE)``, 1 where a pixel's ray hits it, 0 elsewhere."""
    eye = turned.inward(look.stand_from_camera[:3, 3][None])[0]
    points = apply(inverse(look.stand_from_camera), turned.outward(window_points(frame, eye)))
    rows, columns = look.mask.shape
    column, row = (
        np.floor(look.focal_length * points[:, axis] / points[:, 2] + 0.5 * count).astype(int)
        for axis, count in ((0, columns), (1, rows))
    )
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns) & (points[:, 2] > 0.0)
    seen = np.zeros(len(points))
    seen[inside] = look.mask[row[inside], column[inside]]
    return seen.reshape(1, SIDE, SIDE)


def network_input(name: str, shape: tuple[int, ...], meaning: str, low: float, high: float) -> Input:
    """Describe an input of a completion network, ``(n, *shape)`` numbers from ``low`` to ``high``."""
    domain = Domain(low=(low,), high=(high,))
    return Input(
        name=name, dtype="float32", shape=("n", *shape), unit="1", meaning=meaning, domain=domain,
        normaliser="in the graph",
    )  # fmt: skip


WINDOW = network_input("window", (1, SIDE, SIDE), "the silhouette", 0.0, 1.0)
"""The input of a silhouette."""


def network_output(count: int) -> Tensor:
    """Describe the output of a completion network: so many points all over the object."""
    meaning = "places all over the object in the same frame"
    return Tensor(name="completed", dtype="float32", shape=("n", count, 3), unit="1", meaning=meaning)


_RIM = np.ones((SIDE, SIDE), bool)
_RIM[1:-1, 1:-1] = False


@dataclass(frozen=True, eq=False)
class SingleViewPrior:
    """A trained network."""

    network: Network  #: the graph.
    card: Mapping[str, object]  #: its origin, and its errors on held-out shapes.

    @property
    def held_out(self) -> float:
        """Mean Chamfer-L1 distance from points to points on held-out shapes, m.

        Raises:
            DataRefused: the card does not state it.
        """
        held = self.card.get("held_out")
        error = held.get("mean_chamfer_points_m") if isinstance(held, Mapping) else None
        if not isinstance(error, float):
            raise DataRefused(
                'the network\'s card has no "held_out" with "mean_chamfer_points_m" in metres; train it again'
            )
        return error

    def points(self, look: SeenMask) -> FloatArray:
        """Predict ``(POINTS_GIVEN, 3)`` points all over the object in ``stand``, its hidden side included, m.

        Raises:
            FitRefused: the object extends beyond the window.
        """
        turned = CameraYaw.towards(look)
        window = window_of(look, NOMINAL_FRAME, turned)
        if window[0, _RIM].any():
            limit = SPAN * NOMINAL_FRAME.reach * 1e3
            raise FitRefused(
                f"the silhouette reaches farther than {limit:.0f} mm from where the "
                "object should stand, and the network looks no farther; check where it stands, or touch it"
            )
        found = np.asarray(
            self.network({"window": window[None].astype(np.float32)})["completed"][0], np.float64
        )
        return turned.outward(NOMINAL_FRAME.outward(found))


def with_prior_points(evidence: ShapeEvidence) -> ShapeEvidence:
    """Add the points that the glance predicts; leave evidence unchanged that has them or allows none."""
    if len(evidence.prior_points):
        return evidence
    try:
        points = shipped().points(require_silhouette(evidence).look)
    except FitRefused:
        return evidence
    return replace(evidence, prior_points=read_only(points))


def require_silhouette(evidence: ShapeEvidence) -> Silhouette:
    """Return the silhouette of the picture.

    Raises:
        FitRefused: nothing was seen, or the object fills the picture.
    """
    seen = silhouette_of(evidence, np.zeros((0, 3)))
    if seen is None:
        raise FitRefused(
            "the camera saw nothing of the object, or nothing else, and a glance needs its silhouette; let "
            "it look again"
        )
    return seen


@cache
def shipped() -> SingleViewPrior:
    """Open the network that comes with the program."""
    folder = files(__package__) / "data"
    return opened((folder / "glance.onnx").read_bytes(), (folder / "glance.json").read_text())


def opened(data: bytes, card: str) -> SingleViewPrior:
    """Open a network from the bytes of its graph and its card.

    Raises:
        DataRefused: the graph must not be run, or is not that of a glance.
    """
    return SingleViewPrior(
        Network(data, "glance.onnx", [WINDOW], [network_output(POINTS_GIVEN)]), json.loads(card)
    )


PITCH = 3.0e-3
"""Pitch of the grid, m."""

GAP = 6.0
"""Radius of the closing ball over the median distance of neighbouring points. The predicted points are a few
millimetres off the surface: a smaller ball finds holes between them."""

BLUR = 1.0
"""Standard deviation of the smoothing, in pitches."""

SPREAD = float(np.sqrt(0.5 * np.pi))
"""Standard deviation of a normal density over the mean of its absolute values."""


def predict_surface(evidence: ShapeEvidence) -> ShapeEstimate:
    """Answer with a closed surface around the points of the glance; no contact is used.

    The deviation is the network's error on held-out shapes, and twice the distance of its points outside of
    their own silhouette. Only the network limits the depth of the object along the line of sight, and
    ``not_bounded`` states so.

    Raises:
        FitRefused: nothing was seen, the object fills the picture, or it is too large for the network.
    """
    start = time.perf_counter()
    seen = require_silhouette(evidence)
    points = shipped().points(seen.look)
    body = closed_around(points)
    mesh, deviation = body.mesh, prior_deviation(seen, points)
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.full(len(mesh.vertices), deviation),
        known_by=known_by(mesh, None, seen),
        not_bounded=not_bounded(limited_sides(mesh, None, seen)),
        doubtful={},
        flags=(
            "by the picture alone: its class is not told, and what is behind is supposed, as household "
            "shapes are",
            *body.notes,
        ),
        seconds=time.perf_counter() - start,
        estimator="glance",
        counts={"points": len(points)},
    )


def prior_deviation(seen: Silhouette, points: FloatArray) -> float:
    """Compute one standard deviation of the single-view prior's surface, m.

    Args:
        seen: the silhouette.
        points: ``(n, 3)`` points that the network predicts, m.
    """
    pixel = float(np.linalg.norm(seen.look.stand_from_camera[:3, 3])) / seen.look.focal_length
    outside = pixel * float(np.sqrt(np.mean(np.maximum(seen.outside_pixels(points), 0.0) ** 2)))
    return float(np.hypot(SPREAD * shipped().held_out, 2.0 * outside))


def closed_around(points: FloatArray) -> BodySurface:
    """Extract the morphological closing of points, one pitch outside of them and above the support.

    Args:
        points: ``(n, 3)`` points all over a body, m.

    Raises:
        OutOfDomain: as ``isosurface``.
    """
    grid, outside = closing_field(points)
    body = grid.surface(outside)
    above = np.maximum(body.mesh.vertices, [-np.inf, -np.inf, 0.0])
    return replace(body, mesh=Mesh(above, body.mesh.faces))


def closing_field(points: FloatArray, margin: float = 3.0 * PITCH) -> tuple[Grid, FloatArray]:
    """Compute the field whose zero is the morphological closing of points, on a grid around them.

    Args:
        points: ``(n, 3)`` points all over a body, m.
        margin: distance from the closing ball to the border of the grid, m.

    Returns:
        The grid, and ``(corners,)`` m, negative inside; outside it grows no farther than the ball's radius.
    """
    apart = float(np.median(cKDTree(points).query(points, k=[2])[0]))
    radius = max(GAP * apart, 2.0 * PITCH)
    reach = radius + margin
    grid = Grid.over(points.min(axis=0) - reach, points.max(axis=0) + reach, PITCH)
    near = (np.asarray(cKDTree(points).query(grid.points)[0]) <= radius).reshape(grid.shape)
    around = ndimage.binary_fill_holes(near)
    depth = grid.pitch * np.asarray(ndimage.distance_transform_edt(around))
    return grid, np.asarray(ndimage.gaussian_filter(radius - grid.pitch - depth, BLUR)).ravel()
