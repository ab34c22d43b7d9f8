"""What the report says of each sense: every strike accounted for, every peak beside its mode."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.answer import Answer, ScoredContact
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import SPACING, locate
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.report.sound_report import contact_time, sound_of, strike_line
from experiments.contact_localization.settings import KNOBS
from experiments.contact_localization.touch.touch import Contact
from harness.basics.errors import FitRefused
from harness.basics.geometry import frame_facing, transform
from harness.basics.materials import MATERIALS
from harness.bench.acquisition import Strike
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Scored
from harness.experiment.truth import Truth
from harness.recording.observation import Observation
from harness.report.data import Sound
from harness.report.values import Missing
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples import sounding_plate as plate
from tests.samples.blows import half_sine
from tests.support.localization import dials

K = 5
SCALE = 1.03
COARSE = 4e-3
MODES = plate.plate_modes()
POINTS = plate.places(K, np.random.default_rng(4))
STRIKES = plate.strikes(plate.plate_modes(scale=SCALE), POINTS, np.random.default_rng(5))
"""Of a plate that rings 3 % higher than its model."""

BASE_FROM_OBJECT = transform(np.eye(3), np.array([-0.4, 0.1, 0.3]))
IMAGE = np.zeros((1, 120, 160, 3), np.uint8)


@pytest.fixture(scope="module")
def model() -> Model:
    mesh = plate.box(plate.LENGTH, plate.WIDTH, plate.THICKNESS)
    calibration = shipped_calibration("gelsight_r15_bench")
    return Model(mesh, GELSIGHT_R15, calibration, MODES, MATERIALS["glass"])


def scored(model: Model, strikes: tuple[Strike | None, ...], asked: bool = True) -> ScoredContact:
    """By touch the plate was refused, by sound it was not."""
    facing = frame_facing(np.array([0.0, 0.0, -1.0]), 0.3)
    poses = [BASE_FROM_OBJECT @ transform(facing, point) for point in POINTS]
    prior = Prior(np.eye(3))
    last = locate(
        [Contact(pose) for pose in poses],
        model,
        prior,
        dials(spacing=COARSE, senses="audio"),
        Noise(),
        strikes=STRIKES,
    )[-1]
    seen = tuple(Observation(pose, IMAGE, strike) for pose, strike in zip(poses, strikes, strict=True))
    found = Answer(
        Readings(seen, (), model, prior, 0),
        last,
        0.1,
        "audio",
        {"touch": FitRefused("these are not presses of this object")},
    )
    run = SimpleNamespace(scene=SimpleNamespace(sensors=SimpleNamespace(sound=asked)))
    truth = Truth({k: POINTS[k] for k in range(K)}, {})
    nothing = cast(Any, None)
    accuracy = Accuracy.default(KNOBS).with_({SPACING.name: COARSE})
    return Scored(cast(Any, run), nothing, found, truth, accuracy, ())


def shown(model: Model, strikes: tuple[Strike | None, ...]) -> Sound:
    sound = sound_of(scored(model, strikes))
    assert isinstance(sound, Sound)
    return sound


def silent(strike: Strike) -> Strike:
    return replace(strike, force=0.0 * strike.force, silent=True, onset=0)


def test_a_scene_without_sound_says_that_none_was_called_for(model: Model) -> None:
    assert sound_of(scored(model, (None,) * K, asked=False)) == Missing("the scene called for no sound")
    assert sound_of(scored(model, (None,) * K)) == Missing("no contact was struck")


def test_each_sense_is_shown_or_says_why_not(model: Model) -> None:
    made = scored(model, STRIKES)
    sound = sound_of(made)
    assert isinstance(sound, Sound)
    touch, audio = sound.senses
    assert (touch.name, audio.name) == ("touch", "audio")
    assert touch.posterior == Missing("these are not presses of this object")
    assert (touch.error, touch.area, touch.seconds) == (None, None, None)
    assert not isinstance(audio.posterior, Missing)
    last = made.found.last
    assert audio.error == pytest.approx(np.linalg.norm(last.position_in_object - POINTS[-1]))
    assert audio.posterior.estimate == pytest.approx(last.position_in_object)
    assert len(audio.posterior.modes) == len(last.modes) == len(audio.posterior.mode_weights)
    assert audio.area == last.region.area
    assert audio.seconds == pytest.approx(sum(last.seconds.values()))


def test_without_a_truth_no_sense_has_an_error(model: Model) -> None:
    sound = sound_of(replace(scored(model, STRIKES), truth=None))
    assert isinstance(sound, Sound)
    assert [sense.error for sense in sound.senses] == [None, None]


def test_peaks_stand_beside_the_modes_that_made_them(model: Model) -> None:
    sound = shown(model, STRIKES)
    assert not isinstance(sound.peaks, Missing)
    assert sound.scale == pytest.approx(SCALE, abs=0.012)
    assert len(sound.peaks) >= 6
    for peak in sound.peaks:
        assert peak.modes
        true = SCALE * MODES.frequencies[np.array(peak.modes) - 1].mean()
        assert peak.frequency == pytest.approx(true, rel=0.01)
        assert peak.apart == pytest.approx(0.0, abs=0.02)
        assert peak.mode_damping is not None
        assert peak.mode_damping > 0.0
        assert peak.counted == pytest.approx(peak.weight * peak.nats)
    assert sum(peak.counted for peak in sound.peaks) > 0.0
    assert sound.band is not None
    assert 0.0 < sound.band[0] < sound.peaks[0].frequency < sound.peaks[-1].frequency < sound.band[1]


def test_every_strike_has_a_line_and_what_is_wrong_with_it(model: Model) -> None:
    damaged = (
        STRIKES[0],
        replace(STRIKES[1], double_hit=True),
        None,
        replace(STRIKES[3], overload=True),
        silent(STRIKES[4]),
    )
    sound = shown(model, damaged)
    assert [line.contact for line in sound.strikes] == [1, 2, 3, 4, 5]
    said = ["", "the hammer hit twice", "not struck", "a channel was overloaded", "no strike came"]
    assert [line.unused for line in sound.strikes] == said
    assert [line.force is None for line in sound.strikes] == [False, False, True, False, True]
    assert sound.strikes[0].force == pytest.approx(20.0, rel=0.05)
    assert sound.strikes[0].pressure == pytest.approx(np.abs(STRIKES[0].pressure).max())
    assert isinstance(sound.peaks, Missing)
    assert "strikes" in sound.peaks.reason
    assert sound.band is None
    assert not isinstance(sound.pair, Missing)
    assert sound.pair.contact == 1


def test_the_spectrograms_are_of_the_last_strike_that_counts(model: Model) -> None:
    sound = shown(model, (*STRIKES[:-1], silent(STRIKES[-1])))
    assert not isinstance(sound.pair, Missing)
    pair = sound.pair
    assert pair.contact == K - 1
    shape = (len(pair.frequencies), len(pair.times))
    assert pair.recorded.shape == pair.simulated.shape == shape
    early = [levels[:, :5].max(axis=1) for levels in (pair.recorded, pair.simulated)]
    assert np.corrcoef(*early)[0, 1] > 0.5
    none = shown(model, tuple(silent(strike) for strike in STRIKES))
    assert none.pair == Missing("no strike counts")


@settings(max_examples=30, deadline=None)
@given(
    touching=st.floats(1e-4, 4e-3),
    peak=st.floats(0.5, 200.0),
    late=st.integers(0, 400),
    gain=st.floats(0.1, 9.0),
)
def test_the_contact_time_of_half_a_sine_is_known(
    touching: float, peak: float, late: int, gain: float
) -> None:
    force = np.concatenate([np.zeros(late), half_sine(plate.RATE, touching, peak), np.zeros(50)])
    expected = touching * (1.0 - 2.0 * np.arcsin(0.1) / np.pi)
    found = contact_time(force, plate.RATE)
    assert found == pytest.approx(expected, abs=2.0 / plate.RATE)
    assert contact_time(gain * force, plate.RATE) == pytest.approx(found)


def test_a_second_hit_is_not_counted_as_contact() -> None:
    once = half_sine(plate.RATE, 3e-4, 40.0)
    twice = np.concatenate([once, np.zeros(200), 0.5 * once])
    assert contact_time(twice, plate.RATE) == contact_time(np.append(once, np.zeros(9)), plate.RATE)


def test_a_force_that_never_falls_is_counted_to_the_end() -> None:
    assert contact_time(np.full(51, 7.0), plate.RATE) == pytest.approx(50 / plate.RATE)


def test_nothing_is_said_of_a_strike_that_was_not_made() -> None:
    line = strike_line(3, None, "not struck")
    assert (line.contact, line.unused) == (3, "not struck")
    assert (line.force, line.contact_time, line.pressure) == (None, None, None)
