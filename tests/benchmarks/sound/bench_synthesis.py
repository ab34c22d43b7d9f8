"""Milliseconds from modes to a sound, beside the plain ways to sum them.

``PYTHONPATH=. python tests/benchmarks/sound/bench_synthesis.py [--repeats N] [modes ...]`` prints medians and
spread on the clock and of process time, on one core, and the error of each against the sum in double
precision.
"""

from collections.abc import Callable

import numpy as np
from threadpoolctl import threadpool_limits

from harness.basics.arrays import FloatArray
from harness.basics.materials import material
from harness.sim.sound.contact_pulse import Hammer, hertz_pulse, struck
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.synthesis import synthesize
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.oracles.summed_modes import COUNTS, DURATION, RATE, RATES, Case, case, error, outer, said, timed

SLOW_REPEATS = 2
"""Of the plain ways, which take seconds."""

NYLON = Hammer(radius=8e-3, young=2.5e9, poisson=0.4, mass=0.05)


def pushed(one: Case) -> FloatArray:
    """As the force history of a soft hammer."""
    force = np.zeros((1, round(DURATION * RATE)))
    pulse = hertz_pulse(NYLON, 1.0, material("ceramic")).sampled(RATE)
    force[0, : len(pulse)] = pulse
    return ring(one.frequencies, one.decays, one.amplitudes, force, RATE)


def rows(one: Case, repeats: int) -> list[list[str]]:
    """The numbers of one case, ours first."""
    f, d, g = one.frequencies, one.decays, one.amplitudes
    exact = outer(one, np.float64)
    pulse = hertz_pulse(NYLON, 1.0, material("ceramic"))
    fast, double = (synthesize(f, d, g, DURATION, RATE, level) for level in ("fast", "double"))
    plain = outer(one, np.float32)
    ways: list[tuple[str, Callable[[], object], int, str, str]] = [
        ("fast", lambda: synthesize(f, d, g, DURATION, RATE), repeats, error(fast.sound[0], exact),
         f"{fast.error:.0f}"),
        ("double", lambda: synthesize(f, d, g, DURATION, RATE, "double"), repeats,
         error(double.sound[0], exact), f"{double.error:.0f}"),
        ("fast, with Hertz's pulse", lambda: struck(f, d, g, pulse, DURATION, RATE), repeats, "", ""),
        ("ring, with sampled pulse", lambda: pushed(one), max(SLOW_REPEATS, repeats // 5), "", ""),
        ("numpy, outer, float32", lambda: outer(one, np.float32), SLOW_REPEATS, error(plain, exact), ""),
        ("numpy, outer, float64", lambda: outer(one, np.float64), SLOW_REPEATS, "reference", ""),
    ]  # fmt: skip
    return [
        [f"{len(f)} {one.name}", name, *map(said, timed(work, times)), found, stated]
        for name, work, times, found, stated in ways
    ]


def main() -> None:
    """Measure what the command line asks for."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("modes", type=int, nargs="*", default=COUNTS)
    parser.add_argument("--repeats", type=int, default=30)
    asked = parser.parse_args()
    with threadpool_limits(limits=1):
        every = [
            row
            for modes in asked.modes
            for of in ("ceramic", "steel", *RATES)
            for row in rows(case(modes, of), asked.repeats)[: None if of == "ceramic" else 2]
        ]
    heads = f"modes, {DURATION:g} s at {RATE / 1e3:g} kHz; method; wall time [ms]; CPU time [ms]"
    finish_figure("audionet", "sum of modes", f"{heads}; error [dB]; stated error [dB]", every)


if __name__ == "__main__":
    main()
