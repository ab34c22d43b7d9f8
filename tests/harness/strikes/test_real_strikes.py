"""Measured beams and a real hammer: what beam theory, published values and other algorithms say of them.

The data are examples that others published with their programs: pyuff's accelerances of a beam at lines of
1 Hz, pydvma's ruler at lines of 0.61 Hz, and pyFRF's three blows sampled at 25.6 kHz.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import find_peaks

from harness.basics.arrays import FloatArray
from harness.bench.acquisition import shipped_acquisition, strike_from_readings
from harness.bench.acquisition_channels import BLOCK, CaptureForm, readings_of_capture
from harness.strikes.frequency_response import Blow, frequency_response, measure_blow
from harness.strikes.modal_identification import Identified, IdentifiedMode, modes_of_decay, modes_of_response
from harness.strikes.pole_fit import PoleSearch
from tests.oracles.measured_beams import (
    HAMMER_RATE,
    MAINS,
    RULER_STEP,
    alike,
    beam_ratios,
    beam_roots,
    free_shape,
    hammer_blows,
    ruler,
    suspended_beam,
)

STRONG = -40.0
"""dB: weaker ones are what little else there is."""

RULER_BAND = PoleSearch(low=20.0, high=800.0, misfit=0.2)
"""Its places were measured one after another, and its poles moved by a half per cent meanwhile."""

BEGUN = 40
"""Samples after which the last of the three blows is over."""


@pytest.fixture(scope="module")
def beam(shared_data: Path) -> Identified:
    return modes_of_response(*suspended_beam(shared_data), PoleSearch(low=20.0))


@pytest.fixture(scope="module")
def steel_ruler(shared_data: Path) -> Identified:
    return modes_of_response(*ruler(shared_data), RULER_BAND)


@pytest.fixture(scope="module")
def ringing(shared_data: Path) -> Identified:
    decays = hammer_blows(shared_data)[1][:, BEGUN:]
    return modes_of_decay(decays, HAMMER_RATE, PoleSearch(low=100.0, high=2800.0))


def strong(identified: Identified) -> list[IdentifiedMode]:
    return [mode for mode in identified.modes if mode.level > STRONG]


def known_to(step: float, first: float, other: float) -> float:
    """Of a ratio of two frequencies that are each known to half a line."""
    return 0.5 * step * (1.0 / first + 1.0 / other)


def test_the_suspended_beam_has_the_ratios_of_a_free_one(beam: Identified) -> None:
    """Six peaks, none between them, each within half a line of where the published spectrum is highest."""
    frequencies = np.array([mode.frequency for mode in strong(beam)])
    assert frequencies == pytest.approx([52.0, 142.0, 279.0, 460.0, 687.0, 959.0], abs=0.5)
    for frequency, ratio in zip(frequencies, beam_ratios("free-free", 6), strict=True):
        off = frequency / frequencies[0] / ratio - 1.0
        assert abs(off) <= known_to(1.0, frequencies[0], frequency)
        # Ten times better than the lines: theory itself, without shear, is no better than this.
        assert abs(off) < 2e-3


def test_every_place_of_the_beam_has_the_same_peaks(shared_data: Path, beam: Identified) -> None:
    """Each of three places alone, to a twentieth of a line.

    Each place states a tenth of that: something of the set-up was moved from place to place.
    """
    frequencies, values = suspended_beam(shared_data)
    for row in values:
        alone = np.array(
            [mode.frequency for mode in modes_of_response(frequencies, row, PoleSearch(low=20.0)).modes]
        )
        for mode in strong(beam):
            assert np.abs(alone - mode.frequency).min() < 0.05


def test_the_suspended_beam_is_lightly_damped(beam: Identified) -> None:
    """0.01 to 0.06 per cent, each known to a tenth of itself."""
    for mode in strong(beam):
        assert 1e-4 < mode.ratio < 6e-4
        assert mode.ratio_sigma < 0.1 * mode.ratio


def test_the_ruler_moves_as_a_free_beam_does(steel_ruler: Identified) -> None:
    """Ten places from end to end: shapes tell free from clamped, whatever the frequencies do."""
    places, roots = np.linspace(0.0, 1.0, 10), beam_roots("free-free", 6)
    bending = [mode for mode in strong(steel_ruler) if mode.ratio > 4e-3]
    assert len(bending) == 6
    for number, mode in enumerate(bending):
        shape = mode.lines[:, int(np.argmin(np.abs(steel_ruler.frequencies - mode.frequency)))]
        likeness = [alike(shape, free_shape(root, places)) for root in roots]
        assert int(np.argmax(likeness)) == number
        assert likeness[number] > 0.85


def test_the_ruler_has_the_ratios_of_a_free_beam_but_for_the_fifth(steel_ruler: Identified) -> None:
    """The fifth is two peaks, both of its shape, on either side of where theory has it."""
    bending = [mode.frequency for mode in strong(steel_ruler) if mode.ratio > 4e-3]
    theory = bending[0] * beam_ratios("free-free", 6)
    for number in (0, 1, 2, 3, 5):
        known = known_to(RULER_STEP, bending[0], bending[number])
        assert bending[number] == pytest.approx(theory[number], rel=known)
    (partner,) = (mode for mode in strong(steel_ruler) if 5e-4 < mode.ratio < 4e-3)
    assert bending[4] < theory[4] < partner.frequency
    clamped = np.array(bending[1:4]) / bending[0] / beam_ratios("cantilever", 4)[1:] - 1.0
    assert np.all(np.abs(clamped) > 0.4)


def test_a_mode_of_the_ruler_that_moved_between_the_rows_is_one_mode(shared_data: Path) -> None:
    """Without the wider misfit: second and third bending mode, each in a band without any other."""
    for centre, low, high in ((108.5, 80.0, 140.0), (212.2, 150.0, 260.0)):
        identified = modes_of_response(*ruler(shared_data), PoleSearch(low=low, high=high))
        (mode,) = identified.modes
        assert mode.frequency == pytest.approx(centre, abs=0.3)
        assert mode.spread > 0.0


def test_the_mains_are_told_from_modes(steel_ruler: Identified) -> None:
    """A line of the mains in the ruler's records: found without any damping, and no mode."""
    (hum,) = steel_ruler.undamped
    assert hum.frequency == pytest.approx(MAINS, abs=5.0 * hum.frequency_sigma)
    assert abs(hum.damping) < 3.0 * hum.damping_sigma


