"""The driver at the bench's own cable end: every sample, at its true time, in the units of the lab."""

import sys
from collections.abc import Iterator

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import BenchFault, WrongUse
from harness.bench.acquisition import strike_from_readings
from harness.bench.acquisition_channels import BLOCK, CLOCK, FLAG_FIELDS, FLAGS, FORCE, PRESSURE
from harness.bench.device import Reading
from mocks.daq.strike_counts import Wiring, skewed
from tests.support.daq_bench import (
    CALIBRATION,
    OFFSETS,
    Bench,
    idle_counts,
    measured_delay,
    mocked_box,
    numbered,
    numbered_begin,
    numbered_source,
    opened,
    played,
)

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="pseudo-terminals as the mock uses them need Linux"
)

RATE = 50e3
FLIGHT = 2000
DRIFT_PPM = 50.0


def half_sine(scans: int, peak: float, at: int, length: int = 50) -> FloatArray:
    pulse = np.zeros(scans)
    pulse[at : at + length] = peak * np.sin(np.pi * np.arange(length) / length)
    return pulse


def record(peak: float = 3000.0, seed: int = 5, second: float = 0.0, scans: int = 50_000) -> AnyArray:
    """``(scans, 2)`` counts: quiet while the hammer flies, then a strike or two."""
    counts = idle_counts(seed, scans).astype(np.float64)
    counts[:, 0] += half_sine(scans, peak, FLIGHT) + half_sine(scans, second, FLIGHT + 400)
    clipped: AnyArray = np.clip(np.rint(counts), -32768, 32767).astype(np.int16)
    return clipped


def by_name(readings: tuple[Reading, ...]) -> dict[str, Reading]:
    return {reading.channel.name: reading for reading in readings}


def counts_of(readings: dict[str, Reading]) -> AnyArray:
    return np.stack([readings[FORCE].values.ravel(), readings[PRESSURE].values.ravel()], axis=1)


def flag(readings: dict[str, Reading], field: str) -> float:
    return float(readings[FLAGS].values[0][FLAG_FIELDS.index(field)])


RECORDS = [
    record(),
    record(peak=4e4, seed=6),
    record(seed=7, second=900.0),
    record(seed=8, peak=40.0),
]


@pytest.fixture(scope="module")
def bench() -> Iterator[Bench]:
    with mocked_box(played(RECORDS), drift_ppm=DRIFT_PPM) as bench:
        yield bench


@pytest.fixture(scope="module")
def strikes(bench: Bench) -> list[dict[str, Reading]]:
    """The four strikes, as one session reads them: good, saturated, double, silent."""
    with opened(bench) as hammer:
        return [by_name(hammer.capture(bench.fire, 0.02, 0.25, 0.6)) for _ in RECORDS]


def test_every_count_of_a_strike_is_the_boxs(strikes: list[dict[str, Reading]]) -> None:
    for strike, truth in zip(strikes[:3], RECORDS, strict=False):
        counts, lead = counts_of(strike), round(0.02 * RATE)
        reached = int(np.argmax(truth[:, 0] >= OFFSETS[0] + 100))
        # The trigger's rest is the median of 2500 samples, which may be a count off.
        first = next(
            f for f in range(reached - lead - 2, reached - lead + 3) if np.array_equal(truth[f], counts[0])
        )
        assert np.array_equal(counts, truth[first : first + len(counts)])
        assert len(counts) % BLOCK == 0
        assert len(counts) >= 0.27 * RATE


def test_flags_say_what_was_wrong_with_a_strike(strikes: list[dict[str, Reading]]) -> None:
    said = [tuple(flag(s, f) for f in ("silent", "overload", "double_hit")) for s in strikes]
    assert said == [(0, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0)]
    assert flag(strikes[3], "onset") == -1.0
    assert flag(strikes[0], "onset") == pytest.approx(0.02 * RATE, abs=2)


def test_the_estimator_reads_the_same_of_the_raw_counts(strikes: list[dict[str, Reading]]) -> None:
    read = [strike_from_readings(strike, CALIBRATION) for strike in strikes]
    assert [s.silent for s in read] == [False, False, False, True]
    assert [s.overload for s in read] == [False, True, False, False]
    assert [s.double_hit for s in read] == [False, False, True, False]
    assert read[0].force.max() == pytest.approx(3000 * CALIBRATION.newtons_per_count, rel=2e-3)


def test_the_second_channel_is_timed_half_a_sample_later(strikes: list[dict[str, Reading]]) -> None:
    for strike in strikes:
        assert np.allclose(
            strike[PRESSURE].times - strike[FORCE].times, 10e-6, rtol=0.0, atol=1e-8
        )  # a rate known to 0.1 %


@pytest.mark.parametrize("drift", [-600.0, 600.0])
def test_the_clock_is_the_crystals_and_not_nominal(drift: float) -> None:
    """Of a crystal worse than any: a process that shares two cores is told of samples up to 0.4 ms late,
    and over 3.5 s that is 110 ppm. The benchmark fits 60 s, and finds a crystal's 40 ppm."""
    with mocked_box(played(RECORDS), drift_ppm=drift) as bench, opened(bench) as hammer:
        readings = by_name(hammer.capture(lambda: None, 0.5, 3.5, 3.5))
    rate = BLOCK * (len(readings[FORCE].times) - 1) / np.ptp(readings[FORCE].times)
    assert (rate / RATE - 1.0) * 1e6 == pytest.approx(drift, abs=200.0)
    assert np.abs(readings[CLOCK].values[:, 1]).min() < 1e-9
    assert np.median(readings[CLOCK].values[:, 1]) < 1e-3


