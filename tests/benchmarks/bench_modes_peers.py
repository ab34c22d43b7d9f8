"""CPU seconds of the same modes of the same mesh: ours, CalculiX, and scipy as a user would write it.

``PYTHONPATH=tests python tests/benchmarks/bench_modes_peers.py [--unknowns N] [--modes N] [--repeats N]
[--peer-repeats N] [--scipy] [--no-quiet]`` fills a mug, solves it, and prints medians with their
extremes. Process time of one thread; the peers run on the same ten-node cells. Without CalculiX its
rows say so.
"""

import argparse
import shutil
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from calculix import WHY_NOT, run, write_input
from rich.console import Console
from rich.table import Table
from scipy.sparse.linalg import eigsh
from sized_mug import mug
from threadpoolctl import threadpool_limits

from harness.arrays import FloatArray
from harness.materials import MATERIALS, Material
from harness.sim.modal_mesh import QuadraticMesh
from harness.sim.modal_solve import Elasticity, solve_mesh
from harness.sim.modal_system import modal_system

CERAMIC = MATERIALS["ceramic"]


def repeated(work: Callable[[], FloatArray], times: int) -> tuple[FloatArray, list[float]]:
    """Hz of the last run, and process seconds of each."""
    took, found = [], np.zeros(0)
    for _ in range(times):
        begun = time.process_time()
        found = work()
        took.append(time.process_time() - begun)
    return found, took


def ours(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz, certified."""
    return solve_mesh(mesh, of, np.inf, least=count).modes.frequencies[:count]


def plain_scipy(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz, by ``eigsh`` with a shift below zero, on our matrices."""
    uniform = Elasticity.uniform(of, len(mesh.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    values = eigsh(system.stiffness, count + 6, system.inertia(), sigma=-1e4, which="LM")[0]
    return np.asarray(np.sqrt(np.sort(values)[6:]) / (2.0 * np.pi))


def calculix(mesh: QuadraticMesh, of: Material, count: int, quiet: bool, times: int) -> list[float]:
    """Process seconds of each run of ``ccx``."""
    program = shutil.which("ccx")
    assert program is not None
    with TemporaryDirectory(prefix="touchstone-ccx-") as folder:
        write_input(Path(folder) / "job.inp", mesh, of, count + 6, quiet=quiet)
        return [run(program, Path(folder), "job")[1] for _ in range(times)]


def forget_peak() -> None:
    """Let the kernel note the process's peak of memory anew."""
    Path("/proc/self/clear_refs").write_text("5")


def peak() -> str:
    """MB of this process at its peak, the interpreter and the mesh among them."""
    status = Path("/proc/self/status").read_text()
    return f"{int(status.split('VmHWM:')[1].split()[0]) / 1024:.0f}"


def said(took: Sequence[float]) -> str:
    """Median and extremes."""
    return f"{np.median(took):.2f} ({min(took):.2f} to {max(took):.2f})"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--unknowns", type=int, default=30_000)
    parser.add_argument("--modes", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--scipy", action="store_true")
    parser.add_argument("--peer-repeats", type=int)
    parser.add_argument("--no-quiet", action="store_const", const=1, default=2, dest="outputs")
    asked = parser.parse_args()
    times = asked.peer_repeats or asked.repeats
    mesh = mug(asked.unknowns)
    ours(mesh, CERAMIC, 1)
    with threadpool_limits(limits=1):
        forget_peak()
        found, base = repeated(lambda: ours(mesh, CERAMIC, asked.modes), asked.repeats)
        table = Table(title=f"mug, {3 * len(mesh.nodes)} unknowns, {asked.modes} modes: median (extremes)")
        for heading in ("program", "CPU s", "times ours", "peak MB"):
            table.add_column(heading)
        table.add_row("ours, counted", said(base), "1", peak())
        rows: list[tuple[str, list[float], str]] = []
        if asked.scipy:
            forget_peak()
            theirs, took = repeated(lambda: plain_scipy(mesh, CERAMIC, asked.modes), times)
            rows.append((f"scipy eigsh (apart by {np.abs(theirs / found - 1.0).max():.0e})", took, peak()))
        if shutil.which("ccx") is None:
            table.add_row(WHY_NOT, "", "", "")
        else:
            for name, quiet in (("CalculiX", False), ("CalculiX, without output", True))[: asked.outputs]:
                took = calculix(mesh, CERAMIC, asked.modes, quiet, times)
                rows.append((name, took, ""))
    for name, took, most_mb in rows:
        table.add_row(name, said(took), f"{np.median(took) / np.median(base):.1f}", most_mb)
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