def test_free_decay_and_transfer_function_have_the_same_poles(shared_data: Path, ringing: Identified) -> None:
    forces, responses = hammer_blows(shared_data)
    measured = frequency_response(forces, responses, HAMMER_RATE)
    assert measured.coherence is not None
    assert np.median(measured.coherence[100:2800]) > 0.999
    assert measured.band[1] > 4000.0
    other = modes_of_response(measured.frequencies, measured.h1, PoleSearch(low=100.0, high=2800.0)).modes
    pairs = [(mode, min(other, key=lambda o: abs(o.frequency - mode.frequency))) for mode in strong(ringing)]
    for one, two in pairs:
        assert abs(one.frequency - two.frequency) < 4.0 * np.hypot(one.frequency_sigma, two.frequency_sigma)
        assert abs(one.damping - two.damping) < 4.0 * np.hypot(one.damping_sigma, two.damping_sigma)


def test_every_high_peak_of_the_transfer_function_is_a_mode(shared_data: Path, ringing: Identified) -> None:
    """Peaks 20 dB above what surrounds them, found by looking."""
    forces, responses = hammer_blows(shared_data)
    measured = frequency_response(forces, responses, HAMMER_RATE)
    level = 20.0 * np.log10(np.abs(measured.h1[101:2800]))
    seen = measured.frequencies[101:2800][find_peaks(level, prominence=20.0)[0]]
    assert len(seen) >= 4
    modes = np.array([mode.frequency for mode in ringing.modes])
    assert all(np.abs(modes - frequency).min() < 1.0 for frequency in seen)


def test_damping_by_the_logarithmic_decrement(shared_data: Path, ringing: Identified) -> None:
    """The strong mode near 2640 Hz: turned down to 0 Hz, and its level's slope by a straight line.

    Its damping is no constant: it falls from 4.2 to 3.8 1/s while it rings. The two ways weigh that alike
    if each level counts by its height; to a fifth of that range.
    """
    (mode,) = (one for one in ringing.modes if one.level > -20.0 and one.frequency > 2000.0)
    slopes = []
    for response in hammer_blows(shared_data)[1][:, BEGUN:]:
        turned = response * np.exp(-2j * np.pi * mode.frequency * np.arange(len(response)) / HAMMER_RATE)
        starts = np.arange(0, len(turned) - 4096, 1024)
        level = np.array([abs(turned[start : start + 4096] @ np.hanning(4096)) for start in starts])
        slopes.append(-np.polyfit(starts / HAMMER_RATE, np.log(level), 1, w=level)[0])
    assert np.mean(slopes) == pytest.approx(mode.damping, rel=0.02)


@pytest.fixture(scope="module")
def forces(shared_data: Path) -> FloatArray:
    return hammer_blows(shared_data)[0]


