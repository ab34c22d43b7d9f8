"""CPU seconds of the factor of a mug's shifted stiffness, and of solves with it, beside SciPy's SuperLU.

``PYTHONPATH=. python tests/benchmarks/sound/bench_modes_factor.py [--unknowns N] [--repeats N]``
fills a mug and prints medians with their extremes: process time of one thread, numbers stored, and
the count of eigenvalues below a shift, which both must give alike.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.sparse.linalg import SuperLU, splu
from threadpoolctl import threadpool_limits

from harness.basics.materials import MATERIALS
from harness.sim.factor.elimination import elimination
from harness.sim.factor.factorisation import Factor, SparseColumns, factorised, inertia
from harness.sim.modal.solve import Elasticity
from harness.sim.modal.system import ModalSystem, modal_system
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.samples.sized_mug import mug

RIGHT_SIDES = 8
LIMIT = 2.0 * np.pi * 20e3


def repeated(work: Callable[[], Any], times: int) -> tuple[Any, list[float]]:
    """The last result, and process seconds of each repetition."""
    took, found = [], None
    for _ in range(times):
        found = None
        begun = time.process_time()
        found = work()
        took.append(time.process_time() - begun)
    return found, took


def said(took: Sequence[float]) -> str:
    """Median and extremes."""
    return f"{np.median(took):.3f} ({min(took):.3f} to {max(took):.3f})"


def superlu(matrix: SparseColumns) -> SuperLU:
    """As well as SciPy can factorise a symmetric matrix."""
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def rows(system: ModalSystem, times: int) -> list[tuple[str, str, str]]:
    """Stage, ours, SuperLU's."""
    nodes = system.mass.shape[0]
    positive, negative = system.shifted(system.shift), system.shifted(-(LIMIT**2))
    plan, planning = repeated(lambda: elimination(system.mass, np.repeat(np.arange(nodes), 3)), times)
    factor, factoring = repeated(lambda: factorised(positive, plan), times)
    theirs, taking = repeated(lambda: superlu(positive), times)
    assert isinstance(factor, Factor)
    assert isinstance(theirs, SuperLU)
    block = np.random.default_rng(0).standard_normal((3 * nodes, RIGHT_SIDES))
    solved, solving = repeated(lambda: factor.solve(block), times)
    other, answering = repeated(lambda: theirs.solve(block), times)
    stored = theirs.L.nnz + theirs.U.nnz
    count, counting = repeated(lambda: inertia(negative, plan), times)
    peer, telling = repeated(lambda: superlu(negative).U.diagonal(), times)
    apart = np.abs(solved - other).max() / np.abs(solved).max()
    return [
        ("order and plan, once", said(planning), "in the factor"),
        ("factor", said(factoring), said(taking)),
        ("numbers stored, millions", f"{plan.stored / 1e6:.1f}", f"{stored / 1e6:.1f}"),
        (f"solve for {RIGHT_SIDES}, {apart:.0e} apart", said(solving), said(answering)),
        ("count below 20 kHz", said(counting), said(telling)),
        ("counted", str(count.negative), str(int((peer < 0.0).sum()))),
    ]


def main() -> None:
    """Measure and print."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--unknowns", type=int, default=30_000)
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    mesh = mug(asked.unknowns)
    uniform = Elasticity.uniform(MATERIALS["ceramic"], len(mesh.cells))
    system = modal_system(mesh, uniform.lame, uniform.density)
    with threadpool_limits(limits=1):
        stages = rows(system, asked.repeats)
    heads = f"stage, mug, {3 * len(mesh.nodes)} unknowns; ours [CPU s] .3f; SuperLU [CPU s] .3f"
    finish_figure("modes", "time of factorisation", heads, stages)


if __name__ == "__main__":
    main()
