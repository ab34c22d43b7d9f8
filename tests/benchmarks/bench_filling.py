"""Seconds to fill a surface with tetrahedra, beside fTetWild as it comes, and what volume both keep.

``python tests/benchmarks/bench_filling.py [object ...] [--repeats N]`` fills built-in objects with the
edge of their modes up to 20 kHz, both on one thread and taking turns: process seconds, cells, and the
volume of the cells relative to the surface's. As it comes: the same edge, and every other option as in
``pytetwild``, its simplification, envelope and stopping energy.
"""

import argparse
import contextlib
import tempfile
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

from harness.arrays import FloatArray, IntArray
from harness.materials import material
from harness.mesh import Mesh
from harness.objects.household import MATERIALS, build
from harness.sim.modal import HEARING, default_edge
from harness.sim.tetrahedra import signed_volumes, tetrahedralize

Filled = tuple[FloatArray, IntArray]


def ours(mesh: Mesh, edge: float) -> Filled:
    """As ``touchstone`` fills."""
    found = tetrahedralize(mesh, edge)
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


def main() -> None:
    """Print one table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("objects", nargs="*", default=["mug"])
    parser.add_argument("--repeats", type=int, default=1)
    asked = parser.parse_args()
    table = Table("object", "filled", "s: median (extremes)", "times ours", "cells", "volume")
    for name in asked.objects:
        mesh = build(name)
        edge = default_edge(mesh, material(MATERIALS[name]), HEARING, 128)
        inside = float(
            np.einsum("ij,ij->", mesh.corners[:, 0], np.cross(mesh.corners[:, 1], mesh.corners[:, 2]))
        )
        took: dict[str, list[float]] = {}
        for _ in range(asked.repeats):
            ways: dict[str, Callable[[Mesh, float], Filled]] = {"ours": ours, "as it comes": as_it_comes}
            for way, fill in ways.items():
                begun = time.process_time()
                nodes, cells = fill(mesh, edge)
                took.setdefault(way, []).append(time.process_time() - begun)
                off = abs(signed_volumes(nodes, cells)).sum() / (inside / 6.0) - 1.0
                ratio = np.median(np.array(took[way]) / np.array(took["ours"]))
                spread = f"{np.median(took[way]):.1f} ({min(took[way]):.1f} to {max(took[way]):.1f})"
                table.add_row(name, way, spread, f"{ratio:.2f}", str(len(cells)), f"{off:+.1e}")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
