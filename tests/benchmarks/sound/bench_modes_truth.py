"""Errors of the modes against what is known without a finite element, and the CPU seconds they cost.

``PYTHONPATH=. python tests/benchmarks/sound/bench_modes_truth.py [--fine] [--only CASE ...] [--repeats N]``
prints one row a case: unknowns, process seconds of assembly and solve on one thread (of the sphere and
the boxes the median and extremes of the repeats), and the worst relative error of the modes named.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from manifold3d import Manifold

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.materials import MATERIALS, Material
from harness.basics.mesh import Mesh
from harness.objects.solid import from_manifold
from harness.sim.modal.element_edge import finely_filled
from harness.sim.modal.modal import curved
from harness.sim.modal.solve import Solution, solve_mesh
from harness.sim.solid.tetrahedra import QuadraticMesh
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.oracles.exact_bars import astm_bending, astm_torsion
from tests.oracles.exact_plate import guided_plate, on_lower_edges, sliding_sides
from tests.oracles.exact_solids import exact_ball, exact_box, octant_shell, on_planes, radial_frequencies
from tests.oracles.ritz_box import ritz_frequencies

STEEL = MATERIALS["steel"]
NAFEMS = Material("", 8000.0, 2e11, 0.3, 0.0, 0.0)
CASES = ("balls", "boxes", "bars", "hollow", "plates", "supported", "counted", "thin")
BRICKS = (
    ((60.0, 60.0, 60.0), 0.29),
    ((60.0, 45.0, 30.0), 0.4),
    ((60.0, 50.0, 20.0), 0.1),
    ((100.0, 80.0, 10.0), 0.29),
    ((200.0, 20.0, 10.0), 0.29),
)
"""mm, and Poisson's ratio."""
THIN = (((100.0, 80.0, 4.0), 0.29),)
UP_TO = (
    ((100.0, 80.0, 4.0), None),
    ((100.0, 80.0, 2.0), None),
    ((100.0, 100.0, 1.0), None),
    ((120.0, 30.0, 2.0), None),
    ((60.0, 20.0, 1.0), None),
    ((30.0, 20.0, 0.5), None),
    ((100.0, 80.0, 0.5), None),
    ((100.0, 80.0, 4.0), 20e3),
    ((100.0, 80.0, 3.0), 20e3),
)
"""mm, and Hz; None for a little above the tenth mode."""

Row = tuple[str, int, list[float], float]


def timed(
    mesh: QuadraticMesh,
    material: Material,
    count: int | None,
    times: int = 1,
    held: BoolArray | None = None,
    limit: float = np.inf,
) -> tuple[Solution, list[float]]:
    """The lowest ``count`` modes, or all up to a limit in Hz, and the process seconds of each repeat."""
    took = []
    for _ in range(times):
        begun = time.process_time()
        solved = solve_mesh(mesh, material, limit, least=count, held=held)
        took.append(time.process_time() - begun)
    return solved, took


def error(solved: Solution, expected: FloatArray) -> float:
    """The worst relative one."""
    return float(np.abs(solved.modes.frequencies[: len(expected)] / expected - 1.0).max())


def balls(counts: tuple[int, ...], times: int) -> Iterator[Row]:
    """Lamb's first ten modes on exact geometry."""
    material = replace(STEEL, poisson=0.25)
    unit = np.sqrt(material.young / (2.5 * material.density)) / (2.0 * np.pi * 0.03)
    expected = unit * np.repeat([2.501133, 2.639869], 5)
    for count in counts:
        solved, took = timed(exact_ball(0.03, count), material, 10, times)
        yield (
            f"Lamb's sphere, {count} edges a radius, 10 modes",
            solved.unknowns,
            took,
            error(solved, expected),
        )


def boxes(counts: tuple[int, ...], times: int, trials: int = 2) -> Iterator[Row]:
    """Free boxes of random sides and ratios, ten modes."""
    random = np.random.default_rng(7)
    for _ in range(trials):
        sides = (0.06, 0.06 * random.uniform(0.5, 1.0), 0.06 * random.uniform(0.3, 1.0))
        material = replace(STEEL, poisson=random.uniform(0.0, 0.45))
        expected = ritz_frequencies(sides, material, 18)[:10]
        for count in counts:
            number = [max(3, round(count * side / 0.06)) for side in sides]
            solved, took = timed(exact_box(sides, (number[0], number[1], number[2])), material, 10, times)
            name = " x ".join(f"{1e3 * side:.1f}" for side in sides)
            yield (
                f"box {name} mm, ratio {material.poisson:.2f}",
                solved.unknowns,
                took,
                error(solved, expected),
            )


