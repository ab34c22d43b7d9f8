"""What is read from strikes: frequencies, dampings, shares; and what must not matter."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import oaconvolve

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.bench.acquisition import Strike
from harness.sim.modal.modes import Modes
from harness.strikes.peaks import Peak, analyse
from tests.samples import sounding_plate as plate

STRIKES = 5


def _run(seed: int, **changes: object) -> tuple[FloatArray, tuple[Strike, ...]]:
    rng = np.random.default_rng(seed)
    points = plate.places(STRIKES, rng)
    return points, plate.strikes(plate.plate_modes(), points, rng, **changes)  # type: ignore[arg-type]


def _alike(a: AnyArray, b: AnyArray) -> float:
    """1 for two directions that differ by a complex factor alone."""
    return float(np.abs(np.vdot(a, b)) / (np.linalg.norm(a) * np.linalg.norm(b)))


def _near(peaks: tuple[Peak, ...], frequency: float) -> Peak:
    return min(peaks, key=lambda peak: abs(peak.frequency - frequency))


def test_frequency_damping_and_shares_are_those_of_the_modes() -> None:
    modes = plate.plate_modes()
    points, strikes = _run(1, noise=1e-4, gains=np.exp(1j * np.arange(12)))
    evidence = analyse(strikes)
    gains = modes.gains(points, plate.down(STRIKES))
    for mode, frequency in enumerate(modes.frequencies):
        peak = _near(evidence.peaks, frequency)
        # The resonances are 14 Hz wide, and the neighbours' skirts are in every band.
        assert peak.frequency == pytest.approx(frequency, abs=1.0)
        assert peak.damping == pytest.approx(25.0, abs=3.0)
        # Well within the spread of 0.3 that the likelihood allows for.
        assert _alike(peak.y, gains[:, mode]) > 1.0 / np.hypot(1.0, 0.2)


def test_a_common_delay_polarity_and_level_of_the_microphone_change_nothing() -> None:
    _, strikes = _run(2, noise=1e-3)
    plain = analyse(strikes)
    other = analyse([replace(s, pressure=-3.0 * np.roll(s.pressure, 40)) for s in strikes])
    for peak in plain.peaks:
        assert _alike(_near(other.peaks, peak.frequency).y, peak.y) > 0.999


def test_shares_do_not_hang_on_how_hard_or_long_the_hammer_touched() -> None:
    modes, points = plate.plate_modes(), plate.places(STRIKES, np.random.default_rng(3))
    heard = np.exp(1j * np.arange(len(modes.frequencies)))
    even = plate.strikes(modes, points, np.random.default_rng(3), heard, 1e-4, [2e-4] * STRIKES)
    uneven = plate.strikes(
        modes, points, np.random.default_rng(4), heard, 1e-4, list(np.linspace(1.4e-4, 2.4e-4, STRIKES))
    )
    louder = [replace(uneven[0], force=5.0 * uneven[0].force, pressure=5.0 * uneven[0].pressure), *uneven[1:]]
    others = analyse(louder).peaks
    for peak in analyse(even).peaks:
        if peak.frequency < 5000.0:
            assert _alike(_near(others, peak.frequency).y, peak.y) > 0.998


def test_an_order_of_strikes_is_only_an_order() -> None:
    _, strikes = _run(5)
    order = [3, 0, 4, 1, 2]
    plain, turned = analyse(strikes), analyse([strikes[k] for k in order])
    assert [p.frequency for p in turned.peaks] == pytest.approx([p.frequency for p in plain.peaks])
    for a, b in zip(plain.peaks, turned.peaks, strict=True):
        assert _alike(a.y[order], b.y) == pytest.approx(1.0, abs=1e-9)
        assert b.sigma == pytest.approx(a.sigma[order])


@pytest.mark.parametrize("flag", ["silent", "overload", "double_hit"])
def test_a_strike_that_cannot_be_used_is_left_out_and_named(flag: str) -> None:
    _, strikes = _run(6)
    quiet = replace(strikes[2], pressure=np.zeros_like(strikes[2].pressure))
    spoilt = replace(
        quiet, silent=flag == "silent", overload=flag == "overload", double_hit=flag == "double_hit"
    )
    evidence = analyse([*strikes[:2], spoilt, *strikes[3:]])
    without = analyse([*strikes[:2], *strikes[3:]])
    assert evidence.used.tolist() == [True, True, False, True, True]
    assert evidence.reasons[2] != ""
    assert len(evidence.peaks) == len(without.peaks)
    for peak, other in zip(evidence.peaks, without.peaks, strict=True):
        assert peak.y[2] == 0.0
        assert not peak.heard[2]
        assert np.delete(peak.y, 2) == pytest.approx(other.y)


def test_one_strike_says_nothing() -> None:
    _, strikes = _run(7)
    assert analyse(strikes[:1]).peaks == ()
    assert analyse([replace(s, silent=k > 0) for k, s in enumerate(strikes)]).peaks == ()
    assert analyse([]).peaks == ()


def test_noise_alone_is_no_resonance() -> None:
    _, strikes = _run(8)
    rng = np.random.default_rng(8)
    hiss = [replace(s, pressure=rng.normal(size=len(s.pressure))) for s in strikes]
    assert len(analyse(hiss).peaks) == 0


def _with_twins(gap: float) -> Modes:
    """The plate with its fifth mode brought to within so many Hz of its fourth."""
    modes = plate.plate_modes()
    frequencies = modes.frequencies.copy()
    frequencies[4] = frequencies[3] + gap
    return replace(modes, frequencies=frequencies)


@pytest.mark.parametrize("gap", [1.5, 5.0, 10.0, 20.0])
def test_two_modes_in_one_peak_share_out_the_strikes_between_them(gap: float) -> None:
    modes, rng = _with_twins(gap), np.random.default_rng(4)
    points = plate.places(STRIKES, rng)
    evidence = analyse(plate.strikes(modes, points, rng, np.ones(12, dtype=np.complex128), 1e-4))
    basis = np.linalg.qr(modes.gains(points, plate.down(STRIKES))[:, 3:5])[0]
    peak = _near((*evidence.peaks, *evidence.rejected), modes.frequencies[3] + 0.5 * gap)
    assert np.linalg.norm(basis.T @ peak.y) > 0.99


def test_a_band_that_is_not_one_waveform_is_rejected() -> None:
    modes, rng = _with_twins(20.0), np.random.default_rng(4)
    points = plate.places(STRIKES, rng)
    evidence = analyse(plate.strikes(modes, points, rng, np.ones(12, dtype=np.complex128), 1e-4))
    assert all(abs(peak.frequency - modes.frequencies[3]) > 40.0 for peak in evidence.peaks)
    assert any(abs(peak.frequency - modes.frequencies[3]) < 40.0 for peak in evidence.rejected)


def test_rates_that_differ_are_refused() -> None:
    _, strikes = _run(10)
    with pytest.raises(DataRefused, match=r"48000.* Hz"):
        analyse([*strikes[:-1], replace(strikes[-1], rate=48_000.0)])


def test_a_sample_that_is_not_a_number_is_refused() -> None:
    _, strikes = _run(11)
    broken = strikes[0].pressure.copy()
    broken[-1] = np.nan
    with pytest.raises(DataRefused, match="finite"):
        analyse([replace(strikes[0], pressure=broken), *strikes[1:]])


def test_a_recording_that_ends_early_is_left_out() -> None:
    _, strikes = _run(12)
    short = replace(strikes[0], pressure=strikes[0].pressure[:1100], force=strikes[0].force[:1100])
    assert "too early" in analyse([short, *strikes[1:]]).reasons[0]


def test_silence_of_the_microphone_says_nothing() -> None:
    _, strikes = _run(13)
    assert analyse([replace(s, pressure=np.zeros_like(s.pressure)) for s in strikes]).peaks == ()


def test_a_cell_that_reads_nothing_is_no_division_by_zero() -> None:
    _, strikes = _run(14)
    assert analyse([replace(s, force=np.zeros_like(s.force)) for s in strikes]).peaks == ()


def test_echoes_of_a_room_are_not_taken_for_modes() -> None:
    rng = np.random.default_rng(15)
    modes, points = plate.plate_modes(), plate.places(STRIKES, rng)
    dry = plate.strikes(modes, points, rng, np.exp(1j * np.arange(12)), 3e-3)
    echoes = rng.normal(size=20_000) * np.exp(-17.0 * np.arange(20_000) / plate.RATE)
    echoes *= np.sqrt(0.5 / np.sum(echoes**2))
    echoes[0] = 1.0
    size = len(dry[0].pressure)
    wet = [replace(s, pressure=oaconvolve(s.pressure, echoes)[:size]) for s in dry]
    evidence = analyse(wet)
    gains = modes.gains(points, plate.down(STRIKES))
    # Far above the last mode only its skirt is left, 30 dB down, and echoes on it.
    heard = [peak for peak in evidence.peaks if peak.level > -25.0]
    assert len(heard) >= 8
    for peak in heard:
        mode = int(np.argmin(np.abs(modes.frequencies - peak.frequency)))
        assert peak.frequency == pytest.approx(modes.frequencies[mode], rel=5e-3)
        assert _alike(peak.y[peak.heard], gains[peak.heard, mode]) > 0.9
