"""By what each part of a surface is known, and which extents nothing limits."""

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.surface import SEEN, SUPPOSED, TOUCHED
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.geometry import apply, inverse

UNDER_GEL = 6.0e-3
"""M from a contact's points within which a surface counts as touched."""

BORDER = 1.5
"""Pixels from the silhouette's border within which a surface counts as seen."""

LIMITING = 0.4
"""Part of a contact's normal along an axis from which on it limits the extent there."""

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


def not_bounded(evidence: ShapeEvidence) -> tuple[str, ...]:
    """Names of the axes of ``stand`` along which neither a contact nor the silhouette limits the object.

    Along z the support limits it from below.
    """
    if evidence.look is not None and _limits(evidence.look):
        return ()
    normals = np.array([_mean(touch.normals) for touch in evidence.contacts]).reshape(-1, 3)
    free = []
    for axis, name in enumerate("xyz"):
        upper = bool((normals[:, axis] > LIMITING).any())
        lower = axis == 2 or bool((normals[:, axis] < -LIMITING).any())
        if not (upper and lower):
            free.append(name)
    return tuple(free)


def _mean(normals: FloatArray) -> FloatArray:
    total = normals.sum(axis=0)
    return np.asarray(total / max(float(np.linalg.norm(total)), 1e-9))


def _limits(look: SeenMask) -> bool:
    """Whether enough of a silhouette's border is seen."""
    if not look.mask.any():
        return False
    around = ndimage.binary_dilation(look.mask, iterations=2) & ~look.mask
    edge = look.mask.copy()
    edge[1:-1, 1:-1] = False
    hidden = int((around & look.hidden).sum()) + int(edge.sum())
    return bool(hidden <= MOST_HIDDEN * max(int(around.sum()), 1))
