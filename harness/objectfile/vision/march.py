"""Samples of rays: as many in every stretch within the shell as its length asks for, one at least."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.compiled import compiled
from harness.objectfile.vision.voxels import Three, walk

_BESIDE = 1e-7
"""Of a cell: how far beside its network's cell rounding may put a sample."""


@compiled
def _beside(table: AnyArray, place: Three) -> int:
    """As ``network_at``, of a place that is on a border or beside it."""
    for reach in (0.0, _BESIDE):
        for corner in range(8 if reach > 0.0 else 1):
            at, inside = (0, 0, 0), True
            x = place[0] + (reach if corner & 1 else -reach)
            y = place[1] + (reach if corner & 2 else -reach)
            z = place[2] + (reach if corner & 4 else -reach)
            inside = 0.0 <= x <= table.shape[0] and 0.0 <= y <= table.shape[1] and 0.0 <= z <= table.shape[2]
            if inside:
                # The greatest corner belongs to the last cell.
                at = (
                    min(int(x), table.shape[0] - 1),
                    min(int(y), table.shape[1] - 1),
                    min(int(z), table.shape[2] - 1),
                )
                if table[at] >= 0:
                    return int(table[at])
    return -1


@compiled
def network_at(table: AnyArray, place: Three) -> int:
    """The network of a place in cells, or of the nearest cell that rounding may have missed; -1 for none."""
    i, j, k = int(place[0]), int(place[1]), int(place[2])
    x, y, z = table.shape
    # Truncated, what is just below 0 is 0 too; it is told apart.
    if min(place[0], min(place[1], place[2])) >= 0.0 and i < x and j < y and k < z:
        found = table[np.uint64(i), np.uint64(j), np.uint64(k)]
        if found >= 0:
            return int(found)
    return _beside(table, place)


@compiled
def _put(at: int, place: Three, network: int, cells: AnyArray, networks: AnyArray, local: AnyArray) -> None:
    networks[at] = network
    cell = cells[max(network, 0)]
    for axis in range(3):
        within = 2.0 * (place[axis] - cell[axis]) - 1.0
        local[at, axis] = min(max(within, -1.0), 1.0)


@compiled
def march(
    rays: AnyArray,
    ways: FloatArray,
    eye: FloatArray,
    voxel: float,
    per_cell: int,
    near: AnyArray,
    table: AnyArray,
    cells: AnyArray,
    step: float,
    most: int,
    runs_at_once: int,
    resume: FloatArray,
    counts: AnyArray,
    networks: AnyArray,
    local: AnyArray,
    lengths: AnyArray,
    places: AnyArray,
) -> None:
    """The next samples of rays.

    Args:
        rays: ``(n,)`` that go on.
        ways: ``(r, 3)`` unit, of each ray.
        eye: ``(3,)`` voxels from the lattice's least corner.
        voxel: m.
        per_cell: voxels along a cell.
        near: of the shell.
        table: of the grid.
        cells: of the grid's networks.
        step: m that a sample stands for at most.
        most: samples of a ray; more are left for the next time.
        runs_at_once: stretches of a ray; more are left for the next time.
        resume: ``(r,)`` m: from where, and from where the next time; inf for nowhere.
        counts: ``(n,)`` samples of each ray, written.
        networks: ``(n * most,)`` int32, written; those of ray ``rays[i]`` from ``i * most`` on.
        local: ``(n * most, 3)`` float32 in the cell, written.
        lengths: ``(n * most,)`` float32 m that each sample stands for, written.
        places: ``(n * most,)`` float32 m along the ray, written.
    """
    runs, way = np.empty((1, 2)), np.empty(3)
    ex, ey, ez, share = eye[0], eye[1], eye[2], 1.0 / per_cell
    for n in range(len(rays)):
        ray, count, stretches, after = rays[n], 0, 0, resume[rays[n]]
        for axis in range(3):
            way[axis] = ways[ray, axis] / voxel
        wx, wy, wz = way[0], way[1], way[2]
        # One stretch at a time: what is behind those that fill the places is not walked to.
        while stretches < runs_at_once and count < most and after < np.inf:
            found, after = walk(eye, way, after, near, runs)
            if found == 0:
                break
            stretches += 1
            begin, end = runs[0, 0], runs[0, 1]
            parts = max(1, int(np.ceil((end - begin) / step - 1e-9)))
            part = (end - begin) / parts
            taken = min(parts, most - count)
            for i in range(taken):
                at, t = n * most + count, begin + (i + 0.5) * part
                place = (share * (ex + t * wx), share * (ey + t * wy), share * (ez + t * wz))
                _put(at, place, network_at(table, place), cells, networks, local)
                lengths[at], places[at] = part, t
                count += 1
            if taken < parts:
                after = begin + taken * part
        counts[n], resume[ray] = count, after


@compiled
def take_surface(
    rays: AnyArray,
    ways: FloatArray,
    eye: FloatArray,
    voxel: float,
    per_cell: int,
    table: AnyArray,
    cells: AnyArray,
    away: AnyArray,
    counts: AnyArray,
    networks: AnyArray,
    local: AnyArray,
    lengths: AnyArray,
    places: AnyArray,
) -> None:
    """One sample of each ray, ``away`` ``(r,)`` m along it; otherwise as ``march`` with ``most = 1``."""
    place = np.empty(3)
    for n in range(len(rays)):
        ray = rays[n]
        for axis in range(3):
            place[axis] = (eye[axis] + away[ray] * ways[ray, axis] / voxel) / per_cell
        _put(n, place, network_at(table, place), cells, networks, local)
        counts[n], lengths[n], places[n] = 1, np.inf, away[ray]
