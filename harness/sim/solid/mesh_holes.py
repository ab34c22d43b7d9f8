"""Small holes closed, overlapping closed bodies joined."""

import numpy as np
from manifold3d import Error, Manifold
from manifold3d import Mesh as ManifoldMesh

from harness.basics.arrays import FloatArray, IntArray
from harness.sim.solid.mesh_repair import RepairedSurface, bodies, boundary_edges, is_watertight

_LARGEST_HOLE = 0.08


def fill_holes(surface: RepairedSurface) -> None:
    """Close holes whose box is under 8 % of the size with a fan about their middle.

    Larger ones are mouths of vessels as often as damage: they stay.
    """
    filled, slits = 0, 0
    for loop in _loops(boundary_edges(surface.faces)):
        rim = surface.vertices[loop]
        if float(np.ptp(rim, axis=0).max()) > _LARGEST_HOLE * surface.size:
            continue
        if _fan_area(rim) < 1e-3 * float(np.ptp(rim, axis=0).max()) ** 2:
            slits += 1
            continue
        hub = len(surface.vertices)
        surface.vertices = np.vstack([surface.vertices, rim.mean(axis=0)])
        # The new faces run along the rim against its own faces.
        fan = np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), hub)])
        surface.faces = np.vstack([surface.faces, fan])
        filled += 1
    if filled:
        surface.repairs.append(f"filled {filled} small holes")
    if slits:
        surface.repairs.append(f"left {slits} slits without width")


def join_bodies(surface: RepairedSurface) -> int:
    """Unite closed bodies that overlap, so that no face lies inside the material.

    Returns:
        The number of separate bodies afterwards.
    """
    body = bodies(surface)
    count = int(body.max()) + 1
    if count == 1 or not is_watertight(surface.faces):
        return count
    # Seen from a vertex: a solid's coordinates are float32.
    centre = surface.vertices[0].copy()
    parts = [_solid(surface.vertices - centre, surface.faces[body == k]) for k in range(count)]
    # A wall of a cavity is a body of negative volume: only whole solids can be united.
    if any(part.status() != Error.NoError or part.volume() <= 0.0 for part in parts):
        return count
    joined = sum(parts[1:], parts[0])
    after = len(joined.decompose())
    if after == count and joined.num_tri() == len(surface.faces):
        return count
    raw = joined.to_mesh64()
    surface.vertices = np.asarray(raw.vert_properties, np.float64)[:, :3] + centre
    surface.faces = np.asarray(raw.tri_verts, np.int64)
    surface.repairs.append(f"joined {count} overlapping bodies into {after}")
    return after


def _solid(vertices: FloatArray, faces: IntArray) -> Manifold:
    used, inverse = np.unique(faces, return_inverse=True)
    return Manifold(
        ManifoldMesh(vertices[used].astype(np.float32), inverse.reshape(-1, 3).astype(np.uint32)),
    )


def _loops(edges: IntArray) -> list[IntArray]:
    """Closed walks along directed boundary edges; places where two rims touch are left alone."""
    starts, times = np.unique(edges[:, 0], return_counts=True)
    following = {int(a): int(b) for a, b in edges}
    forked = set(starts[times > 1].tolist())
    loops = []
    while following:
        walk = [next(iter(following))]
        while (step := following.pop(walk[-1], None)) is not None and step != walk[0]:
            walk.append(step)
        if step == walk[0] and len(walk) >= 3 and not forked.intersection(walk):
            loops.append(np.array(walk, dtype=np.int64))
    return loops


def _fan_area(rim: FloatArray) -> float:
    middle = rim.mean(axis=0)
    return float(
        0.5 * np.linalg.norm(np.cross(rim - middle, np.roll(rim, -1, axis=0) - middle), axis=1).sum()
    )
