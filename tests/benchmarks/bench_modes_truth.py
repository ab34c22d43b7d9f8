"""Errors of the modes against what is known without a finite element, and the CPU seconds they cost.

``PYTHONPATH=tests python tests/benchmarks/bench_modes_truth.py [--fine]`` prints one row a case:
unknowns, process seconds of assembly and solve on one thread, and the worst relative error of the
modes named.
"""

import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from exact_solids import exact_ball, exact_box, octant_shell, on_planes, radial_frequencies
from rich.console import Console
from rich.table import Table
from ritz_box import ritz_frequencies

from harness.arrays import FloatArray
from harness.materials import MATERIALS, Material
from harness.sim.modal_mesh import QuadraticMesh
from harness.sim.modal_solve import Solution, solve_mesh

STEEL = MATERIALS["steel"]
NAFEMS = Material("", 8000.0, 2e11, 0.3, 0.0, 0.0)
Row = tuple[str, int, float, float]


def timed(mesh: QuadraticMesh, material: Material, count: int) -> tuple[Solution, float]:
    """The lowest ``count`` modes and the process seconds they took."""
    begun = time.process_time()
    solved = solve_mesh(mesh, material, np.inf, least=count)
    return solved, time.process_time() - begun


def error(solved: Solution, expected: FloatArray) -> float:
    """The worst relative one."""
    return float(np.abs(solved.modes.frequencies[: len(expected)] / expected - 1.0).max())


def balls(counts: tuple[int, ...]) -> Iterator[Row]:
    """Lamb's first ten modes on exact geometry."""
    material = replace(STEEL, poisson=0.25)
    unit = np.sqrt(material.young / (2.5 * material.density)) / (2.0 * np.pi * 0.03)
    expected = unit * np.repeat([2.501133, 2.639869], 5)
    for count in counts:
        solved, took = timed(exact_ball(0.03, count), material, 10)
        yield (
            f"Lamb's sphere, {count} edges a radius, 10 modes",
            solved.unknowns,
            took,
            error(solved, expected),
        )


def boxes(counts: tuple[int, ...], trials: int = 2) -> Iterator[Row]:
    """Free boxes of random sides and ratios, ten modes."""
    random = np.random.default_rng(7)
    for _ in range(trials):
        sides = (0.06, 0.06 * random.uniform(0.5, 1.0), 0.06 * random.uniform(0.3, 1.0))
        material = replace(STEEL, poisson=random.uniform(0.0, 0.45))
        expected = ritz_frequencies(sides, material, 18)[:10]
        for count in counts:
            number = [max(3, round(count * side / 0.06)) for side in sides]
            solved, took = timed(exact_box(sides, (number[0], number[1], number[2])), material, 10)
            name = " x ".join(f"{1e3 * side:.1f}" for side in sides)
            yield (
                f"box {name} mm, ratio {material.poisson:.2f}",
                solved.unknowns,
                took,
                error(solved, expected),
            )


def hollow(counts: tuple[int, ...]) -> Iterator[Row]:
    """FV42, an eighth, the first radial mode: the mode in range that is purely radial outside."""
    expected = radial_frequencies(1.8, 6.0, NAFEMS, 500.0)[0]
    for count in counts:
        eighth = octant_shell(1.8, 6.0, count, count + 1)
        begun = time.process_time()
        solved = solve_mesh(eighth, NAFEMS, 1.1 * expected, held=on_planes(eighth, (1, 1, 1)))
        took = time.process_time() - begun
        nearest = solved.modes.frequencies[np.argmin(np.abs(solved.modes.frequencies - expected))]
        yield "thick hollow sphere (FV42), first radial mode", solved.unknowns, took, nearest / expected - 1.0


def plates(counts: tuple[int, ...]) -> Iterator[Row]:
    """FV12, whose published values are a thin plate's; beside it the plate as the solid that it is."""
    published = np.array([1.622, 2.360, 2.922, 4.233, 4.233, 7.416])
    solid = ritz_frequencies((10.0, 10.0, 0.05), NAFEMS, 20)[:6]
    for count in counts:
        solved, took = timed(exact_box((10.0, 10.0, 0.05), (count, count, 1)), NAFEMS, 6)
        yield "free plate (FV12), as published: thin, 1.2 %", solved.unknowns, took, error(solved, published)
        yield "free plate (FV12), as a solid", solved.unknowns, took, error(solved, solid)


def supported(counts: tuple[int, ...]) -> Iterator[Row]:
    """FV52: held across its lower edges, a support so local that the solid is softer: 4 %."""
    published = np.array([45.897, 109.44, 109.44, 167.89, 193.59, 206.19, 206.19])
    for count in counts:
        mesh = exact_box((10.0, 10.0, 1.0), (count, count, 1))
        low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
        rim = ((mesh.nodes == low) | (mesh.nodes == high))[:, :2].any(axis=1) & (mesh.nodes[:, 2] == 0.0)
        held = np.zeros(mesh.nodes.shape, dtype=np.bool_)
        held[rim, 2] = True
        begun = time.process_time()
        solved = solve_mesh(mesh, NAFEMS, np.inf, least=7, held=held)
        took = time.process_time() - begun
        yield "supported plate (FV52), as published: 4 %", solved.unknowns, took, error(solved, published)


def main() -> None:
    """Print the table; ``--fine`` adds the sizes that take a minute."""
    fine = "--fine" in sys.argv[1:]
    table = Table(title="process seconds of assembly and solve on one thread")
    for heading in ("case", "unknowns", "s", "worst error"):
        table.add_column(heading)
    cases = (
        balls((2, 3, 4, 6, 8) if fine else (2, 3)),
        boxes((6, 10) if fine else (4,)),
        hollow((4, 6, 9) if fine else (4,)),
        plates((16, 24) if fine else (8,)),
        supported((8, 16) if fine else (4,)),
    )
    for rows in cases:
        for name, unknowns, took, worst in rows:
            table.add_row(name, str(unknowns), f"{took:.2f}", f"{worst:.2e}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
