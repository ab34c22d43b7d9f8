"""The baseline's features and filter: what they are blind to, and what they are not."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.baselines import (
    Mfcc,
    MfccTable,
    cepstra,
    mel_weights,
    mfcc,
    mfcc_filter,
)
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.sound.gains import gain_table
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.basics.materials import Material
from harness.bench.acquisition import Strike
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples import sounding_plate as plate

SETTINGS = Mfcc()
MODES = plate.plate_modes()
SPACING = 3.0e-3
MODEL = Model(
    plate.box(plate.LENGTH, plate.WIDTH, plate.THICKNESS),
    GELSIGHT_R15,
    shipped_calibration("gelsight_r15_bench"),
)
SURFACE = MODEL.surface(SPACING)
DAMPED = Material("as the strikes are made", 2500.0, 6e10, 0.2, alpha=50.0, beta=0.0)
TABLE = MfccTable(gain_table(MODES, SURFACE), MODES, DAMPED, plate.RATE)


def _heard_at(point: FloatArray, seed: int = 0) -> Strike:
    ones = np.ones(len(MODES.frequencies), dtype=np.complex128)
    return plate.strikes(MODES, point[None], np.random.default_rng(seed), ones, 1e-4, [5e-5])[0]


@settings(max_examples=15, deadline=None)
@given(level=st.floats(1e-3, 1e3), seed=st.integers(0, 100))
def test_loudness_does_not_matter(level: float, seed: int) -> None:
    sound = np.random.default_rng(seed).normal(size=20_000)
    assert mfcc(level * sound, plate.RATE, SETTINGS) == pytest.approx(
        mfcc(sound, plate.RATE, SETTINGS), abs=1e-6
    )


def test_silence_has_no_features() -> None:
    assert np.all(mfcc(np.zeros(20_000), plate.RATE, SETTINGS) == 0.0)
    assert np.all(mfcc(np.zeros(0), plate.RATE, SETTINGS) == 0.0)


def test_all_coefficients_together_are_the_levels() -> None:
    """The cosine transform is orthonormal: nothing but the cut-off coefficients is lost."""
    powers = np.exp(np.random.default_rng(1).normal(size=(4, 64)))
    full = cepstra(powers, replace(SETTINGS, coefficients=64))
    levels = 10.0 * np.log10(powers / powers.max())
    assert np.linalg.norm(full) == pytest.approx(np.linalg.norm(levels))


def test_a_tone_falls_into_the_bands_around_it() -> None:
    size = 2300
    weights = mel_weights(plate.RATE, size, SETTINGS)
    lines = np.fft.rfftfreq(size, 1.0 / plate.RATE)
    assert np.all(weights.sum(axis=0)[(lines > 300.0) & (lines < 15_000.0)] == pytest.approx(1.0))
    peaks = lines[np.argmax(weights, axis=1)]
    assert np.all(np.diff(peaks) > 0.0)


def test_bands_narrower_than_lines_are_refused() -> None:
    with pytest.raises(WrongUse, match=r"64 mel bands.*50 Hz.*46 ms"):
        mel_weights(plate.RATE, 300, SETTINGS)


def test_the_struck_place_is_among_the_most_alike() -> None:
    """Without microphone, room or pulse in the way the features do tell places apart."""
    better = []
    for seed in range(6):
        point = plate.places(1, np.random.default_rng(seed))[0]
        similarities = TABLE.similarities(_heard_at(point))
        own = similarities[np.argmin(np.linalg.norm(SURFACE.points - point, axis=1))]
        better.append(np.mean(similarities > own))
    assert np.median(better) < 0.05


def test_a_strike_that_cannot_be_used_favours_no_place() -> None:
    strike = _heard_at(plate.places(1, np.random.default_rng(0))[0])
    for spoilt in (
        replace(strike, silent=True),
        replace(strike, overload=True),
        replace(strike, double_hit=True),
        replace(strike, pressure=np.zeros_like(strike.pressure)),
    ):
        assert np.all(TABLE.similarities(spoilt) == 0.0)
    similarities = TABLE.similarities(strike)
    assert similarities.min() >= -1.0
    assert similarities.max() <= 1.0 + 1e-6


def _search(points: FloatArray) -> Search:
    rotation = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    contacts = [Contact(transform(rotation, point)) for point in points]
    return Search(contacts, MODEL, Prior(np.eye(3)), SPACING, Noise())


def test_the_filter_says_the_same_twice_and_stays_on_the_surface() -> None:
    points = plate.places(4, np.random.default_rng(3))
    strikes = [_heard_at(point) for point in points]
    search = _search(points)
    first, again = (mfcc_filter(search, TABLE, strikes, 300, seed=5) for _ in range(2))
    assert np.array_equal(first.points, again.points)
    assert first.weights.sum() == pytest.approx(1.0)
    assert np.all(SURFACE.tree.query(first.points)[0] == 0.0)


def test_without_a_strike_the_filter_keeps_its_particles_even() -> None:
    points = plate.places(3, np.random.default_rng(4))
    found = mfcc_filter(_search(points), TABLE, [None, None, None], 200, seed=1)
    assert found.weights == pytest.approx(np.full(200, 1 / 200))


def test_the_filter_follows_the_sound_where_nothing_is_in_its_way() -> None:
    errors = []
    for seed in range(5):
        points = plate.places(5, np.random.default_rng(seed))
        strikes = [_heard_at(point) for point in points]
        found = mfcc_filter(_search(points), TABLE, strikes, 600, seed)
        # The plate is its own mirror image thrice, and its two faces sound alike.
        best = np.abs(found.points[np.argmax(found.log_weights)])
        errors.append(np.linalg.norm(best - np.abs(points[-1])))
    assert np.median(errors) < 0.015
