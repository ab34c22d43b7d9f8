"""What the levels of ``touch.force`` cost and lose: error against seconds, and what the gel's figures do.

``PYTHONPATH=. python tests/benchmarks/touch/bench_force.py [--repeat 9]``

Presses of 320 x 240 pixels of 0.0634 mm (a GelSight Mini's) on a gel 2.5 mm thick; errors are against the
layer on pixels a third of the size, of whose shapes these are the means. Seconds are of the processor, one
thread, with the error's own statement, after one press that loads what is kept. The second table is by
Poisson's ratio: what the springs are off by, of a ball and a flat face, small to wider than the gel is thick.
The third is of four forces measured on a real gel (``published_force``): the modulus that each asks for.
"""

import time

import numpy as np

from harness.basics.arrays import FloatArray
from harness.sim.gel.contact_force import PARTS, ForceLevel, contact_force
from harness.sim.gel.elastic import GelElastic
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.oracles.published_force import DEPTHS, FORCES, THICKNESS, moduli
from tests.samples.pressed_shapes import Pair, places

ROWS, COLUMNS, PITCH, THICK = 240, 320, 0.0634e-3, 2.5e-3
FINER = 3
GEL = GelElastic(0.3e6, 0.0, 0.485, 0.0, 0.0)
SETTINGS: tuple[tuple[ForceLevel, int], ...] = (("winkler", 1), ("layer", 4), ("layer", 2), ("layer", 1))


def _ball(radius: float, depth: float, by: int, at: Pair = (0.0, 0.0)) -> FloatArray:
    x, y = places(PITCH / by, ROWS * by, COLUMNS * by, at)
    away = np.minimum(x * x + y * y, radius**2)
    return np.asarray(np.maximum(0.0, depth - radius + np.sqrt(radius**2 - away)))


def _box(half: Pair, depth: float, by: int, turned: float = 0.3) -> FloatArray:
    x, y = places(PITCH / by, ROWS * by, COLUMNS * by, (0.4e-3, -0.2e-3))
    along, across = np.cos(turned) * x + np.sin(turned) * y, np.cos(turned) * y - np.sin(turned) * x
    return np.where((np.abs(along) < half[0]) & (np.abs(across) < half[1]), depth, 0.0)


def _rod(radius: float, depth: float, by: int) -> FloatArray:
    _, y = places(PITCH / by, ROWS * by, COLUMNS * by, (0.0, 0.3e-3))
    return np.maximum(0.0, depth - y * y / (2.0 * radius))


def _shapes(by: int) -> dict[str, FloatArray]:
    beads = [_ball(2e-3, 0.3e-3, by, (x, y)) for x in (-4e-3, 0.0, 4e-3) for y in (-3e-3, 3e-3)]
    return {
        "ball of 4 mm, 0.5 mm deep": _ball(2e-3, 0.5e-3, by),
        "ball of 15 mm, 1 mm": _ball(7.5e-3, 1e-3, by),
        "ball of 60 mm, 0.5 mm": _ball(30e-3, 0.5e-3, by),
        "face of 2 x 3 mm, 0.3 mm": _box((1e-3, 1.5e-3), 0.3e-3, by),
        "edge of 0.4 x 8 mm, 0.2 mm": _box((0.2e-3, 4e-3), 0.2e-3, by),
        "rod of 6 mm across the window, 0.3 mm": _rod(3e-3, 0.3e-3, by),
        "six beads of 4 mm, 0.3 mm": np.sum(beads, axis=0),
        "face over the whole window, 0.2 mm": np.full((ROWS * by, COLUMNS * by), 0.2e-3),
    }


def _means(fine: FloatArray) -> FloatArray:
    return np.asarray(fine.reshape(ROWS, FINER, COLUMNS, FINER).mean(axis=(1, 3)))


def main() -> None:
    """Print or write the tables."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--repeat", type=int, default=9)
    repeat = parser.parse_args().repeat
    rows: list[list[Cell]] = []
    for name, fine in _shapes(FINER).items():
        truth = float(contact_force(fine[None], PITCH / FINER, THICK, GEL).newtons[0])
        texts = [_row(_means(fine), truth, level, cells, repeat) for level, cells in SETTINGS]
        rows.append([name, truth, *texts])
    levels = [f"{level}, {cells} px" if level == "layer" else level for level, cells in SETTINGS]
    finish_figure("touch_force", "levels", "; ".join(("press", "force [N]", *levels)), rows)
    _springs()
    _published()


def _row(depth: FloatArray, truth: float, level: ForceLevel, cells: int, repeat: int) -> str:
    found = contact_force(depth[None], PITCH, THICK, GEL, level, cells)
    took = []
    for _ in range(repeat):
        began = time.thread_time()
        contact_force(depth[None], PITCH, THICK, GEL, level, cells)
        took.append(1e3 * (time.thread_time() - began))
    stated = found.shares[0, PARTS.index("squares")]
    return f"{found.newtons[0] / truth - 1.0:+.2%} ({stated:.2%}), {np.median(took):.1f} ms"


def _springs() -> None:
    """Print the error of the springs relative to the layer, of a ball / of a flat face."""
    ratios = (0.3, 0.45, 0.485, 0.5)
    heads = ("contact radius [thicknesses]", *(f"Poisson's ratio {poisson:g}" for poisson in ratios))
    rows: list[tuple[Cell, ...]] = [
        (wide, *(_off(wide, poisson) for poisson in ratios)) for wide in (0.1, 0.2, 0.4, 0.8, 1.6)
    ]
    finish_figure("touch_force", "winkler over layer", "; ".join(heads), rows)


def _off(wide: float, poisson: float) -> str:
    """Of contacts ``wide`` thicknesses in radius, 64 pixels across."""
    gel, side = GelElastic(1e6, 0.0, poisson, 0.0, 0.0), 2.2 * wide / 72
    x, y = places(side, 72, 72)
    away = np.hypot(x, y)
    shapes = (np.maximum(0.0, wide**2 - away**2) * 0.05 / wide**2, np.where(away < wide, 0.05, 0.0))
    springs = contact_force(np.array(shapes), side, 1.0, gel, "winkler").newtons
    layer = contact_force(np.array(shapes), side, 1.0, gel, "layer").newtons
    return " / ".join(f"{off:+.1%}" for off in springs / layer - 1.0)


def _published() -> None:
    """Print or write the modulus that each measured force implies."""
    depths = (f"{1e3 * d:g} mm, {f:.2f} N [MPa] .3f" for d, f in zip(DEPTHS, FORCES, strict=True))
    heads = "; ".join(("theory, Poisson's ratio", *depths, "mean [MPa] .3f", "scatter [%] .1f"))
    rows: list[list[Cell]] = []
    theories: tuple[tuple[str, float, float, ForceLevel], ...] = (
        ("layer, 0.475", 0.475, THICKNESS, "layer"),
        ("layer, 0.485", 0.485, THICKNESS, "layer"),
        ("layer, 0.495", 0.495, THICKNESS, "layer"),
        ("winkler, 0.485", 0.485, THICKNESS, "winkler"),
        ("Hertz's half-space, 0.485", 0.485, np.inf, "layer"),
    )
    for words, poisson, thickness, level in theories:
        found = 1e-6 * moduli(poisson, thickness, level)
        scatter = found.std(ddof=1) / found.mean()
        rows.append([words, *map(float, found), float(found.mean()), 100.0 * float(scatter)])
    finish_figure("touch_force", "real", heads, rows)


if __name__ == "__main__":
    main()
