"""The skirt of a gel within a graph: blurs as products with banded matrices."""

import numpy as np

from harness.basics.arrays import AnyArray
from harness.bench.sensor import TactileSensor
from harness.objectfile.graph import Nodes
from harness.sim.gel.gel import GelSkirt, half_kernel


def hung(nodes: Nodes, deep: str, sensor: TactileSensor, skirt: GelSkirt) -> str:
    """``(n, rows, columns)``: ``harness.sim.gel.gel.deform`` of how deep an object reaches."""
    deepest = nodes.add("ReduceMax", deep, axes=[1, 2], keepdims=1)
    core = nodes.add("Mul", deepest, nodes.constant(np.array(skirt.core, np.float32)))
    kept = nodes.add("Greater", deep, core)
    widths = sorted({*skirt.kernels, skirt.final} - {1})
    blurs = {}
    for width in widths:
        down, along = blur_matrix(sensor.rows, width), blur_matrix(sensor.columns, width)
        blurs[width] = nodes.constant(down), nodes.constant(along.T)
    surface = deep
    for width in skirt.kernels:
        blurred = _blurred(nodes, surface, blurs[width]) if width > 1 else surface
        surface = nodes.add("Where", kept, deep, blurred)
    if skirt.final > 1:
        surface = _blurred(nodes, surface, blurs[skirt.final])
    return surface


def _blurred(nodes: Nodes, image: str, blur: tuple[str, str]) -> str:
    return nodes.add("MatMul", nodes.add("MatMul", blur[0], image), blur[1])


def blur_matrix(size: int, width: int) -> AnyArray:
    """``(size, size)`` float32: one direction of ``gel_kernels.blur``, which mirrors at the border."""
    half = half_kernel(width)
    matrix = np.zeros((size, size))
    for k in range(1 - len(half), len(half)):
        at = np.abs(np.arange(size) + k) % max(2 * (size - 1), 1)
        mirrored = np.where(at < size, at, 2 * (size - 1) - at)
        np.add.at(matrix, (np.arange(size), mirrored), half[abs(k)])
    return matrix.astype(np.float32)
