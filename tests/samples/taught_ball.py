"""A ball of one colour, and small networks that learn it."""

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews
from harness.authoring.vision.lessons import OPAQUE, draw_lamps, draw_lessons
from harness.authoring.vision.profiles import CellsSpec
from harness.authoring.vision.surface_cells import surface_cells
from harness.objectfile.vision.network import PER_CELL, NetworkSize, VisionGrid
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball

SIZE = NetworkSize(width=16, octaves=3, turns=2, kind="osf-v")
TINY = CellsSpec(SIZE, cells=4, places=6000, steps=300, batch=64, least=64)
NOTHING = HeldOutViews((), ())
RADIUS = 0.05
COLOUR = (0.7, 0.4, 0.1)


def lit_ball() -> LitObject:
    """Of one colour, 0.1 m across."""
    return LitObject(plain(ball(RADIUS, 3), COLOUR))


def grid_for(lit: LitObject) -> tuple[VisionGrid, float]:
    """Four cells along it, and m of a voxel of its shell."""
    grid = surface_cells(lit.appearance.mesh, TINY.cells)
    return grid, grid.cell / PER_CELL


def training_of(lit: LitObject, spec: CellsSpec = TINY, seed: int = 3, threads: int = 1) -> CellTraining:
    """Of networks that were taught nothing yet."""
    grid, voxel = grid_for(lit)
    lessons = draw_lessons(lit, spec.places, voxel, seed, NOTHING)
    lamps = draw_lamps(256, seed, NOTHING)
    return CellTraining(spec, grid, lessons, lamps, OPAQUE / voxel, seed, threads)
