"""A minute of the acquisition box: ``python -m pytest tests/benchmarks/bench_daq.py -m benchmark -s``.

Two channels at 50 kHz through the mock and the driver, every sample compared with what the box
sent; the clock found against the crystal's true drift; the skew of the channels before and after
correction; what it costs in processor time.
"""

import sys
import time

import numpy as np
import pytest

from harness.bench.acquisition import strike_from_readings
from harness.bench.acquisition_channels import BLOCK, CLOCK, FORCE, PRESSURE
from mocks.daq.strike_counts import Wiring, skewed
from tests.benchmarks.results import finish_figure
from tests.docs.results import Cell
from tests.support.daq_bench import (
    CALIBRATION,
    OFFSETS,
    measured_delay,
    mocked_box,
    numbered,
    numbered_begin,
    numbered_source,
    opened,
    played,
)

pytestmark = [
    pytest.mark.benchmark,
    pytest.mark.timeout(180),
    pytest.mark.skipif(sys.platform != "linux", reason="pseudo-terminals as the mock uses them need Linux"),
]

RATE = 50e3
SECONDS = 60.0
DRIFT_PPM = 40.0


def _say(text: str) -> None:
    print(f"  {text}")  # noqa: T201


def test_a_minute_of_two_channels_loses_no_sample() -> None:
    with (
        mocked_box(numbered_source, drift_ppm=DRIFT_PPM) as bench,
        opened(bench, memory=SECONDS + 5.0) as hammer,
    ):
        busy, began = time.process_time(), time.monotonic()
        readings = hammer.capture(lambda: None, 1.0, SECONDS - 1.0, SECONDS)
        busy, took = time.process_time() - busy, time.monotonic() - began
        health = hammer.health()
        lost = bench.box.lost
    by_name = {reading.channel.name: reading for reading in readings}
    counts = np.stack([by_name[name].values.ravel() for name in (FORCE, PRESSURE)], axis=1)
    begin = numbered_begin(counts, 10 * RATE)
    wrong = np.count_nonzero((counts != numbered(np.arange(begin, begin + len(counts)))).any(axis=1))
    late = by_name[CLOCK].values[:, 1] * 1e6
    rate = BLOCK * (len(by_name[FORCE].times) - 1) / np.ptp(by_name[FORCE].times)
    middle, high = np.percentile(late, [50, 90])
    rows: list[tuple[Cell, Cell]] = [
        (f"scans compared in {SECONDS:g} s", f"{len(counts):,}; {wrong} wrong, {lost} bytes lost"),
        (
            f"estimated drift of a crystal {DRIFT_PPM:+.1f} ppm fast [ppm]",
            float((rate / RATE - 1) * 1e6),
        ),
        ("earliest arrivals after the fit, median; 90th percentile", f"{middle:.0f}; {high:.0f} us"),
        ("CPU use of the driver [% of a core]", 100 * busy / took),
    ]
    finish_figure("bench", "acquisition", "quantity; value .3g", rows)
    assert wrong == 0
    assert lost == 0
    assert health.drops == 0
    assert len(counts) == SECONDS * RATE


@pytest.mark.parametrize("centre", [1000.0, 6000.0, 15000.0, 19000.0])
def test_the_skew_of_the_channels(centre: float) -> None:
    t = (np.arange(20_000) - 2000) / RATE
    click = np.exp(-0.5 * (t / 2e-4) ** 2) * np.cos(2 * np.pi * centre * t)
    counts = Wiring(8000.0, 8000.0, OFFSETS, (1.0, 5.0)).counts(
        click, skewed(click, 0.5), np.random.default_rng(0)
    )
    with mocked_box(played([counts])) as bench, opened(bench) as hammer:
        readings = {r.channel.name: r for r in hammer.capture(bench.fire, 0.02, 0.1, 2.0)}
    raw = [
        readings[name].values.ravel() - float(offset)
        for name, offset in zip((FORCE, PRESSURE), OFFSETS, strict=True)
    ]
    began = time.process_time()
    strike = strike_from_readings(readings, CALIBRATION)
    cost = time.process_time() - began
    corrected = measured_delay(strike.force, strike.pressure, strike.rate)
    _say(
        f"{centre / 1e3:4.0f} kHz: raw {measured_delay(raw[0], raw[1], RATE) * 1e6:+.3f} us, corrected "
        f"{corrected * 1e6:+.4f} us; reading {len(strike.force)} samples took {cost * 1e3:.0f} ms"
    )
    assert abs(corrected) < 1e-6
