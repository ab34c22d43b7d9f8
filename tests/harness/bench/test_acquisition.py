"""Counts of a strike as newtons and pascals: laws, and the strikes that must not be believed."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import CalibrationRefused, DataRefused, RecordingDamaged, WrongUse
from harness.bench.acquisition import (
    AcquisitionCalibration,
    Strike,
    shipped_acquisition,
    strike_from_readings,
)
from harness.bench.acquisition_channels import (
    BLOCK,
    FLAGS,
    FORCE,
    PRESSURE,
    CaptureForm,
    judge,
    readings_of_capture,
)
from harness.bench.device import Reading

CALIBRATION = shipped_acquisition("acquisition_bench")
RATE = 50e3
FORM = CaptureForm(RATE, 100.0, CALIBRATION.full_scale_counts)
SCANS = 12 * BLOCK
ONSET = 1500
SKEW = 0.5 / RATE


def half_sine(peak: float, at: int, length: int = 40) -> FloatArray:
    pulse = np.zeros(SCANS)
    pulse[at : at + length] = peak * np.sin(np.pi * np.arange(length) / length)
    return pulse


def counts_of(force: FloatArray, pressure: FloatArray, seed: int = 0) -> AnyArray:
    """``(SCANS, 2)`` whole counts, from counts above rest."""
    noise = np.random.default_rng(seed).normal(size=(SCANS, 2)) * (1.0, 5.0)
    rest = (CALIBRATION.hammer_offset, CALIBRATION.microphone_offset)
    scale = CALIBRATION.full_scale_counts
    return np.clip(np.rint(np.stack([force, pressure], axis=1) + noise + rest), -scale - 1, scale)


def recorded(
    counts: AnyArray, start: float = 100.0, rate: float = RATE, skew: float = SKEW
) -> dict[str, Reading]:
    pairs = np.array([[0.0, start], [1000.0, start + 1000 / rate]])
    readings = readings_of_capture(counts, (start, start + skew), rate, FORM, pairs, np.zeros(2))
    return {reading.channel.name: reading for reading in readings}


def strike_of(force: FloatArray, pressure: FloatArray | None = None, seed: int = 0) -> Strike:
    return strike_from_readings(
        recorded(counts_of(force, np.zeros(SCANS) if pressure is None else pressure, seed)), CALIBRATION
    )


@settings(deadline=None)
@given(st.floats(200.0, 15000.0), st.integers(600, 4000), st.integers(0, 2**31))
def test_a_strike_is_read_in_newtons(peak: float, at: int, seed: int) -> None:
    strike = strike_of(half_sine(peak, at), seed=seed)
    noise_and_rounding = 6.0
    assert strike.force.max() == pytest.approx(
        peak * CALIBRATION.newtons_per_count, abs=noise_and_rounding * CALIBRATION.newtons_per_count
    )
    assert (strike.silent, strike.overload, strike.double_hit) == (False, False, False)
    reached = np.flatnonzero(strike.force >= (100.0 + noise_and_rounding) * CALIBRATION.newtons_per_count)
    assert 0 <= reached[0] - strike.onset <= 5
    assert abs(strike.times[strike.onset] - (100.0 + (at + 1) / RATE)) < 40 / RATE


@settings(deadline=None)
@given(st.floats(500.0, 15000.0), st.floats(0.12, 1.0), st.integers(60, 2000), st.integers(0, 2**31))
def test_a_second_hit_is_noticed_wherever_it_comes(peak: float, share: float, gap: int, seed: int) -> None:
    force = half_sine(peak, ONSET) + half_sine(share * peak, ONSET + gap)
    assert strike_of(force, seed=seed).double_hit


@settings(deadline=None)
@given(st.floats(300.0, 15000.0), st.floats(0.0, 0.03), st.integers(60, 2000), st.integers(0, 2**31))
def test_ringing_of_the_cell_is_no_second_hit(peak: float, share: float, gap: int, seed: int) -> None:
    force = half_sine(peak, ONSET) + half_sine(share * peak, ONSET + gap)
    assert not strike_of(force, seed=seed).double_hit


@settings(deadline=None)
@given(st.sampled_from(["force", "pressure"]), st.integers(1, 20))
def test_full_scale_on_either_channel_is_an_overload(channel: str, width: int) -> None:
    force, pressure = half_sine(5000.0, ONSET), np.zeros(SCANS)
    (force if channel == "force" else pressure)[ONSET : ONSET + width] = 1e6
    assert strike_of(force, pressure).overload


@pytest.mark.parametrize("channel", ["force", "pressure"])
@pytest.mark.parametrize("hiss", [0.0, 10.0])
def test_flat_tops_below_full_scale_are_an_overload(channel: str, hiss: float) -> None:
    """An amplifier that saturates at 4000 counts of 32767, in front of a converter with noise of its own."""
    times = np.arange(SCANS) / RATE
    tone = 15000.0 * np.exp(-30.0 * times) * np.sin(2.0 * np.pi * 700.0 * times)
    force, pressure = half_sine(5000.0, ONSET), np.asarray(np.where(np.arange(SCANS) < ONSET, 0.0, tone))
    assert not strike_of(force, pressure).overload
    noise = hiss * np.random.default_rng(1).normal(size=SCANS)
    if channel == "force":
        force = np.minimum(half_sine(20000.0, ONSET), 4000.0) + noise
    else:
        pressure = np.clip(pressure, -4000.0, 4000.0) + noise
    assert strike_of(force, pressure).overload


@pytest.mark.parametrize("drift", [-40.0, -10.0, 10.0, 40.0])
def test_a_drift_of_the_force_is_taken_off(drift: float) -> None:
    """N/s: the impulse is that of the blow to one per cent, and begins where it did."""
    blow = half_sine(5000.0, 4000)
    counts = drift / CALIBRATION.newtons_per_count * (np.arange(SCANS) - 4000) / RATE
    still, drifting = strike_of(blow), strike_of(blow + counts)
    assert not drifting.double_hit
    assert drifting.onset == pytest.approx(still.onset, abs=5)
    impulse = [
        float(np.sum(strike.force[strike.onset - 50 : strike.onset + 200])) / RATE
        for strike in (still, drifting)
    ]
    truth = float(np.sum(blow)) * CALIBRATION.newtons_per_count / RATE
    assert impulse == pytest.approx([truth] * 2, abs=0.01 * truth)


def test_beyond_the_calibrated_range_is_an_overload() -> None:
    weak = replace(CALIBRATION, hammer_limit=50.0)
    peak = 60.0 / weak.newtons_per_count
    readings = recorded(counts_of(half_sine(peak, ONSET), np.zeros(SCANS)))
    assert strike_from_readings(readings, weak).overload
    assert not strike_from_readings(readings, CALIBRATION).overload


@settings(deadline=None)
@given(st.floats(0.0, 80.0), st.integers(0, 2**31))
def test_what_stays_below_the_threshold_is_silent(peak: float, seed: int) -> None:
    strike = strike_of(half_sine(peak, ONSET), seed=seed)
    assert strike.silent
    assert not strike.double_hit
    assert strike.onset == 0


@settings(deadline=None)
@given(
    st.lists(st.integers(-32768, 32767), min_size=2, max_size=200),
    st.integers(0, 2**31),
    st.integers(1, 5000),
)
def test_whatever_was_read_no_nan_is_handed_on(spikes: list[int], seed: int, threshold: int) -> None:
    rng = np.random.default_rng(seed)
    counts = counts_of(np.zeros(SCANS), np.zeros(SCANS), seed)
    counts[rng.integers(2000, SCANS, len(spikes)), rng.integers(0, 2, len(spikes))] = spikes
    flags = judge(counts[:, 0], counts[:, 1], threshold, 32767, 32767)
    assert flags.silent or 0 <= flags.onset < SCANS
    strike = strike_from_readings(recorded(counts), CALIBRATION)
    for array in (strike.force, strike.pressure, strike.times, [strike.rate, strike.start]):
        assert np.all(np.isfinite(array))
    assert len(strike.force) == len(strike.pressure)


def test_the_skew_of_the_converter_is_taken_out() -> None:
    """A band-limited burst on both inputs, the second read half a sample later: equal afterwards."""
    t = np.arange(SCANS) / RATE

    def burst(at: FloatArray) -> FloatArray:
        envelope = np.exp(-0.5 * ((at - 0.05) / 2e-3) ** 2)
        return 8000.0 * envelope * np.sin(2 * np.pi * 9000.0 * at)

    strike = strike_of(burst(t), burst(t + SKEW))
    force = strike.force / CALIBRATION.newtons_per_count
    pressure = strike.pressure / CALIBRATION.pascals_per_count
    delay = delay_between(force, pressure, strike.rate)
    assert abs(delay) < 0.02e-6
    assert np.abs(force - pressure).max() < 35.0  # noise of 5 counts, seven times


def delay_between(first: FloatArray, second: FloatArray, rate: float) -> float:
    """Seconds by which ``second`` is later, from the phase of their cross spectrum."""
    cross = np.fft.rfft(second) * np.conj(np.fft.rfft(first))
    omega = 2 * np.pi * np.fft.rfftfreq(len(first), 1 / rate)
    weight = np.abs(cross) * (np.abs(cross) > 1e-3 * np.abs(cross).max())
    return -float(np.sum(weight * omega * np.angle(cross)) / np.sum(weight * omega**2))


def test_two_clocks_are_brought_together() -> None:
    """A microphone on a clock of its own, 48 kHz and later begun, is heard at the times of the force."""
    rate = 48e3
    t_force = np.arange(SCANS) / RATE
    t_sound = 7.3e-3 + np.arange(10 * BLOCK) / rate

    def tone(at: FloatArray) -> FloatArray:
        return 5000.0 * np.sin(2 * np.pi * 3000.0 * at) + CALIBRATION.microphone_offset

    readings = recorded(counts_of(half_sine(5000.0, ONSET), np.zeros(SCANS)), start=0.0)
    sound = Reading(
        replace(readings[PRESSURE].channel, nominal_rate=rate),
        t_sound[::BLOCK],
        np.rint(tone(t_sound)).reshape(-1, BLOCK),
    )
    strike = strike_from_readings({**readings, PRESSURE: sound}, CALIBRATION)
    assert strike.start >= 7.3e-3
    inner = (strike.times > 9e-3) & (strike.times < 0.1)
    truth = (tone(strike.times[inner]) - CALIBRATION.microphone_offset) * CALIBRATION.pascals_per_count
    error = strike.pressure[inner] - truth
    assert np.abs(error - error.mean()).max() < 2.0 * CALIBRATION.pascals_per_count
    assert strike.times[strike.onset] == pytest.approx(t_force[ONSET], abs=4 / RATE)


def test_swapped_channels_are_refused() -> None:
    counts = counts_of(half_sine(5000.0, ONSET), np.zeros(SCANS))[:, ::-1]
    with pytest.raises(DataRefused, match=r"\d+ counts.*\d+, within \d+"):
        strike_from_readings(recorded(counts), CALIBRATION)


def test_counts_of_another_converter_are_refused() -> None:
    coarse = replace(CALIBRATION, full_scale_counts=2047)
    with pytest.raises(DataRefused, match=r"counts from -?\d+ to \d+"):
        strike_from_readings(recorded(counts_of(half_sine(5000.0, ONSET), np.zeros(SCANS))), coarse)


@pytest.mark.parametrize("missing", [FORCE, PRESSURE, FLAGS])
def test_a_missing_channel_is_named(missing: str) -> None:
    readings = recorded(counts_of(half_sine(5000.0, ONSET), np.zeros(SCANS)))
    del readings[missing]
    with pytest.raises(DataRefused, match=missing):
        strike_from_readings(readings, CALIBRATION)


def test_blocks_that_no_steady_clock_times_are_refused() -> None:
    readings = recorded(counts_of(half_sine(5000.0, ONSET), np.zeros(SCANS)))
    times = readings[FORCE].times + np.where(np.arange(SCANS // BLOCK) > 6, 5e-3, 0.0)
    readings[FORCE] = Reading(readings[FORCE].channel, times, readings[FORCE].values)
    with pytest.raises(RecordingDamaged, match=r"\d us.*\d us"):
        strike_from_readings(readings, CALIBRATION)


def test_an_artefact_reads_back_and_keeps_its_hash(tmp_path: Path) -> None:
    CALIBRATION.save(tmp_path / "a.json")
    assert AcquisitionCalibration.load(tmp_path / "a.json") == CALIBRATION


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"hammer_newtons_per_volt": 50.0}, "hash"),
        ({"hash": "0" * 16}, "hash"),
        ({"schema": 2}, "schema"),
        ({"hammer_limit": None}, "finite"),
        ({"hammer_limit": -1.0}, "zero"),
        ({"volts_per_count": 0}, "zero"),
        ({"microphone_pascals_per_volt": "2"}, "finite"),
        ({"full_scale_counts": 4000}, "full_scale_counts"),
        ({"hammer_offset": float("nan")}, "finite"),
        ({"offset_tolerance": float("inf")}, "finite"),
        ({"residual": True}, "finite"),
        ({"serial": ""}, "serial"),
        ({"gain": 1.0}, "gain"),
    ],
)
def test_a_changed_artefact_is_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    tree = {"schema": 1, **asdict(CALIBRATION), "hash": CALIBRATION.hash, **change}
    (tmp_path / "a.json").write_text(json.dumps(tree))
    with pytest.raises(CalibrationRefused, match=said):
        AcquisitionCalibration.load(tmp_path / "a.json")


def test_an_artefact_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(CalibrationRefused):
        AcquisitionCalibration.load(tmp_path / "a.json")
    with pytest.raises(WrongUse, match="no_such_bench"):
        shipped_acquisition("no_such_bench")