def bars(counts: tuple[int, ...]) -> Iterator[Row]:
    """The bar of ASTM E1876, on cells three times as long as they are wide: both formulas, both exact."""
    sides, weight = (0.2, 0.02, 0.01), STEEL.density * 0.2 * 0.02 * 0.01
    cases = (
        ("bending", (1, 1, -1), astm_bending(*sides, weight, STEEL)),
        ("torsion", (-1, -1, -1), astm_torsion(*sides, weight, STEEL)),
    )
    for name, kind, standard in cases:
        exact = ritz_frequencies(sides, STEEL, 20, kind)[0]
        yield f"bar, {name}: the standard's formula itself", 0, [0.0], standard / exact - 1.0
        for count in counts:
            eighth = exact_box((0.1, 0.01, 0.005), (7 * count, 2 * count, count))
            solved, took = timed(eighth, STEEL, None, held=on_planes(eighth, kind), limit=1.2 * exact)
            found = solved.modes.frequencies[0] / exact - 1.0
            yield f"bar, {name}, {2 * count} cells through its thickness", solved.unknowns, took, found


def hollow(counts: tuple[int, ...]) -> Iterator[Row]:
    """FV42, an eighth, the first radial mode: the mode in range that is purely radial outside."""
    expected = radial_frequencies(1.8, 6.0, NAFEMS, 500.0)[0]
    for count in counts:
        eighth = octant_shell(1.8, 6.0, count, count + 1)
        solved, took = timed(eighth, NAFEMS, None, held=on_planes(eighth, (1, 1, 1)), limit=1.1 * expected)
        nearest = solved.modes.frequencies[np.argmin(np.abs(solved.modes.frequencies - expected))]
        yield "thick hollow sphere (FV42), first radial mode", solved.unknowns, took, nearest / expected - 1.0


def plates(counts: tuple[int, ...]) -> Iterator[Row]:
    """FV12, whose published values are a thin plate's; beside it the plate as the solid that it is."""
    published = np.array([1.622, 2.360, 2.922, 4.233, 4.233, 7.416])
    solid = ritz_frequencies((10.0, 10.0, 0.05), NAFEMS, 20)[:6]
    yield "free plate (FV12), the published values as a solid's", 0, [0.0], _worst(published, solid)
    for count in counts:
        solved, took = timed(exact_box((10.0, 10.0, 0.05), (count, count, 1)), NAFEMS, 6)
        found = solved.modes.frequencies[:6]
        yield "free plate (FV12), as published: thin, 1.2 %", solved.unknowns, took, _worst(found, published)
        yield "free plate (FV12), as a solid", solved.unknowns, took, _worst(found, solid)


def supported(sizes: tuple[tuple[int, int], ...]) -> Iterator[Row]:
    """FV52: held across its lower edges, lines, which hold a solid the less the finer its mesh: 4 %.

    Beside it the plate whose sides are held along themselves, of which the exact modes are known.
    """
    published = np.array([45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19])
    for across, layers in sizes:
        mesh = exact_box((10.0, 10.0, 1.0), (across, across, layers))
        solved, took = timed(mesh, NAFEMS, 7, held=on_lower_edges(mesh))
        lowest = solved.modes.frequencies[0] / published[0] - 1.0
        yield "plate on its lower edges (FV52), lowest mode, as published", solved.unknowns, took, lowest
        found = solved.modes.frequencies[:7]
        yield "plate on its lower edges (FV52), 7 modes: 4 %", solved.unknowns, took, _worst(found, published)
        solved, took = timed(mesh, NAFEMS, 3, held=sliding_sides(mesh))
        exact = guided_plate(10.0, 1.0, NAFEMS)[:3]
        found = solved.modes.frequencies[:3]
        yield "plate on its sides, 3 modes, Rayleigh and Lamb", solved.unknowns, took, _worst(found, exact)


