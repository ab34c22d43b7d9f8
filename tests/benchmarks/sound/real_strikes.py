"""What is identified in measured beams and blows, in three tables and a picture.

``PYTHONPATH=. python tests/benchmarks/sound/real_strikes.py`` prints the modes of the two measured beams
beside those of a free beam, of the struck structure from its free decay and from its transfer function,
the three blows beside a spline and a trapezoid, and process seconds. ``--out FILE.png`` draws the
responses with what was found in them.

The data is found as in the tests: fetched by `make data`, or named by TOUCHSTONE_DATA.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from matplotlib.axes import Axes
from rich.console import Console
from scipy.interpolate import CubicSpline

from harness.basics.arrays import FloatArray
from harness.report.figures.style import ANSWER, SOFT, TOOL, blank, styled
from harness.strikes.frequency_response import frequency_response, measure_blow
from harness.strikes.modal_identification import Identified, IdentifiedMode, modes_of_decay, modes_of_response
from harness.strikes.pole_fit import ComplexArray, PoleSearch
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.oracles.measured_beams import (
    HAMMER_RATE,
    RULER_STEP,
    alike,
    beam_ratios,
    beam_roots,
    free_shape,
    hammer_blows,
    ruler,
    suspended_beam,
)
from tests.support.real_data import WHY_NOT, find_shared_data

_Result = TypeVar("_Result")

BEAM = PoleSearch(low=20.0)
RULER = PoleSearch(low=20.0, high=800.0, misfit=0.2)
STRUCK = PoleSearch(low=100.0, high=2800.0)
BEGUN = 40
STRONG = -40.0
PLACES = np.linspace(0.0, 1.0, 10)


def timed(work: Callable[[], _Result]) -> tuple[_Result, float]:
    """Return the result and its CPU seconds."""
    begun = time.process_time()
    result = work()
    return result, time.process_time() - begun


def told(mode: IdentifiedMode) -> list[Cell]:
    """Frequency, damping and level."""
    return [
        f"{mode.frequency:.3f} ± {mode.frequency_sigma:.3f}",
        f"{100 * mode.ratio:.4f} ± {100 * mode.ratio_sigma:.4f}",
        f"{mode.level:.0f}",
    ]


def against_theory(mode: IdentifiedMode, first: IdentifiedMode, number: int, step: float) -> list[Cell]:
    """Ratio to the first, a free beam's, how far off, and how far the lines tell."""
    ratio, theory = mode.frequency / first.frequency, float(beam_ratios("free-free", number + 1)[number])
    known = 0.5 * step * (1.0 / mode.frequency + 1.0 / first.frequency)
    return [f"{ratio:.4f}", f"{theory:.4f}", f"{100 * (ratio / theory - 1):+.2f}", f"{100 * known:.2f}"]


def beam_rows(found: Identified) -> Iterator[list[Cell]]:
    """Compare the suspended beam with a free beam."""
    strong = [mode for mode in found.modes if mode.level > STRONG]
    for mode in found.modes:
        number = strong.index(mode) if mode in strong else -1
        row = against_theory(mode, strong[0], number, 1.0) if number >= 0 else [None] * 4
        yield [*told(mode), *row]


def ruler_rows(found: Identified) -> Iterator[list[Cell]]:
    """Compare the ruler with the free beam's shape that each mode is most like."""
    roots = beam_roots("free-free", 7)
    for mode in found.modes:
        shape = mode.lines[:, int(np.argmin(np.abs(found.frequencies - mode.frequency)))]
        likeness = [alike(shape, free_shape(root, PLACES)) for root in roots]
        number = int(np.argmax(likeness))
        like = likeness[number] > 0.8
        row = against_theory(mode, found.modes[0], number, RULER_STEP) if like else [None] * 4
        yield [*told(mode), f"{number + 1}", f"{likeness[number]:.2f}", *row]


def struck_rows(decay: Identified, response: Identified) -> Iterator[list[Cell]]:
    """Compare modes from the free decay with those from the transfer function."""
    for mode in decay.modes:
        near = min(response.modes, key=lambda other: abs(other.frequency - mode.frequency))
        close = abs(near.frequency - mode.frequency) < 1.0
        yield [*told(mode), *(told(near) if close else ["not found", None, None])]


def blow_rows(forces: FloatArray) -> Iterator[list[Cell]]:
    """Measure each blow, and below it by a spline and a trapezoid."""
    for number, force in enumerate(forces, start=1):
        blow = measure_blow(force, HAMMER_RATE)
        yield [
            f"{number}",
            f"{blow.peak:.2f} ± {blow.peak_sigma:.2f}",
            f"{1e3 * blow.impulse:.3f} ± {1e3 * blow.impulse_sigma:.3f}",
            f"{1e6 * blow.duration:.2f} ± {1e6 * blow.duration_sigma:.2f}",
            f"{1e6 * blow.width:.2f}",
            f"{blow.touches}",
        ]
        samples = force[:60] - np.median(force[2000:])
        spline = CubicSpline(np.arange(60.0) / HAMMER_RATE, samples)
        peak = float(spline(spline.derivative().roots(extrapolate=False)).max())
        tenth, half = (np.ptp(spline.solve(share * peak, extrapolate=False)) for share in (0.1, 0.5))
        impulse = np.trapezoid(samples, dx=1.0 / HAMMER_RATE)
        off = 5.0 / 384.0 * np.abs(np.diff(samples, 4)).max()
        yield [
            f"{number}, spline and trapezoid",
            f"{peak:.2f} ± {off:.2f}",
            f"{1e3 * impulse:.3f}",
            f"{1e6 * tenth:.2f}",
            f"{1e6 * half:.2f}",
            None,
        ]


