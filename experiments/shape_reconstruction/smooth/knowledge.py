"""Sources of each part of an answer: touched, seen or unobserved; extents that nothing limits."""

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, UNOBSERVED
from experiments.shape_reconstruction.smooth.contact_samples import ContactSamples
from experiments.shape_reconstruction.smooth.free_space import Silhouette
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.mesh import Mesh

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
