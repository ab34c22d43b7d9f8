"""Per-ray inputs at the hit point: surface normal, and the shadow ray's origin."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.faces.ray_kernels import Hit, nearest_of
from harness.objectfile.vision.coverage.faces import Lists, meet
from harness.objectfile.vision.prefetch import AHEAD, bring_row
from harness.sim.light.lambert_kernels import cosine_of, place_on

Surface = tuple[FloatArray, FloatArray, FloatArray]
"""``(m, 3, 3)`` m corners, ``(m, 3)`` unit normals of faces, and ``(m, 3, 3)`` of their corners."""


@compiled
def surface_inputs(
    eye: FloatArray,
    ways: FloatArray,
    begin: FloatArray,
    likely: AnyArray,
    cubes: Lists,
    surface: Surface,
    lamp: FloatArray,
    size: float,
    faces: IntArray,
    lifted: FloatArray,
    faced: FloatArray,
    told: AnyArray,
) -> None:
    """Fill in the faces that rays meet, and what is told of them but whether the lamp sees them.

    Args:
        eye: ``(3,)`` m, where all rays begin.
        ways: ``(n, 3)`` unit.
        begin: ``(n,)`` m along each: from where it may meet anything.
        likely: ``(n,)`` int32: the face that an outline knows each to meet; or ``(0,)``.
        cubes: of the mesh.
        surface: of the mesh.
        lamp: ``(3,)`` unit, towards it.
        size: m, of the mesh.
        faces: ``(n,)`` written; -1 where nothing is met.
        lifted: ``(n, 3)`` m, written: where the lamp is looked for from.
        faced: ``(n,)`` written: cosine, 0 where a place looks away.
        told: ``(n, 4)`` float32, of which the last three are written: the normal, 0 where nothing is met.
    """
    (corners, flats, normals), light = surface, (lamp[0], lamp[1], lamp[2])
    nothing: Hit = (np.inf, -1, 0.0, 0.0)
    triangles = cubes[6]
    for n in range(len(ways)):
        if n + AHEAD < len(likely):
            next_face = likely[n + AHEAD]
            bring_row(triangles, next_face)
            bring_row(corners, next_face)
            bring_row(flats, next_face)
            bring_row(normals, next_face)
        hit = nothing
        if len(likely):
            hit = nearest_of(eye, ways[n], begin[n], -1, n, n + 1, likely, triangles, nothing)
        if hit[1] < 0:
            hit = meet(eye, ways[n], begin[n], cubes)
        faces[n] = f = hit[1]
        if f < 0:
            told[n, 1], told[n, 2], told[n, 3], faced[n] = 0.0, 0.0, 0.0, 0.0
            continue
        # Rays on an edge are met by faces a little wider than they are.
        b, c, view = (
            min(max(hit[2], 0.0), 1.0),
            min(max(hit[3], 0.0), 1.0),
            (ways[n, 0], ways[n, 1], ways[n, 2]),
        )
        point, facing, flat, above = place_on(f, b, c, view, corners, flats, normals)
        faced[n] = cosine_of(light, point, facing, flat, above, size)
        told[n, 1], told[n, 2], told[n, 3] = facing
        lifted[n, 0], lifted[n, 1], lifted[n, 2] = above
