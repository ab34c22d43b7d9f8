"""Whether a surface is near a point, in machine code that stops at the first face that is."""

import numpy as np

from harness.arrays import BoolArray, FloatArray, IntArray
from harness.sim.compiled import compiled
from harness.sim.surface_kernels import nearest_on_triangle


@compiled
def near_surface(
    points: FloatArray,
    most: float,
    corners: FloatArray,
    origin: FloatArray,
    cell: float,
    shape: IntArray,
    starts: IntArray,
    faces: IntArray,
) -> BoolArray:
    """``(n,)``: whether some face is no farther than ``most`` m from each of ``(n, 3)`` points.

    A point's own cell is asked first: that of a point on the surface holds the face it lies on.

    Args:
        points: ``(n, 3)`` m, finite.
        most: m.
        corners: ``(m, 3, 3)`` of the faces.
        origin: of a ``FaceGrid``, as are ``cell``, ``shape``, ``starts`` and ``faces``.
        cell: m.
        shape: ``(3,)`` cells.
        starts: of each cell's list.
        faces: of all lists.
    """
    near = np.zeros(len(points), np.bool_)
    low, high, here = np.empty(3, np.int64), np.empty(3, np.int64), np.empty(3)
    limit = most * most
    for n in range(len(points)):
        for step in range(2):
            reach = 0.0 if step == 0 else most
            for axis in range(3):
                first = np.floor((points[n, axis] - reach - origin[axis]) / cell)
                last = np.floor((points[n, axis] + reach - origin[axis]) / cell)
                low[axis] = int(min(max(first, 0.0), shape[axis] - 1.0))
                high[axis] = int(min(max(last, 0.0), shape[axis] - 1.0))
            for i in range(low[0], high[0] + 1):
                for j in range(low[1], high[1] + 1):
                    for k in range(low[2], high[2] + 1):
                        if near[n]:
                            break
                        c = (i * shape[1] + j) * shape[2] + k
                        for at in range(starts[c], starts[c + 1]):
                            if nearest_on_triangle(points[n], corners[faces[at]], here) <= limit:
                                near[n] = True
                                break
            if near[n]:
                break
    return near
