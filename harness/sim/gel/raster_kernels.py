"""The z-buffer's loops.

Faces that look at the eye are drawn first. Those that look away are hidden behind them wherever a surface
is closed, and are asked for by the nearest depth that they could have against the farthest that
is drawn in squares of pixels; the least depth of a pixel's line is the same in any order.
"""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.face_clusters import CLUSTER, clusters_in_box
from harness.sim.gel.triangle_kernels import ON_EDGE, draw

Clusters = tuple[FloatArray, IntArray, FloatArray, FloatArray]

_SQUARE = 8
"""Pixels to a side of the squares whose farthest depth is known."""


@compiled
def rasterise(
    clusters: Clusters,
    view_from_object: FloatArray,
    corner: FloatArray,
    pitch: float,
    span: FloatArray,
    depth: FloatArray,
    face: IntArray,
) -> None:
    """Fill ``depth`` with the least z in ``span`` of each pixel's line, +inf where there is none.

    Args:
        clusters: corners, faces, boxes and groups of ``FaceClusters``.
        view_from_object: ``(n, 4, 4)`` rigid.
        corner: ``(2,)`` metres, x and y of the image's first corner.
        pitch: metres a pixel.
        span: ``(2,)`` metres, least and greatest z that is seen.
        depth: ``(n, rows, columns)``, overwritten.
        face: the same shape, overwritten with face indices or -1, of faces equally near the least; or empty,
            and left alone.
    """
    corners, faces, boxes, groups = clusters
    rows, columns = depth.shape[1], depth.shape[2]
    low = np.array([corner[0], corner[1], span[0]])
    high = np.array([corner[0] + columns * pitch, corner[1] + rows * pitch, span[1]])
    found = np.empty(len(boxes), np.int64)
    pixels = np.empty((9, CLUSTER))
    facing = np.empty(CLUSTER)
    farthest = np.empty(((rows + _SQUARE - 1) // _SQUARE, (columns + _SQUARE - 1) // _SQUARE))
    wants_face = face.size > 0
    for n in range(len(view_from_object)):
        image = depth[n]
        image[:] = np.inf
        if wants_face:
            face[n] = -1
        named = face[n] if wants_face else face[:, :, 0]
        count = clusters_in_box(view_from_object[n], low, high, boxes, groups, found)
        for away in range(2):
            if away:
                farthest[:] = np.nan
            for at in range(count):
                c = found[at]
                _to_pixels(corners[c], view_from_object[n], corner, pitch, pixels)
                _facing(pixels, span, rows, columns, facing)
                for k in range(CLUSTER):
                    if (facing[k] > 0.0) if away else (facing[k] < 0.0):
                        if away and _hidden(pixels, k, image, farthest):
                            continue
                        draw(pixels, k, facing[k], span, image, named, faces[c, k], wants_face)


@compiled
def _to_pixels(corners: FloatArray, r: FloatArray, corner: FloatArray, pitch: float, out: FloatArray) -> None:
    # Columns and rows such that pixel centres are whole numbers; z stays in metres.
    per_pixel = 1.0 / pitch
    for c in range(0, 9, 3):
        for k in range(CLUSTER):
            x, y, z = corners[c, k], corners[c + 1, k], corners[c + 2, k]
            out[c, k] = (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z + r[0, 3] - corner[0]) * per_pixel - 0.5
            out[c + 1, k] = (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z + r[1, 3] - corner[1]) * per_pixel - 0.5
            out[c + 2, k] = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z + r[2, 3]


@compiled
def _facing(p: FloatArray, span: FloatArray, rows: int, columns: int, facing: FloatArray) -> None:
    """Twice the area of each face, below zero if it looks at the eye; 0 of what is not seen.

    What is edge-on is drawn by its neighbours. What is NaN is not seen either.
    """
    for k in range(CLUSTER):
        x_low, x_high = min(p[0, k], p[3, k], p[6, k]), max(p[0, k], p[3, k], p[6, k])
        y_low, y_high = min(p[1, k], p[4, k], p[7, k]), max(p[1, k], p[4, k], p[7, k])
        z_low, z_high = min(p[2, k], p[5, k], p[8, k]), max(p[2, k], p[5, k], p[8, k])
        seen = (
            (x_high >= -ON_EDGE)
            & (y_high >= -ON_EDGE)
            & (x_low <= columns - 1 + ON_EDGE)
            & (y_low <= rows - 1 + ON_EDGE)
            & (z_low <= span[1])
            & (z_high >= span[0])
        )
        ax, ay = p[3, k] - p[0, k], p[4, k] - p[1, k]
        bx, by = p[6, k] - p[0, k], p[7, k] - p[1, k]
        facing[k] = ax * by - bx * ay if seen else 0.0


@compiled
def _hidden(p: FloatArray, k: int, image: FloatArray, farthest: FloatArray) -> bool:
    """Whether every pixel that a face may cover is known to have something nearer."""
    rows, columns = image.shape
    z_low = min(p[2, k], p[5, k], p[8, k])
    top = max(int(np.ceil(min(p[1, k], p[4, k], p[7, k]) - ON_EDGE)), 0)
    bottom = min(int(np.floor(max(p[1, k], p[4, k], p[7, k]) + ON_EDGE)), rows - 1)
    left = max(int(np.ceil(min(p[0, k], p[3, k], p[6, k]) - ON_EDGE)), 0)
    right = min(int(np.floor(max(p[0, k], p[3, k], p[6, k]) + ON_EDGE)), columns - 1)
    for i in range(top // _SQUARE, bottom // _SQUARE + 1):
        for j in range(left // _SQUARE, right // _SQUARE + 1):
            if np.isnan(farthest[i, j]):
                farthest[i, j] = _farthest(image, i * _SQUARE, j * _SQUARE)
            if z_low <= farthest[i, j]:
                return False
    return True


@compiled
def _farthest(image: FloatArray, top: int, left: int) -> float:
    most = -np.inf
    for i in range(top, min(top + _SQUARE, image.shape[0])):
        for j in range(left, min(left + _SQUARE, image.shape[1])):
            most = max(most, image[i, j])
    return most
