"""What accuracy of modes costs: element order and mesh size, and how many modes are kept.

``PYTHONPATH=. python tests/benchmarks/sound/bench_modes_cost.py [--full] [--repeats N] [--out FILE.png]``

Order and size: worst relative error of the first ten modes of Lamb's sphere, exactly known, and of the first
twenty of a cup with a 4 mm wall, against its finest mesh on its exact shape, over process seconds of assembly
and solve on one thread. Meshing is not counted: the meshes are mapped grids, whose ten-node cells are taken
once straight between corners and once with their middle nodes on the shape. Four-node cells are solved by
the same solver. Modes kept: the cup's sounds of 16 strikes of 0.25 ms with only its lowest modes,
against all below 20 kHz, over the seconds of solving for them and over those of synthesis. ``--full``
adds the sizes that take minutes. Exponents are fitted to the last half of each curve.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS, Material
from harness.report.figures.style import SOFT, blank, styled
from harness.sim.modal.lanczos import modes_below
from harness.sim.modal.modes import Modes, dampings
from harness.sim.modal.solve import solve_mesh
from harness.sim.solid.modal_mesh import QuadraticMesh, quadratic_mesh
from harness.sim.solid.tetrahedra import tetrahedra
from harness.sim.sound.synthesis import synthesize
from tests.oracles.exact_solids import exact_ball
from tests.oracles.four_node import four_node_system
from tests.oracles.mapped_cup import cup

STEEL = replace(MATERIALS["steel"], poisson=0.25)
CERAMIC = MATERIALS["ceramic"]
BALL = 0.03
SPHERE_MODES, CUP_MODES = 10, 20
HEARING = 20e3
RATE, DURATION = 44.1e3, 3.0
STRIKES = 16
BLOW = 0.25e-3
"""s of a strike."""

SHARES = (0.1, 0.2, 0.4, 0.7, 1.0)
COLOURS = {"four nodes": "#c2410c", "ten nodes, straight": "#5b616b", "ten nodes, on the shape": "#1b3fae"}

Solved = Callable[[], FloatArray]


@dataclass(frozen=True)
class Point:
    """One setting."""

    family: str  #: which curve.
    unknowns: int  #: of the system; of modes kept, their number.
    seconds: tuple[float, ...]  #: process seconds, one a run.
    error: float  #: relative, or of sounds in dB.

    @property
    def median(self) -> float:
        """Seconds."""
        return float(np.median(self.seconds))


def repeated(work: Solved, times: int) -> tuple[FloatArray, tuple[float, ...]]:
    """The last result, and process seconds of each."""
    took, found = [], np.zeros(0)
    for _ in range(times):
        begun = time.process_time()
        found = work()
        took.append(time.process_time() - begun)
    return found, tuple(took)


def ten(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz."""
    return solve_mesh(mesh, of, np.inf, least=count).modes.frequencies[:count]