def spline_of(force: FloatArray) -> tuple[CubicSpline, float]:
    """The first 60 samples above the rest of the last second, and what a cubic spline may be off by.

    Its error is at most 5/384 of the fourth difference (Hall and Meyer, 1976).
    """
    rest = float(np.median(force[2000:]))
    samples = force[:60] - rest
    return CubicSpline(np.arange(60.0) / HAMMER_RATE, samples), 5.0 / 384.0 * float(
        np.abs(np.diff(samples, 4)).max()
    )


def spans(spline: CubicSpline, level: float) -> tuple[float, float]:
    """s for which it is above, and its least slope where it passes."""
    first, last = spline.solve(level, extrapolate=False)
    return float(last - first), float(np.abs(spline.derivative()(np.array([first, last]))).min())


@pytest.mark.parametrize("number", [0, 1, 2])
def test_force_impulse_and_time_of_a_blow_by_another_way(forces: FloatArray, number: int) -> None:
    """A spline's maximum and roots, and a trapezoid, against band-limited interpolation and a sum."""
    blow = measure_blow(forces[number], HAMMER_RATE)
    spline, off = spline_of(forces[number])
    turning = spline.derivative().roots(extrapolate=False)
    peak = float(spline(turning).max())
    assert blow.peak == pytest.approx(peak, abs=off + 3.0 * blow.peak_sigma)
    for share, got in ((0.1, blow.duration), (0.5, blow.width)):
        span, slope = spans(spline, share * peak)
        # Both ends, for a level and a curve that are each off.
        assert got == pytest.approx(span, abs=2.0 * (1.0 + share) * off / slope + 3.0 * blow.duration_sigma)
    rest = np.median(forces[number][2000:])
    impulse = np.trapezoid(forces[number][:60] - rest, dx=1.0 / HAMMER_RATE)
    noise = blow.noise * np.sqrt(60.0) / HAMMER_RATE
    assert blow.impulse == pytest.approx(impulse, abs=3.0 * np.hypot(noise, blow.impulse_sigma))


def test_the_blows_are_those_that_were_published(forces: FloatArray) -> None:
    """Peaks of 69 to 89 N, half as much for 0.16 to 0.20 ms, 12 to 16 mN s; to the digits given."""
    for blow in (measure_blow(force, HAMMER_RATE) for force in forces):
        assert 68.5 <= blow.peak <= 89.5
        assert 0.155e-3 <= blow.width <= 0.205e-3
        assert 11.5e-3 <= blow.impulse <= 16.5e-3
        assert blow.touches == 1


def as_the_bench_reads_it(force: FloatArray) -> Blow:
    """Counted by the bench's converter, recorded, and read again as a run's strikes are."""
    calibration = shipped_acquisition("acquisition_bench")
    samples = len(force) // BLOCK * BLOCK
    counts = np.zeros((samples, 2))
    counts[:, 0] = np.rint(force[:samples] / calibration.newtons_per_count + calibration.hammer_offset)
    counts[:, 1] = np.rint(calibration.microphone_offset + np.random.default_rng(0).normal(size=samples))
    form = CaptureForm(HAMMER_RATE, 100.0, calibration.full_scale_counts)
    clock = np.array([[0.0, 0.0], [1000.0, 1000.0 / HAMMER_RATE]])
    readings = readings_of_capture(counts, (0.0, 0.0), HAMMER_RATE, form, clock, np.zeros(2))
    strike = strike_from_readings({reading.channel.name: reading for reading in readings}, calibration)
    assert strike.fault == ""
    return measure_blow(strike.force, strike.rate)


def test_the_bench_reads_a_real_blow_as_it_was(forces: FloatArray) -> None:
    """A count of the bench is 0.014 N; rounding adds a third of one to each sample."""
    count = shipped_acquisition("acquisition_bench").newtons_per_count
    for force in forces:
        direct, read = measure_blow(force, HAMMER_RATE), as_the_bench_reads_it(force)
        assert read.peak == pytest.approx(direct.peak, abs=2.0 * count)
        assert read.impulse == pytest.approx(direct.impulse, abs=3.0 * read.impulse_sigma)
        assert read.duration == pytest.approx(direct.duration, abs=5.0 * read.duration_sigma)
        assert not read.double_hit


def test_a_real_double_hit_is_seen(forces: FloatArray) -> None:
    """The second blow's force, a tenth of it, 20 ms behind itself."""
    twice = forces[1] + 0.1 * np.roll(forces[1], 512)
    assert measure_blow(twice, HAMMER_RATE).double_hit
