"""Free space: behind the gel's face at each touch, along the sensor's path, and outside the silhouette."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, UNOBSERVED
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import thin

SPACING = 6.0e-3
"""Smallest distance between samples that face the same way, m."""

MOST = 260
"""Largest number of samples: a surface through them is solved in a tenth of a second."""

_WIDER = 1.25


@dataclass(frozen=True, eq=False)
class ContactSamples:
    """Places of the object's surface."""

    points: FloatArray  #: ``(n, 3)`` m in ``stand``.
    normals: FloatArray  #: ``(n, 3)`` unit, out of the object.
    sigmas: FloatArray  #: ``(n,)`` m, one standard deviation of each point along its normal.
    normal_sigmas: FloatArray  #: ``(n,)`` rad, of each normal.
    touches: IntArray  #: ``(n,)`` which of ``evidence.contacts`` each is of.

    def of(self, rows: IntArray) -> "ContactSamples":
        """Some of them."""
        return ContactSamples(
            self.points[rows],
            self.normals[rows],
            self.sigmas[rows],
            self.normal_sigmas[rows],
            self.touches[rows],
        )


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


Sides = dict[tuple[str, int], bool]


def known_by(mesh: Mesh, samples: ContactSamples | None, silhouette: Silhouette | None) -> IntArray:
    """Classify vertices as ``TOUCHED``, ``SEEN`` or ``UNOBSERVED``, ``(vertices,)``."""
    known = np.full(len(mesh.vertices), UNOBSERVED, np.int64)
    if silhouette is not None:
        known[np.abs(silhouette.outside_pixels(mesh.vertices)) < limits.BORDER_DISTANCE] = SEEN
    if samples is not None:
        apart, nearest = cKDTree(samples.points).query(mesh.vertices)
        alike = np.einsum("ij,ij->i", samples.normals[nearest], mesh.vertex_normals) > limits.MIN_SAME_FACING
        known[(apart < limits.TOUCH_DISTANCE) & alike] = TOUCHED
    return known


def limited_sides(mesh: Mesh, samples: ContactSamples | None, silhouette: Silhouette | None) -> Sides:
    """Find which sides a reading limits, by the name of the axis and -1 or 1.

    A side is limited by a contact near that end which looks that way, by the silhouette where the camera
    looks across it, and the lowest by the support.
    """
    low, high = mesh.bounds
    sides: Sides = {}
    for axis, name in enumerate("xyz"):
        across = False
        if silhouette is not None:
            mask, towards = silhouette.look.mask, float(silhouette.look.stand_from_camera[axis, 2])
            cut_off = bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())
            across = not cut_off and abs(towards) < limits.MAX_ALONG_SIGHT
        for sign in (-1, 1):
            end = high[axis] if sign > 0 else low[axis]
            near = limits.MAX_END_DISTANCE * (high[axis] - low[axis])
            touched = samples is not None and bool(
                (
                    (sign * samples.normals[:, axis] > limits.MIN_SAME_FACING)
                    & (np.abs(samples.points[:, axis] - end) < near)
                ).any()
            )
            sides[name, sign] = touched or across or (name, sign) == ("z", -1)
    return sides


def not_bounded(sides: Sides) -> tuple[str, ...]:
    """Names of the axes of which a side is not limited."""
    return tuple(name for name in "xyz" if not (sides[name, -1] and sides[name, 1]))


def beyond_deviation(mesh: Mesh, known: IntArray, sides: Sides, largest: float) -> FloatArray:
    """Return ``(vertices,)`` m, the standard deviation of unobserved parts towards unlimited sides.

    The object ends anywhere between the answer's end and the greatest length that is possible: an even
    density's deviation, as far as the vertex looks that way.
    """
    low, high = mesh.bounds
    deviation = np.zeros(len(mesh.vertices))
    for (name, sign), limited in sides.items():
        axis = "xyz".index(name)
        room = max(largest - float(high[axis] - low[axis]), 0.0) / np.sqrt(12.0)
        if not limited:
            looking = np.maximum(sign * mesh.vertex_normals[:, axis], 0.0)
            np.maximum(deviation, room * looking, out=deviation)
    return np.where(known == UNOBSERVED, deviation, 0.0)


def hollow_deviation(mesh: Mesh, known: IntArray, samples: ContactSamples) -> FloatArray:
    """``(vertices,)`` m, one standard deviation of a top that nobody touched: it may be a vessel's mouth.

    Its bottom is then anywhere between the support and here: the root mean square of an even density.
    """
    up = samples.points[samples.normals[:, 2] > limits.MIN_SAME_FACING]
    looking_up = (mesh.vertex_normals[:, 2] > limits.MIN_SAME_FACING) & (known == UNOBSERVED)
    if len(up):
        looking_up &= np.asarray(cKDTree(up).query(mesh.vertices)[0]) > limits.MIN_MOUTH_DISTANCE
    return np.where(looking_up, np.maximum(mesh.vertices[:, 2], 0.0) / np.sqrt(3.0), 0.0)


def all_samples(evidence: ShapeEvidence) -> ContactSamples:
    """Every place of every contact.

    Raises:
        FitRefused: no touch met the object.
    """
    contacts = evidence.contacts
    if not contacts:
        raise FitRefused(
            f"none of {len(evidence.touches)} touches met the object, so nothing says where its surface is; "
            "touch it, or answer by the picture alone"
        )
    counts = [len(contact.points) for contact in contacts]
    return ContactSamples(
        np.concatenate([contact.points for contact in contacts]),
        np.concatenate([contact.normals for contact in contacts]),
        np.repeat([contact.sigma for contact in contacts], counts),
        np.repeat([contact.normal_sigma for contact in contacts], counts),
        np.repeat(np.arange(len(contacts)), counts),
    )


def thinned(samples: ContactSamples, spacing: float = SPACING, most: int = MOST) -> ContactSamples:
    """Those of which no two that face the same way are closer than ``spacing`` m, ``most`` at most.

    Where there are more, the spacing is widened until there are not.
    """
    points, normals = np.ascontiguousarray(samples.points), np.ascontiguousarray(samples.normals)
    chosen = thin(points, normals, spacing)
    while len(chosen) > most:
        spacing *= _WIDER
        chosen = thin(points, normals, spacing)
    return samples.of(chosen)
