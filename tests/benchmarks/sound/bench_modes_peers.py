"""CPU seconds of the same modes of the same mesh: ours, CalculiX, and scipy as a user would write it.

``PYTHONPATH=. python tests/benchmarks/sound/bench_modes_peers.py [--unknowns N] [--modes N] [--repeats N]
[--peer-repeats N] [--scipy] [--no-quiet]`` fills a mug, solves it, and prints medians with their
extremes after every round. Process time of one thread; the programs take turns, so that what else the
machine does slows each alike, and solve the same ten-node cells. Without CalculiX it says so.
"""

import shutil
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from scipy.sparse.linalg import eigsh
from threadpoolctl import threadpool_limits

from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS, Material
from harness.sim.modal.solve import Elasticity, solve_mesh
from harness.sim.modal.system import modal_system
from harness.sim.solid.tetrahedra import QuadraticMesh
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.oracles.calculix import WHY_NOT, Run, run, write_input
from tests.samples.sized_mug import mug

CERAMIC = MATERIALS["ceramic"]
OURS = "Touchstone"


def ours(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz, certified."""
    return solve_mesh(mesh, of, np.inf, least=count).modes.frequencies[:count]


def plain_scipy(mesh: QuadraticMesh, of: Material, count: int) -> FloatArray:
    """Hz, by ``eigsh`` with a shift below zero, on our matrices."""
    uniform = Elasticity.uniform(of, len(mesh.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    values = eigsh(system.stiffness, count + 6, system.inertia(), sigma=-1e4, which="LM")[0]
    return np.asarray(np.sqrt(np.sort(values)[6:]) / (2.0 * np.pi))


def calculix(mesh: QuadraticMesh, of: Material, count: int, quiet: bool) -> Run:
    """One run of ``ccx``."""
    program = shutil.which("ccx")
    assert program is not None
    with TemporaryDirectory(prefix="touchstone-ccx-") as folder:
        write_input(Path(folder) / "job.inp", mesh, of, count + 6, quiet=quiet)
        return run(program, Path(folder), "job")


def here(work: Callable[[], FloatArray]) -> Run:
    """Hz, process seconds and MB of what runs in this process."""
    Path("/proc/self/clear_refs").write_text("5")  # the kernel notes the peak of memory anew
    begun = time.process_time()
    found = work()
    return Run(found, time.process_time() - begun, peak())


def peak() -> float:
    """MB of this process at its peak, the interpreter and the mesh among them."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def show(case: str, ran: dict[str, list[Run]]) -> None:
    """Print or write a row for each program; ratios are of the two runs of one round."""
    base, rows = ran[OURS], []
    for name, runs in ran.items():
        ratios = [one.seconds / other.seconds for one, other in zip(runs, base, strict=False)]
        apart = hertz(name, runs[-1]) / base[-1].values - 1.0
        most = max(one.peak for one in runs)
        took = spread([one.seconds for one in runs])
        rows.append((f"{name}, {case}", len(runs), took, spread(ratios), most, float(np.abs(apart).max())))
    heads = "program; runs; CPU time [s] .2f; over Touchstone, round by round .1f; peak memory [MB] .0f"
    finish_figure("modes", "peers", f"{heads}; largest relative difference of a frequency .0e", rows)


def hertz(name: str, one: Run) -> FloatArray:
    """CalculiX gives squares, the rigid motions among them."""
    return np.sqrt(one.values[6:]) / (2.0 * np.pi) if name.startswith("CalculiX") else one.values


def main() -> None:
    """Measure and print."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--unknowns", type=int, default=30_000)
    parser.add_argument("--modes", type=int, default=60)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--peer-repeats", type=int, help="rounds in which the peers run too, the first ones")
    parser.add_argument("--scipy", action="store_true")
    parser.add_argument("--no-quiet", action="store_true", help="CalculiX with its usual output alone")
    asked = parser.parse_args()
    mesh = mug(asked.unknowns)
    works: dict[str, Callable[[], Run]] = {OURS: lambda: here(lambda: ours(mesh, CERAMIC, asked.modes))}
    if asked.scipy:
        works["scipy eigsh"] = lambda: here(lambda: plain_scipy(mesh, CERAMIC, asked.modes))
    if shutil.which("ccx") is None:
        Console().print(WHY_NOT)
    else:
        works["CalculiX"] = lambda: calculix(mesh, CERAMIC, asked.modes, quiet=False)
        if not asked.no_quiet:
            works["CalculiX, without output"] = lambda: calculix(mesh, CERAMIC, asked.modes, quiet=True)
    ours(mesh, CERAMIC, 1)
    ran: dict[str, list[Run]] = {}
    case = f"{asked.modes} modes, {3 * len(mesh.nodes)} unknowns"
    with threadpool_limits(limits=1):
        for number in range(asked.repeats):
            for name, work in works.items():
                if name == OURS or number < (asked.peer_repeats or asked.repeats):
                    ran.setdefault(name, []).append(work())
            show(case, ran)


if __name__ == "__main__":
    main()
