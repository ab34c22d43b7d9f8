"""Networks whose look is known in closed form: even fog, and densities that are linear in place."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.vision.graph import vision_graph
from harness.objectfile.vision.network import (
    NetworkSize,
    VisionGrid,
    VisionModel,
    VisionWeights,
    scatter_rows,
)
from harness.picture.pinhole import Pinhole

SMALL = NetworkSize(width=16, octaves=2, turns=1)
TOLD = NetworkSize(width=16, octaves=2, turns=1, kind="osf-v")


def box_grid(low: FloatArray, cell: float, sides: tuple[int, int, int]) -> VisionGrid:
    """A network for every cell of a box."""
    return VisionGrid(low, cell, np.argwhere(np.ones(sides)))


def no_weights(size: NetworkSize, count: int) -> dict[str, AnyArray]:
    """All of them zero."""
    return {name: np.zeros((count, *shape)) for name, shape in size.shapes.items()}


def even_look(
    grid: VisionGrid, density: float, logits: tuple[float, float, float], size: NetworkSize = SMALL
) -> VisionModel:
    """The same everywhere: a density in 1/m, and colours as ``1 / (1 + exp(-logit))``."""
    arrays = no_weights(size, len(grid))
    arrays["density_bias"][:] = 1.0
    arrays["colour_bias"][:] = logits
    return VisionModel(grid, VisionWeights(size, density, **arrays).rounded())


def sloped_look(grid: VisionGrid, axis: int, level: float, scale: float) -> VisionModel:
    """Density ``scale`` times the half-cells below a plane across an axis; red rises along the next axis.

    The numbers are whole or halves: float16 has them exactly, so that cells meet without a step.

    Args:
        grid: of the cells.
        axis: across which the plane lies.
        level: of the plane, cells from the grid's least corner; a multiple of a quarter.
        scale: 1/m for half a cell.
    """
    arrays, other = no_weights(SMALL, len(grid)), (axis + 1) % 3
    # A unit that is never below zero passes its number on: x + 1 in -1 .. 1.
    for c in range(3):
        arrays["first"][:, c, c] = arrays["second"][:, c, c] = arrays["feature"][:, c, c] = 1.0
        arrays["first_bias"][:, c] = arrays["scatter"][:, c, c] = 1.0
    arrays["density"][:, axis, 0] = -1.0
    arrays["density_bias"][:, 0] = 2.0 * (level - grid.cells[:, axis])
    arrays["colour"][:, other, 0] = 0.125
    arrays["colour_bias"][:, 0] = 0.25 * grid.cells[:, other]
    return VisionModel(grid, VisionWeights(SMALL, scale, **arrays).rounded())


def shadow_look(grid: VisionGrid, density: float) -> VisionModel:
    """White where the light is seen, black where it is not."""
    arrays = no_weights(TOLD, len(grid))
    arrays["density_bias"][:] = 1.0
    arrays["scatter"][:, scatter_rows(TOLD)["extras"].start, 0] = 1.0
    arrays["colour"][:, 0] = 20.0
    arrays["colour_bias"][:] = -10.0
    return VisionModel(grid, VisionWeights(TOLD, density, **arrays).rounded())


def file_of(model: VisionModel, block: int = 32) -> bytes:
    """As it is kept."""
    data: bytes = vision_graph(model, block).SerializeToString(deterministic=True)
    return data


def looking(
    mesh: Mesh,
    away: float,
    width: int,
    height: int | None = None,
    along: tuple[float, float, float] = (0.3, -0.8, 0.5),
) -> Pinhole:
    """A camera so many of the object's longest sides away, over 39.6 degrees."""
    centre, longest = mesh.bounds.mean(axis=0), float(np.ptp(mesh.bounds, axis=0).max())
    way = np.array(along) / np.linalg.norm(along)
    eye = centre + away * longest * way
    return Pinhole.looking_at(eye, centre, (0.0, 0.0, 1.0), width, height or width, np.radians(39.6))


def patchy_look(grid: VisionGrid, density: float, seed: int = 0, size: NetworkSize = SMALL) -> VisionModel:
    """A density in 1/m, and a colour of its own for each cell."""
    arrays = no_weights(size, len(grid))
    arrays["density_bias"][:] = 1.0
    arrays["colour_bias"][:] = np.random.default_rng(seed).uniform(-2.0, 2.0, (len(grid), 3))
    return VisionModel(grid, VisionWeights(size, density, **arrays).rounded())