def counted(numbers: tuple[int, ...]) -> Iterator[Row]:
    """Surfaces of which so many modes are asked and no edge, filled as ``touchstone sim modes`` does."""
    yield from counted_boxes(numbers, BRICKS)
    ball = replace(STEEL, poisson=0.25)
    eta = np.repeat([2.501133, 2.639869, 3.424530, 3.864700], [5, 5, 3, 7])
    lamb = eta * np.sqrt(ball.young / (2.5 * ball.density)) / (2.0 * np.pi * 0.03)
    yield from _counted("Lamb's sphere, 30 mm", Manifold.sphere(30.0, 160), ball, lamb, numbers)


def counted_boxes(
    numbers: tuple[int, ...], boxes_of: tuple[tuple[tuple[float, float, float], float], ...]
) -> Iterator[Row]:
    """The same of boxes, by their sides in mm and Poisson's ratio."""
    for sides, poisson in boxes_of:
        material = replace(STEEL, poisson=poisson)
        exact = ritz_frequencies(_metres(sides), material, 20)
        yield from _counted(f"box {sides} mm", Manifold.cube(sides), material, exact, numbers)


def thin(numbers: tuple[int, ...], plates_of: int) -> Iterator[Row]:
    """The same of a thin plate; then without their number, all modes of some plates up to a frequency."""
    yield from counted_boxes(numbers, THIN)
    for sides, limit in UP_TO[:plates_of]:
        exact = ritz_frequencies(_metres(sides), STEEL, 20 if limit is None else 24)
        highest = limit or float(1.01 * exact[9])
        name, shape = f"plate {sides} mm", Manifold.cube(sides)
        yield from _counted(name, shape, STEEL, exact, (int((exact < highest).sum()),), highest)


def _counted(
    name: str,
    shape: Manifold,
    material: Material,
    exact: FloatArray,
    numbers: tuple[int, ...],
    limit: float = np.inf,
) -> Iterator[Row]:
    solid = from_manifold(shape)
    surface = Mesh(solid.vertices * 1e-3, solid.faces)
    for number in numbers:
        count = number if limit == np.inf else None
        inside, _, _ = finely_filled(surface, material, limit, count, None)
        solved, took = timed(curved(inside, surface, inside), material, count, limit=limit)
        asked = f"{number} modes" if count else f"all {number} up to {limit:.0f} Hz"
        shown = f"{name}, ratio {material.poisson:g}, {asked} asked of its surface"
        # A mode a little below the limit may be solved above it.
        sure = len(solved.modes.frequencies) if count is None else number
        yield shown, solved.unknowns, took, error(solved, exact[: min(number, sure)])


def _metres(sides: tuple[float, float, float]) -> tuple[float, float, float]:
    return (1e-3 * sides[0], 1e-3 * sides[1], 1e-3 * sides[2])


def _worst(found: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(found / expected - 1.0).max())


def main() -> None:
    """Print the table; ``--fine`` adds the sizes that take a minute."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--fine", action="store_true", help="the sizes that take a minute")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    asked = parser.parse_args()
    fine, times = asked.fine, asked.repeats
    rows: dict[str, Callable[[], Iterator[Row]]] = {
        "balls": lambda: balls((2, 3, 4, 5, 6, 8) if fine else (2, 3), times),
        "boxes": lambda: boxes((6, 10) if fine else (4,), times),
        "bars": lambda: bars((1, 2, 3) if fine else (1, 2)),
        "hollow": lambda: hollow((4, 6, 9) if fine else (4,)),
        "plates": lambda: plates((16, 24, 36) if fine else (8,)),
        "supported": lambda: supported(((8, 1), (16, 2), (32, 4)) if fine else ((4, 1), (8, 1))),
        "counted": lambda: counted((10, 20) if fine else (10,)),
        "thin": lambda: thin((10, 20), len(UP_TO)) if fine else thin((10,), 1),
    }
    heads = "case; unknowns; assembly and solution, one thread [CPU s] .2f; largest relative error .2e"
    for case in asked.only:
        found = [
            (name, unknowns or None, spread(took) if len(took) > 1 else took[0], worst)
            for name, unknowns, took, worst in rows[case]()
        ]
        finish_figure("modes", case, heads, found)


if __name__ == "__main__":
    main()
