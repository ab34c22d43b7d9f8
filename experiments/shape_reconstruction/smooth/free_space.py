"""Free space: behind the gel's face at each touch, along the sensor's path, and outside the silhouette."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, inverse

CLEARANCE = 1.5e-3
"""Depth in the housing that the object may seem to have, m: errors of pose and of the housing's shape."""

SHIFTS = 3.0
"""Standard deviations of the camera that its picture is shifted by at most."""

_STEP = 0.5
_CONTACT_BEYOND = 0.7
"""Standard deviation of the distance of a contact from the silhouette, pixels."""


def sensor_depth(evidence: ShapeEvidence, points: FloatArray) -> FloatArray:
    """Return the ``(n,)`` depth of points inside the volume swept by the housing, in m; negative outside.

    The housing and the space that it moved through are one box, since it moves straight along its axis.
    """
    deepest = np.full(len(points), -np.inf)
    for touch in evidence.distinct:
        in_gel = apply(inverse(touch.stand_from_gel), points)
        beside = 0.5 * np.array(evidence.housing) - np.abs(in_gel[:, :2])
        before = -evidence.gel_thickness - in_gel[:, 2]
        behind = in_gel[:, 2] + evidence.gel_thickness + evidence.housing_depth + touch.way
        np.maximum(deepest, np.minimum(np.minimum(beside.min(axis=1), before), behind), out=deepest)
    return deepest


@dataclass(frozen=True, eq=False)
class Silhouette:
    """A mask as a signed distance in its picture, shifted to where the contacts want it."""

    look: SeenMask  #: the picture's.
    outside: FloatArray
    """``(rows, columns)`` pixels from the border of mask and hidden pixels; below 0 within."""
    shift: FloatArray
    """``(2,)`` pixels, x and y, by which places project farther than the camera's pose says."""

    @classmethod
    def of(cls, look: SeenMask, contacts: FloatArray) -> "Silhouette":
        """From a picture and ``(n, 3)`` m of places that must be within it."""
        known = look.mask | look.hidden
        outside = ndimage.distance_transform_edt(~known) - ndimage.distance_transform_edt(known)
        unshifted = cls(look, np.asarray(outside - np.sign(outside) * 0.5), np.zeros(2))
        if len(contacts) == 0:
            return unshifted
        # The least that brings the contacts within the silhouette, weighed against the camera's errors.
        pixels, depth = unshifted.pixels(contacts)
        sigma = max(shift_sigma(look, float(depth.mean())), 1e-3)
        steps = np.arange(-SHIFTS * sigma, SHIFTS * sigma + _STEP, _STEP)
        shifts = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        at = (pixels[None] + shifts[:, None])[..., ::-1].reshape(-1, 2).T - 0.5
        values = ndimage.map_coordinates(unshifted.outside, at, order=1, mode="nearest")
        beyond = (np.maximum(values.reshape(len(shifts), -1), 0.0) / _CONTACT_BEYOND) ** 2
        cost = beyond.sum(axis=1) + ((shifts / sigma) ** 2).sum(axis=1)
        return cls(look, unshifted.outside, shifts[int(cost.argmin())])

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``(n, 2)`` x and y in the picture, pixels from its corner, and ``(n,)`` m before the camera."""
        in_camera = apply(inverse(self.look.stand_from_camera), points)
        depth = np.maximum(in_camera[:, 2], 1e-6)
        middle = 0.5 * np.array(self.look.mask.shape[::-1])
        return self.look.focal_length * in_camera[:, :2] / depth[:, None] + middle + self.shift, depth

    def outside_pixels(self, points: FloatArray) -> FloatArray:
        """``(n,)`` pixels that each point appears beside the silhouette; below 0 within it."""
        return self._read(self.pixels(points)[0])

    def outside_metres(self, points: FloatArray) -> FloatArray:
        """Return ``(n,)`` distances outside the silhouette at each point's depth, m; below 0 within it."""
        pixels, depth = self.pixels(points)
        return self._read(pixels) * depth / self.look.focal_length

    def _read(self, pixels: FloatArray) -> FloatArray:
        """Linear between pixels' middles; beyond the picture as at its border."""
        at = pixels[:, ::-1].T - 0.5
        return np.asarray(ndimage.map_coordinates(self.outside, at, order=1, mode="nearest"))


def shift_sigma(look: SeenMask, depth: float) -> float:
    """Compute one standard deviation of the image position of a point at ``depth`` m, pixels."""
    turned = look.focal_length * look.rotation_error
    return float(np.hypot(turned, look.focal_length * look.position_error / depth))


def silhouette_of(evidence: ShapeEvidence, contacts: FloatArray) -> Silhouette | None:
    """The silhouette, shifted so that ``(n, 3)`` m of contacts are within it; None where nothing was seen."""
    look = evidence.look
    if look is None or int(look.mask.sum()) < limits.MIN_PIXELS or bool(look.mask.all()):
        return None
    return Silhouette.of(look, contacts)