def drawn(axes: Axes, title: str, frequencies: FloatArray, values: ComplexArray, found: Identified) -> None:
    """Responses in grey, the fit upon them, a mark at each mode, and the frequency where there is room."""
    inside = np.isin(frequencies, found.frequencies)
    for row, left in zip(values, found.residual, strict=True):
        axes.semilogy(frequencies, np.abs(row), color=SOFT, lw=1.6, alpha=0.45)
        axes.semilogy(found.frequencies, np.abs(row[inside] - left), color=ANSWER, lw=0.6)
    top = float(np.abs(values).max())
    axes.set_ylim(top * 1e-5, top * 12.0)
    named: list[float] = []
    for mode in sorted(found.modes, key=lambda mode: -mode.level):
        strong = mode.level > STRONG
        axes.plot([mode.frequency], [2.0 * top], "v", color=TOOL if strong else SOFT, ms=6 if strong else 3)
        if strong and all(abs(mode.frequency - other) > 0.02 * np.ptp(frequencies) for other in named):
            axes.text(
                mode.frequency, 3.0 * top, f"{mode.frequency:.1f}", fontsize=7, rotation=60, va="bottom"
            )
            named.append(mode.frequency)
    axes.set_title(title, fontsize=10, loc="left", pad=14)


def picture(data: Path, found: dict[str, Identified], out: Path) -> None:
    """The three responses, one below the other."""
    forces, responses = hammer_blows(data)
    measured = frequency_response(forces, responses, HAMMER_RATE)
    with styled():
        figure = blank(10.4, 11.0)
        figure.set_layout_engine("constrained")
        first, second, third = figure.subplots(3, 1)
        drawn(first, "suspended beam, three places: m/s² / N", *suspended_beam(data), found["beam"])
        lines, values = ruler(data)
        kept = lines < 1.02 * found["ruler"].frequencies[-1]
        drawn(second, "steel ruler, ten places: as published", lines[kept], values[:, kept], found["ruler"])
        kept = (measured.frequencies > 600.0) & (measured.frequencies < 2900.0)
        lines = measured.frequencies[kept]
        fitted = found["response"]
        zoom = fitted.frequencies > 600.0
        fitted = replace(fitted, frequencies=fitted.frequencies[zoom], residual=fitted.residual[:, zoom])
        drawn(
            third, "a struck structure, H1 of three blows: m/s² / N", lines, measured.h1[kept][None], fitted
        )
        third.set_xlabel("Hz; grey: measured, blue: fitted, triangles: modes (small: below -40 dB)")
        figure.savefig(out)


def main() -> None:
    """Measure, print, and draw where asked."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--out", type=Path, help="a picture, PNG")
    wanted = parser.parse_args()
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    forces, responses = hammer_blows(data)
    measured = frequency_response(forces, responses, HAMMER_RATE)
    beam, beam_s = timed(lambda: modes_of_response(*suspended_beam(data), BEAM))
    bar, bar_s = timed(lambda: modes_of_response(*ruler(data), RULER))
    decay, struck_s = timed(lambda: modes_of_decay(responses[:, BEGUN:], HAMMER_RATE, STRUCK))
    response = modes_of_response(measured.frequencies, measured.h1, STRUCK)
    console = Console(width=130)
    mode = "frequency [Hz]; damping [%]; level [dB]"
    theory = "ratio to the first; ratio of a free beam; difference [%] +.2f; line resolution [%]"
    finish_figure("strikes", "beam", f"{mode}; {theory}", beam_rows(beam))
    like = "beam mode; modal assurance criterion"
    finish_figure("strikes", "ruler", f"{mode}; {like}; {theory}", ruler_rows(bar))
    for note in (*beam.notes, *bar.notes, *decay.notes):
        console.print(note)
    finish_figure("strikes", "struck structure", f"{mode}; response: {mode}", struck_rows(decay, response))
    blow = "blow; peak [N]; impulse [mN s]; above 10 % [us]; above 50 % [us]; contacts"
    finish_figure("strikes", "three blows", blow, blow_rows(forces))
    seconds = (("beam", beam_s), ("ruler", bar_s), ("struck structure, free decay", struck_s))
    finish_figure("strikes", "time of an analysis", "recording; time [CPU s] .2f", seconds)
    assert measured.coherence is not None
    low, high = measured.band
    console.print(
        f"force excites {low:g} to {high:.0f} Hz; coherence, median of 100 to 2800 Hz: "
        f"{np.median(measured.coherence[100:2800]):.5f}"
    )
    if wanted.out is not None:
        picture(data, {"beam": beam, "ruler": bar, "response": response}, wanted.out)


if __name__ == "__main__":
    main()