def test_the_skew_of_the_channels_is_corrected_to_a_microsecond() -> None:
    """The same band-limited click on both inputs, read half a sample apart, is simultaneous again."""
    t = (np.arange(20_000) - FLIGHT) / RATE
    click = np.exp(-0.5 * (t / 1e-4) ** 2) * np.cos(2 * np.pi * 6000.0 * t)
    wiring = Wiring(8000.0, 8000.0, OFFSETS, (1.0, 5.0))
    counts = wiring.counts(click, skewed(click, 0.5), np.random.default_rng(0))
    with mocked_box(played([counts])) as bench, opened(bench) as hammer:
        readings = by_name(hammer.capture(bench.fire, 0.02, 0.1, 2.0))
    raw = counts_of(readings) - np.array(OFFSETS)
    assert measured_delay(raw[:, 0], raw[:, 1], RATE) == pytest.approx(-10e-6, abs=0.1e-6)
    strike = strike_from_readings(readings, CALIBRATION)
    assert abs(measured_delay(strike.force, strike.pressure, strike.rate)) < 0.1e-6


def test_two_channels_at_fifty_kilohertz_lose_no_sample() -> None:
    with mocked_box(numbered_source, drift_ppm=-30.0) as bench, opened(bench) as hammer:
        readings = by_name(hammer.capture(lambda: None, 0.5, 1.5, 1.5))
        assert bench.box.lost == 0
    counts = counts_of(readings)
    begin = numbered_begin(counts, 10 * RATE)
    assert np.array_equal(counts, numbered(np.arange(begin, begin + len(counts))))
    assert len(counts) == 2 * RATE


def test_a_twelve_bit_box_is_read_in_its_own_counts() -> None:
    from dataclasses import replace

    coarse = replace(CALIBRATION, full_scale_counts=2047, microphone_full_scale_counts=2047)
    truth = np.clip(record(peak=1500.0, seed=9), -2048, 2047)
    with mocked_box(played([truth]), model="DI-1110", echoes_start=True) as bench:
        with pytest.raises(BenchFault, match=r"'1110'.*DI-2108"):
            opened(bench).__enter__()
        with opened(bench, calibration=coarse, model="DI-1110") as hammer:
            readings = by_name(hammer.capture(bench.fire, 0.02, 0.2, 2.0))
    strike = strike_from_readings(readings, replace(coarse, volts_per_count=10 / 2048))
    assert strike.force.max() == pytest.approx(
        1500 * 10 / 2048 * CALIBRATION.hammer_newtons_per_volt, rel=5e-3
    )


def test_a_box_left_scanning_is_quieted_and_the_port_is_one_programs(bench: Bench) -> None:
    with opened(bench), pytest.raises(BenchFault, match=f"port {bench.box.port}"):
        opened(bench).__enter__()
    from serial import Serial

    with Serial(bench.box.port) as port:
        port.write(b"slist 0 0\rslist 1 1\rsrate 600\rstart 0\r")
        assert len(port.read(5000)) == 5000
    with opened(bench) as hammer:
        assert flag(by_name(hammer.capture(lambda: None, 0.1, 0.1, 0.3)), "silent") == 1.0


@pytest.mark.parametrize("left", [b"encode 1\r", b"dec 100\r", b"dec 2\rdeca 3\r"])
def test_what_another_program_left_on_the_box_is_undone(bench: Bench, left: bytes) -> None:
    from serial import Serial

    with Serial(bench.box.port, timeout=2.0) as port:
        port.write(left)
        last = left.split(b"\r")[-2]
        assert port.read_until(last).endswith(last)  # before it may be an answer to who was there before
    with opened(bench) as hammer:
        counts = counts_of(by_name(hammer.capture(lambda: None, 0.1, 0.1, 0.2)))
        assert hammer.health().rate == pytest.approx(RATE, rel=2e-3)
    assert np.abs(np.median(counts, axis=0) - OFFSETS).max() <= 2


def test_another_boxs_serial_number_is_refused(bench: Bench) -> None:
    with pytest.raises(BenchFault, match=r"'mock-2108'.*'12345678'"):
        opened(bench, serial="12345678").__enter__()


def test_a_box_is_found_by_its_serial_number(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo

    port = ListPortInfo(bench.box.port)
    port.vid = 0x0683
    monkeypatch.setattr(list_ports, "comports", lambda: [ListPortInfo("/dev/ttyS77"), port])
    with opened(bench, port="", serial="mock-2108") as hammer:
        assert bench.box.port in hammer.health().identity
    with pytest.raises(BenchFault, match=f"'other'.*{bench.box.port}.*mock-2108"):
        opened(bench, port="", serial="other").__enter__()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"port": "", "serial": ""}, "port.*serial"),
        ({"model": "DI-9999"}, "DI-2108"),
        ({"model": "DI-1110"}, "32767"),
        ({"rate": 44.1e3}, "44117.64706 Hz"),
    ],
)
def test_a_station_that_asks_for_what_is_not_is_refused(
    bench: Bench, options: dict[str, object], said: str
) -> None:
    with pytest.raises(WrongUse, match=said):
        opened(bench, **options).__enter__()


def test_a_port_that_is_not_there_is_named() -> None:
    from drivers.dataq.hammer import DataqHammer

    with pytest.raises(BenchFault, match="/dev/ttyACM77"):
        DataqHammer(CALIBRATION, port="/dev/ttyACM77").open()


def test_health_says_rate_drift_and_drops(bench: Bench) -> None:
    with opened(bench) as hammer:
        hammer.capture(lambda: None, 0.1, 0.1, 0.2)
        health = hammer.health()
    assert health.rate == pytest.approx(RATE, rel=1e-3)
    assert health.drops == 0
    assert "ppm" in health.detail
    assert hammer.health().detail == "closed"
