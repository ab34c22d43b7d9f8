"""By what each part of a surface is known, and which extents nothing limits."""

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.knowledge import limited_sides
from experiments.shape_reconstruction.estimators.knowledge import not_bounded as open_axes
from experiments.shape_reconstruction.estimators.picture import silhouette_of
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.surface import SEEN, SUPPOSED, TOUCHED
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh

UNDER_GEL = 6.0e-3
"""M from a contact's points within which a surface counts as touched."""

BORDER = 1.5
"""Pixels from the silhouette's border within which a surface counts as seen."""

LIMITING = 0.4
"""Part of a contact's normal along an axis from which on it limits the extent there."""

SHORT = 25.0e-3
"""M that an answer may go on beyond its last contact along an axis before nothing bounds it there."""

MOST_HIDDEN = 0.4
"""Share of the silhouette's border that may be hidden before it limits no extent."""


def known_by(vertices: FloatArray, evidence: ShapeEvidence) -> IntArray:
    """``(n,)`` ``SUPPOSED``, ``SEEN`` or ``TOUCHED``."""
    known = np.full(len(vertices), SUPPOSED, np.int64)
    if evidence.look is not None and evidence.look.mask.any():
        known[_at_border(vertices, evidence.look)] = SEEN
    points = [touch.points for touch in evidence.contacts]
    if points:
        known[cKDTree(np.concatenate(points)).query(vertices)[0] <= UNDER_GEL] = TOUCHED
    return known


def _at_border(vertices: FloatArray, look: SeenMask) -> BoolArray:
    in_camera = apply(inverse(look.stand_from_camera), vertices)
    rows, columns = look.mask.shape
    depth = np.maximum(in_camera[:, 2], 1e-3)
    places = look.focal_length * in_camera[:, :2] / depth[:, None] + 0.5 * np.array([columns, rows])
    border = look.mask ^ ndimage.binary_erosion(look.mask)
    away = ndimage.distance_transform_edt(~(border & ~look.hidden))
    column, row = np.floor(places).astype(np.int64).T
    inside = (column >= 0) & (row >= 0) & (column < columns) & (row < rows) & (in_camera[:, 2] > 0.0)
    near = np.zeros(len(vertices), bool)
    near[inside] = away[row[inside], column[inside]] <= BORDER
    return near


def not_bounded(evidence: ShapeEvidence, mesh: Mesh, outside: bool) -> tuple[str, ...]:
    """Names of the axes of ``stand`` along which nothing limits the object; by the support it is from below.

    The silhouette and a class that fits limit it all around. Where the class does not, the silhouette limits
    what the camera looks across, and the rest is limited by contacts near its ends alone. Without a
    silhouette contacts must look both ways along an axis, and end no more than ``SHORT`` before the answer.

    Args:
        evidence: one contact or a silhouette at least.
        mesh: the answer.
        outside: whether its contacts do not fit any class.
    """
    if evidence.look is not None and _limits(evidence.look):
        return open_without_class(evidence, mesh) if outside else ()
    normals = np.array([touch.mean_normal for touch in evidence.contacts]).reshape(-1, 3)
    supposed = beyond_contacts(mesh.vertices, evidence).max(axis=0)
    free = []
    for axis, name in enumerate("xyz"):
        upper = bool((normals[:, axis] > LIMITING).any())
        lower = axis == 2 or bool((normals[:, axis] < -LIMITING).any())
        if not (upper and lower) or supposed[axis] > SHORT:
            free.append(name)
    return tuple(free)


def open_without_class(evidence: ShapeEvidence, mesh: Mesh) -> tuple[str, ...]:
    """List the axes along which neither the silhouette nor contacts limit the object, whatever its class.

    Args:
        evidence: one contact or a silhouette at least.
        mesh: the answer.
    """
    samples = all_samples(evidence) if evidence.contacts else None
    touched = np.zeros((0, 3)) if samples is None else samples.points
    return open_axes(limited_sides(mesh, samples, silhouette_of(evidence, touched)))


def beyond_contacts(vertices: FloatArray, evidence: ShapeEvidence) -> FloatArray:
    """``(n, 3)`` m along each axis by which vertices lie outside of the box of all contacts and the support.

    Zero for all without a contact.
    """
    points = [touch.points for touch in evidence.contacts]
    if not points:
        return np.zeros_like(vertices)
    met = np.concatenate(points)
    low, high = met.min(axis=0), met.max(axis=0)
    low[2] = min(low[2], 0.0)
    return np.asarray(np.maximum(np.maximum(low - vertices, vertices - high), 0.0))


def _limits(look: SeenMask) -> bool:
    """Whether enough of a silhouette's border is seen."""
    if not look.mask.any():
        return False
    around = ndimage.binary_dilation(look.mask, iterations=2) & ~look.mask
    edge = look.mask.copy()
    edge[1:-1, 1:-1] = False
    hidden = int((around & look.hidden).sum()) + int(edge.sum())
    return bool(hidden <= MOST_HIDDEN * max(int(around.sum()), 1))
