"""Volume meshes whose vibration is known: boxes of sheared cubes, and a ball."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra

_SIX = np.array([(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)])
"""A cube's corners (4 x + 2 y + z) as six tetrahedra round its long diagonal (Kuhn)."""


def grid_cells(counts: tuple[int, int, int]) -> tuple[FloatArray, IntArray]:
    """A unit cube of ``counts`` cubes, six tetrahedra each."""
    axes = [np.linspace(0.0, 1.0, count + 1) for count in counts]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(nodes)).reshape([count + 1 for count in counts])
    corners = np.stack(
        [
            number[x : x + counts[0], y : y + counts[1], z : z + counts[2]].ravel()
            for x in (0, 1)
            for y in (0, 1)
            for z in (0, 1)
        ],
        axis=1,
    )
    return nodes, corners[:, _SIX].reshape(-1, 4)


def box(sides: tuple[float, float, float], counts: tuple[int, int, int]) -> Tetrahedra:
    """A box in metres."""
    nodes, cells = grid_cells(counts)
    return tetrahedra(nodes * sides, cells)


def ball(radius: float, count: int) -> Tetrahedra:
    """A ball in metres, from a cube pushed out along its diagonals; corners on the sphere."""
    nodes, cells = grid_cells((count, count, count))
    cube = 2.0 * nodes - 1.0
    reach = np.abs(cube).max(axis=1)
    length = np.linalg.norm(cube, axis=1)
    round_ = cube * np.where(length > 0.0, reach / np.where(length > 0.0, length, 1.0), 0.0)[:, None]
    blend = reach[:, None] ** 2
    return tetrahedra(radius * (blend * round_ + (1.0 - blend) * cube * 0.6), cells)
