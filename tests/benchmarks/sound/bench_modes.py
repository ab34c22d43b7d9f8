"""Seconds of each stage from a surface to a sound, over the built-in objects.

``python tests/benchmarks/sound/bench_modes.py [object ...]`` prints medians and spread of process time
on one core, the size of the system and the lowest frequencies.
"""

import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from harness.basics.materials import Material, material
from harness.basics.mesh import Mesh
from harness.objects.household import MATERIALS, build
from harness.sim.modal.modal import HEARING, default_edge, solve_modes
from harness.sim.modal.modes import Modes, dampings
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedralize
from harness.sim.sound.modal_radiation import radiation
from harness.sim.sound.modal_sound import ring
from tests.samples.blows import half_sine

RATE = 44.1e3
MOST = 128
REPEATS = 3
HEADINGS = (
    "object",
    "of",
    "edge mm",
    "unknowns",
    "mesh s",
    "assemble, solve s",
    "3 s of sound ms",
    "modes",
    "Hz",
)


def timed(work: Callable[[], object], repeats: int = REPEATS) -> tuple[object, list[float]]:
    """The last result, and process seconds of each repetition."""
    took = []
    for _ in range(repeats):
        begun = time.process_time()
        result = work()
        took.append(time.process_time() - begun)
    return result, took


def said(took: Sequence[float], unit: float = 1.0) -> str:
    """Median and extremes."""
    return f"{np.median(took) / unit:.2f} ({min(took) / unit:.2f} to {max(took) / unit:.2f})"


def sounded(modes: Modes, of: Material) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Three seconds of one blow."""
    force = np.zeros((1, int(3.0 * RATE)))
    pulse = half_sine(RATE, 2e-4, 50.0)
    force[0, : len(pulse)] = pulse
    gains = modes.gains(modes.points[:1], -modes.normals[:1]) * radiation(modes, 0.5)
    return ring(modes.frequencies, dampings(modes.frequencies, of), gains, force, RATE)


def row(name: str, mesh: Mesh, of: Material) -> list[str]:
    """One object's numbers."""
    edge = default_edge(mesh, of, HEARING, MOST)
    filled, meshing = timed(lambda: tetrahedralize(mesh, edge), 1)
    assert isinstance(filled, Tetrahedra)
    modes, solving = timed(lambda: solve_modes(filled, of, HEARING, mesh, MOST))
    assert isinstance(modes, Modes)
    _, ringing = timed(lambda: sounded(modes, of))
    lowest = ", ".join(f"{frequency:.0f}" for frequency in modes.frequencies[:4])
    size = f"{3 * modes.nodes}"
    found = f"{len(modes.frequencies)} to {modes.limit / 1e3:.1f} kHz"
    return [name, of.name, f"{edge * 1e3:.1f}", size, said(meshing), said(solving), said(ringing, 1e-3),
            found, lowest]  # fmt: skip


def main() -> None:
    """Measure what the command line names, or all."""
    table = Table(title="process seconds on one core: median (least to greatest)")
    for heading in HEADINGS:
        table.add_column(heading)
    with threadpool_limits(limits=1):
        for name in sys.argv[1:] or list(MATERIALS):
            table.add_row(*row(name, build(name), material(MATERIALS[name])))
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
