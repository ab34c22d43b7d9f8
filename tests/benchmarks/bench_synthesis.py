"""Milliseconds from modes to a sound, beside the plain ways to sum them.

``python tests/benchmarks/bench_synthesis.py [--repeats N] [modes ...]`` prints medians and spread on the
clock and of process time, on one core, and the error of each against the sum in double precision.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from harness.arrays import AnyArray, FloatArray
from harness.materials import material
from harness.sim.contact_pulse import Hammer, hertz_pulse, struck
from harness.sim.modal_sound import ring
from harness.sim.modes import dampings
from harness.sim.synthesis import synthesize

RATE = 44.1e3
DURATION = 3.0
COUNTS = (128, 512, 2048)
RATES = {"nothing decays": 0.5, "all decay alike": 11.0}
"""1/s; the second a little above what three seconds sum by their spectrum."""

SLOW_REPEATS = 2
"""Of the plain ways, which take seconds."""

SLICE = 128
"""Modes of the plain ways at a time: 135 MB of sines."""

NYLON = Hammer(radius=8e-3, young=2.5e9, poisson=0.4, mass=0.05)


@dataclass(frozen=True, eq=False)
class Case:
    """Modes of one object, evenly spread from 200 Hz to 20 kHz, with random amplitudes."""

    name: str
    frequencies: FloatArray
    decays: FloatArray
    amplitudes: FloatArray


def case(modes: int, of: str) -> Case:
    """Modes of a material; by another name they all die at one rate: for half a minute, or for a second."""
    random = np.random.default_rng(modes)
    frequencies = np.sort(random.uniform(200.0, 20e3, modes))
    decays = np.full(modes, RATES[of]) if of in RATES else dampings(frequencies, material(of))
    return Case(of, frequencies, decays, random.standard_normal((1, modes)))


def outer(one: Case, kind: type) -> AnyArray:
    """Every mode's sine and decay, as a user would write it in numpy."""
    times: AnyArray = (np.arange(round(DURATION * RATE)) / RATE).astype(kind)
    split = np.sqrt((2.0 * np.pi * one.frequencies) ** 2 - one.decays**2)
    sizes: AnyArray = (one.amplitudes[0] * 2.0 * np.pi * one.frequencies / split).astype(kind)
    sound: AnyArray = np.zeros(len(times), kind)
    for first in range(0, len(split), SLICE):
        part = slice(first, first + SLICE)
        decay: AnyArray = one.decays[part].astype(kind)[:, None]
        wave: AnyArray = split[part].astype(kind)[:, None]
        sound += sizes[part] @ (np.exp(-decay * times) * np.sin(wave * times))
    return sound


def pushed(one: Case) -> FloatArray:
    """As the force history of a soft hammer."""
    force = np.zeros((1, round(DURATION * RATE)))
    pulse = hertz_pulse(NYLON, 1.0, material("ceramic")).sampled(RATE)
    force[0, : len(pulse)] = pulse
    return ring(one.frequencies, one.decays, one.amplitudes, force, RATE)


def timed(work: Callable[[], object], repeats: int) -> tuple[list[float], list[float]]:
    """Milliseconds on the clock and of process time, after one call that is not counted."""
    work()
    clock, process = [], []
    for _ in range(repeats):
        begun, spent = time.perf_counter(), time.process_time()
        work()
        clock.append(1e3 * (time.perf_counter() - begun))
        process.append(1e3 * (time.process_time() - spent))
    return clock, process


def said(took: list[float]) -> str:
    """Median and extremes."""
    return f"{np.median(took):.3g} ({min(took):.3g} to {max(took):.3g})"


def error(found: AnyArray, exact: AnyArray) -> str:
    """dB, of the worst sample against the loudest."""
    worst = np.abs(np.asarray(found, dtype=np.float64) - exact).max()
    return "reference" if worst == 0.0 else f"{20.0 * np.log10(worst / np.abs(exact).max()):.0f}"


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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modes", type=int, nargs="*", default=COUNTS)
    parser.add_argument("--repeats", type=int, default=30)
    asked = parser.parse_args()
    table = Table(title=f"{DURATION:g} s at {RATE / 1e3:g} kHz, one core: median (least to greatest)")
    for heading in ("modes", "way", "ms on the clock", "ms of process time", "error dB", "stated dB"):
        table.add_column(heading)
    with threadpool_limits(limits=1):
        for modes in asked.modes:
            for of in ("ceramic", "steel", *RATES):
                for row in rows(case(modes, of), asked.repeats)[: None if of == "ceramic" else 2]:
                    table.add_row(*row)
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
