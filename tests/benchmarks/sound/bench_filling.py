"""Seconds to fill a surface with tetrahedra, beside fTetWild as it comes, and what volume both keep.

``python tests/benchmarks/sound/bench_filling.py [object ...] [--repeats N]`` fills built-in objects with the
edge of their modes up to 20 kHz, both on one thread and taking turns: process seconds, cells, and the
volume relative to the surface's: of the flat cells, and of the curved ones that are solved, with their
nodes on the surface. Medians and extremes of the repeats; two fillings are never the same. As it comes: the
same edge, and every other option as in ``pytetwild``, its simplification, envelope and stopping energy. Ours
once more in the envelope that it has, a thousandth of the diagonal; our own is up to twice that.
"""

import contextlib
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.materials import material
from harness.basics.mesh import Mesh
from harness.objects.household import MATERIALS, build
from harness.sim.modal.modal import HEARING, curved, default_edge, held_volume
from harness.sim.solid.tetrahedra import tetrahedra, tetrahedralize
from harness.sim.solid.walls import enclosed_volume
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.docs.results import Cell

Filled = tuple[FloatArray, IntArray]

ITS_ENVELOPE = 1e-3
"""Of the diagonal, in ``pytetwild`` where nobody says another."""


def ours(mesh: Mesh, edge: float) -> Filled:
    """As ``touchstone`` fills."""
    found = tetrahedralize(mesh, edge)
    return found.nodes, found.cells


def ours_closer(mesh: Mesh, edge: float) -> Filled:
    """The same, no farther from the surface than ``pytetwild`` goes by itself."""
    found = tetrahedralize(mesh, edge, ITS_ENVELOPE * mesh.diagonal)
    return found.nodes, found.cells


def as_it_comes(mesh: Mesh, edge: float) -> Filled:
    """With the options that it has by itself."""
    from pytetwild.pytetwild import tetrahedralize as fill

    # It leaves a file of its own in the folder it runs in.
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        nodes, cells = fill(
            mesh.vertices.copy(), mesh.faces.astype(np.int32), edge_length_abs=edge, num_threads=1,
            vtk_ordering=True,
        )  # fmt: skip
    return np.asarray(nodes, dtype=np.float64), np.asarray(cells, dtype=np.int64)


@dataclass
class Filling:
    """Fillings of one surface in one way."""

    took: list[float] = field(default_factory=list)  #: s of the processor of each.
    cells: int = 0  #: of the last.
    flat: list[float] = field(default_factory=list)
    """relative, by which each one's cells hold more than the surface encloses."""
    curved: list[float] = field(default_factory=list)  #: the same of the cells that are solved.

    def add(self, mesh: Mesh, edge: float, fill: Callable[[Mesh, float], Filled]) -> None:
        """Fill once more."""
        begun = time.process_time()
        nodes, cells = fill(mesh, edge)
        self.took.append(time.process_time() - begun)
        inside, found = enclosed_volume(mesh), tetrahedra(nodes, cells)
        self.cells = len(cells)
        self.flat.append(float(found.volumes.sum()) / inside - 1.0)
        self.curved.append(held_volume(curved(found, mesh, found)) / inside - 1.0)


def main() -> None:
    """Print or write one table."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("objects", nargs="*", default=["mug"])
    parser.add_argument("--repeats", type=int, default=1)
    asked = parser.parse_args()
    rows: list[list[Cell]] = []
    for name in asked.objects:
        mesh = build(name)
        edge = default_edge(mesh, material(MATERIALS[name]), HEARING, 128)
        ways: dict[str, Callable[[Mesh, float], Filled]] = {
            "Touchstone": ours,
            "Touchstone, envelope of 0.1 % of the diagonal": ours_closer,
            "fTetWild, default options": as_it_comes,
        }
        found = {way: Filling() for way in ways}
        for _ in range(asked.repeats):
            for way, fill in ways.items():
                found[way].add(mesh, edge, fill)
        for way, each in found.items():
            ratio = np.median(np.array(each.took) / np.array(found["Touchstone"].took))
            volumes = spread(each.flat), spread(each.curved)
            rows.append([f"{name}, {way}", spread(each.took), float(ratio), each.cells, *volumes])
    heads = "object and program; CPU time [s] .1f; over Touchstone .2f; cells"
    errors = "volume error, flat cells .1e; volume error, curved cells .1e"
    finish_figure("modes", "filling", f"{heads}; {errors}", rows)


if __name__ == "__main__":
    main()
