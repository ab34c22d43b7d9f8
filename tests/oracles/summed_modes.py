"""Modes to add up, the plain way to do so in numpy, and how benchmarks time and judge another."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.materials import material
from harness.sim.modal.modes import dampings

RATE = 44.1e3
DURATION = 3.0
COUNTS = (128, 512, 2048)
RATES = {"nothing decays": 0.5, "all decay alike": 11.0}
"""1/s; the second a little above what three seconds sum by their spectrum."""

SLICE = 128
"""Modes of the plain ways at a time: 135 MB of sines."""


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
