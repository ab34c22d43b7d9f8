"""A mug without a handle, of mapped cells whose every node is where the shape has it."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.sim.solid.tetrahedra import QuadraticMesh
from tests.oracles.exact_solids import mapped
from tests.oracles.volume_meshes import grid_cells

CUP_RADIUS, CUP_HEIGHT, CUP_FILLET, CUP_WALL = 0.04, 0.09, 0.01, 0.004
"""m, of the wall's middle."""


def cup(count: int, layers: int = 1) -> QuadraticMesh:
    """A cup without a handle: a square sheet made round, its rim bent up through a fillet."""
    nodes, cells = _sheet(count, layers)
    flat = CUP_RADIUS - CUP_FILLET
    arc = 0.5 * np.pi * CUP_FILLET
    length = flat + arc + CUP_HEIGHT - CUP_FILLET

    def onto(unit: FloatArray) -> FloatArray:
        sheet = unit[:, :2]
        reach = length * np.abs(sheet).max(axis=1)
        size = np.linalg.norm(sheet, axis=1)
        way = sheet / np.where(size > 0.0, size, 1.0)[:, None]
        turn = np.clip((reach - flat) / CUP_FILLET, 0.0, 0.5 * np.pi)
        out = np.minimum(reach, flat) + CUP_FILLET * np.sin(turn)
        up = CUP_FILLET * (1.0 - np.cos(turn)) + np.maximum(reach - flat - arc, 0.0)
        inward = CUP_WALL * (unit[:, 2] - 0.5)
        radius = out - inward * np.sin(turn)
        return np.column_stack([radius[:, None] * way, up + inward * np.cos(turn)])

    return mapped(nodes, cells, onto)


def _sheet(count: int, layers: int) -> tuple[FloatArray, IntArray]:
    """``count`` cells a side of a square from -1 to 1, cut along its diagonals, and so without flat cells."""
    nodes, cells = grid_cells((count // 2, count // 2, layers))
    ways = [np.array([x, y, 1.0]) for x in (1.0, -1.0) for y in (1.0, -1.0)]
    placed = np.concatenate([(nodes * way)[cells].reshape(-1, 3) for way in ways])
    unique, which = np.unique(np.round(placed, 9) + 0.0, axis=0, return_inverse=True)
    return unique, which.reshape(-1, 4)