def four(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz, of the same corners."""
    corners = int(mesh.cells[:, :4].max()) + 1
    system = four_node_system(tetrahedra(mesh.nodes[:corners], mesh.cells[:, :4]), of)
    pairs, _ = modes_below(system, np.inf, count + 6)
    return np.asarray(np.sqrt(pairs.values[:count]) / (2.0 * np.pi))


def straight(mesh: QuadraticMesh) -> QuadraticMesh:
    """Its middle nodes back between their corners."""
    corners = int(mesh.cells[:, :4].max()) + 1
    return quadratic_mesh(mesh.nodes[:corners], mesh.cells[:, :4])


def curves(
    shape: Callable[[int], QuadraticMesh],
    counts: tuple[int, ...],
    fine: tuple[int, ...],
    of: Material,
    truth: FloatArray,
    times: int,
) -> list[Point]:
    """Every family at every size; four-node cells at ``fine`` too, to have as many unknowns."""
    found = []
    for count in (*counts, *fine):
        mesh = shape(count)
        flat = straight(mesh)
        works: dict[str, tuple[Solved, int]] = {
            "four nodes": (partial(four, mesh, of, len(truth)), 3 * (int(mesh.cells[:, :4].max()) + 1))
        }
        if count in counts:
            works["ten nodes, straight"] = (partial(ten, flat, of, len(truth)), 3 * len(mesh.nodes))
            works["ten nodes, on the shape"] = (partial(ten, mesh, of, len(truth)), 3 * len(mesh.nodes))
        for family, (work, unknowns) in works.items():
            got, took = repeated(work, times)
            found.append(Point(family, unknowns, took, float(np.abs(got / truth - 1.0).max())))
    return found


def kept(count: int, times: int) -> tuple[list[Point], list[Point]]:
    """Errors of the cup's sounds over seconds of solving, and over those of synthesis."""
    mesh = cup(count)
    whole = solve_mesh(mesh, CERAMIC, HEARING).modes
    random = np.random.default_rng(0)
    struck = random.choice(len(whole.points), STRIKES, replace=False)
    points, ways = whole.points[struck], -whole.normals[struck]
    solving, sounding = [], []
    reference = sounds(whole, points, ways, len(whole.frequencies))
    for share in SHARES:
        number = max(1, round(share * len(whole.frequencies)))
        _, took = repeated(partial(solved, mesh, number), times)
        _, spent = repeated(partial(sounds, whole, points[:1], ways[:1], number), times)
        left = sounds(whole, points, ways, number) - reference
        energy = np.sum(left**2, axis=1) / np.sum(reference**2, axis=1)
        error = 10.0 * np.log10(max(float(np.median(energy)), 1e-30))
        solving.append(Point("solve", number, took, error))
        sounding.append(Point("synthesis", number, spent, error))
    return solving, sounding


def solved(mesh: QuadraticMesh, most: int) -> FloatArray:
    """Hz of its lowest modes."""
    return solve_mesh(mesh, CERAMIC, HEARING, most=most).modes.frequencies


def sounds(modes: Modes, points: FloatArray, ways: FloatArray, number: int) -> FloatArray:
    """``(k, t)``: accelerations of the struck places, of the lowest ``number`` of the modes."""
    frequencies = modes.frequencies[:number]
    turns = 2.0 * BLOW * frequencies
    # The spectrum of half a sine, over its value at 0 Hz.
    driven = np.cos(0.5 * np.pi * turns) / np.where(turns == 1.0, 1.0, 1.0 - turns**2)
    gains = modes.gains(points, ways)[:, :number] ** 2 * 2.0 * np.pi * frequencies * driven
    return synthesize(frequencies, dampings(frequencies, CERAMIC), gains, DURATION, RATE).sound


def growth(points: list[Point]) -> tuple[float, float]:
    """Exponents of seconds and of error by unknowns, of the larger half."""
    chosen = points[len(points) // 2 - (len(points) < 4) :]
    size = np.log([point.unknowns for point in chosen])
    time_power = np.polyfit(size, np.log([point.median for point in chosen]), 1)[0]
    error_power = np.polyfit(size, np.log([max(point.error, 1e-15) for point in chosen]), 1)[0]
    return float(time_power), float(error_power)


def order_table(title: str, points: list[Point]) -> Table:
    """A row a setting, a line of growth a family."""
    table = Table(title=title)
    for heading in ("cells", "unknowns", "s: median (extremes)", "worst error"):
        table.add_column(heading, justify="right")
    for family in COLOURS:
        mine = [point for point in points if point.family == family]
        for point in mine:
            took = f"{point.median:.3f} ({min(point.seconds):.3f} to {max(point.seconds):.3f})"
            table.add_row(family, str(point.unknowns), took, f"{point.error:.1e}")
        if len(mine) > 1:
            of_time, of_error = growth(mine)
            table.add_row("", "grow as", f"unknowns ^ {of_time:.2f}", f"unknowns ^ {of_error:.2f}")
    return table


def kept_table(title: str, solving: list[Point], sounding: list[Point]) -> Table:
    """Modes kept."""
    table = Table(title=title)
    for heading in ("modes", "solve s", "one sound of 3 s, ms", "error dB"):
        table.add_column(heading, justify="right")
    for one, other in zip(solving, sounding, strict=True):
        table.add_row(str(one.unknowns), f"{one.median:.2f}", f"{1e3 * other.median:.2f}", f"{one.error:.0f}")
    return table


def draw_order(axes: Axes, title: str, points: list[Point]) -> None:
    """A curve a family; the unknowns beside its ends."""
    for family, colour in COLOURS.items():
        mine = sorted((p for p in points if p.family == family), key=lambda p: p.median)
        at = np.array([(point.median, point.error) for point in mine])
        spread = np.array([(p.median - min(p.seconds), max(p.seconds) - p.median) for p in mine]).T
        axes.errorbar(
            at[:, 0], at[:, 1], xerr=spread, marker="o", ms=4, color=colour, label=family, elinewidth=0.7
        )
        for point in (mine[0], mine[-1]):
            where = (point.median, point.error)
            axes.annotate(f"{point.unknowns}", where, (4, 4), textcoords="offset points", fontsize=7)
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_title(title, fontsize=10)
    axes.set_xlabel("process seconds, one thread")
    axes.set_ylabel("worst relative error")
    axes.grid(visible=True, color="#e6e8eb", lw=0.8)
    axes.legend(frameon=False, fontsize=8)


def picture(
    ball: list[Point], mug: list[Point], solving: list[Point], sounding: list[Point], out: Path
) -> None:
    """Three drawings side by side."""
    with styled():
        figure = blank(13.5, 4.4)
        figure.set_layout_engine("constrained")
        left, middle, right = figure.subplots(1, 3)
        draw_order(left, f"sphere, first {SPHERE_MODES} modes against Lamb", ball)
        draw_order(middle, f"cup, first {CUP_MODES} modes against its finest mesh", mug)
        numbers = [point.unknowns for point in solving[:-1]]  # of all of them there is no error to draw
        right.plot(numbers, [p.error for p in solving[:-1]], "o-", color=COLOURS["ten nodes, on the shape"])
        for one, other in zip(solving[:-1], sounding, strict=False):
            text = f"{one.median:.2f} s + {1e3 * other.median:.2f} ms"
            where = (one.unknowns, one.error)
            right.annotate(text, where, (5, 5), textcoords="offset points", fontsize=7, color=SOFT)
        right.set_ylim(min(point.error for point in solving[:-1]) - 6.0, 3.0)
        right.set_xlim(0.0, solving[-1].unknowns)
        right.set_title("cup: lowest modes kept (solve + synthesis of 3 s)", fontsize=10)
        right.set_xlabel("modes kept")
        right.set_ylabel("error energy of the sound, dB (median of strikes)")
        right.grid(visible=True, color="#e6e8eb", lw=0.8)
        figure.savefig(out)


def main() -> None:
    """Measure, print, and draw where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="the sizes that take minutes")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, help="a picture, PNG")
    asked = parser.parse_args()
    speed = np.sqrt(STEEL.young / (2.0 * (1.0 + STEEL.poisson) * STEEL.density))
    lamb = np.repeat([2.501133, 2.639869], 5) * speed / (2.0 * np.pi * BALL)
    sizes = ((1, 2, 3, 4, 6, 8), (10, 14)) if asked.full else ((1, 2, 3), (4,))
    cups, finest = ((12, 18, 26, 36, 48), 70) if asked.full else ((8, 12), 18)
    with threadpool_limits(limits=1):
        ten(exact_ball(BALL, 1), STEEL, 1)
        ball = curves(partial(exact_ball, BALL), sizes[0], sizes[1], STEEL, lamb, asked.repeats)
        truth = ten(cup(finest), CERAMIC, CUP_MODES)
        mug = curves(cup, cups, (), CERAMIC, truth, asked.repeats)
        solving, sounding = kept(36 if asked.full else 12, asked.repeats)
    console = Console(width=110)
    console.print(order_table(f"sphere, first {SPHERE_MODES} modes against Lamb", ball))
    console.print(order_table(f"cup, first {CUP_MODES} modes, against {finest} cells a side", mug))
    console.print(kept_table("modes kept", solving, sounding))
    if asked.out is not None:
        picture(ball, mug, solving, sounding, asked.out)


if __name__ == "__main__":
    main()
