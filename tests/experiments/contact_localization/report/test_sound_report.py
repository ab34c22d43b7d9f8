"""What the report says of each sense: every strike accounted for, every peak beside its mode."""

from dataclasses import replace
from pathlib import Path
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
from experiments.contact_localization.posterior.strikes import StrikeEvidence
from experiments.contact_localization.report.sound_report import (
    contact_time,
    estimate_sound_scale,
    format_peak,
    format_strike,
    gather_strikes,
    match_peaks,
    pair_spectrograms,
    show_senses,
)
from experiments.contact_localization.settings import KNOBS
from experiments.contact_localization.sound.likelihood import ModeRow
from experiments.contact_localization.touch.touch import Contact
from harness.basics.errors import FitRefused
from harness.basics.geometry import frame_facing, transform
from harness.basics.materials import MATERIALS
from harness.bench.acquisition import Strike
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Scored
from harness.experiment.report_content import CaptionedPicture, Missing, PageBlock, PageSection, ReportTable
from harness.experiment.truth import Truth
from harness.recording.observation import Observation
from harness.report.figures.figures import Album
from harness.report.figures.pictures import object_sides
from harness.report.wording import NONE, duration
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
    run = SimpleNamespace(scene=SimpleNamespace(sensors=SimpleNamespace(sound=asked)), mesh=model.mesh)
    truth = Truth({k: POINTS[k] for k in range(K)}, {})
    nothing = cast(Any, None)
    accuracy = Accuracy.default(KNOBS).with_({SPACING.name: COARSE})
    return Scored(cast(Any, run), nothing, found, truth, accuracy, ())


def analyse_strikes(model: Model, strikes: tuple[Strike | None, ...]) -> tuple[Answer, StrikeEvidence]:
    return analyse(scored(model, strikes))


def analyse(made: ScoredContact) -> tuple[Answer, StrikeEvidence]:
    strike_evidence = gather_strikes(made)
    assert isinstance(strike_evidence, StrikeEvidence)
    return made.found, strike_evidence


def blocks_of(made: ScoredContact, folder: Path) -> tuple[list[PageBlock], dict[str, list[PageBlock]]]:
    """Return the blocks of the section, and those of its subsections by title."""
    sides = object_sides(made.run.mesh, made.found.last.position_in_object, 40)
    pose = transform(frame_facing(np.array([0.0, 0.0, -1.0]), 0.3), POINTS[-1])
    blocks = list(show_senses(made, pose, sides, Album(folder)))
    sections = {one.title: list(one.blocks) for one in blocks if isinstance(one, PageSection)}
    return [one for one in blocks if not isinstance(one, PageSection)], sections


@pytest.fixture(scope="module")
def whole(model: Model) -> ScoredContact:
    return scored(model, STRIKES)


Blocks = tuple[list[PageBlock], dict[str, list[PageBlock]]]


@pytest.fixture(scope="module")
def shown(whole: ScoredContact, album: Path) -> Blocks:
    return blocks_of(whole, album)


@pytest.fixture(scope="module")
def album(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("album")


def silent(strike: Strike) -> Strike:
    return replace(strike, force=0.0 * strike.force, silent=True, onset=0)


def test_a_scene_without_sound_says_that_none_was_called_for(model: Model) -> None:
    assert gather_strikes(scored(model, (None,) * K, asked=False)) == Missing("the scene called for no sound")
    assert gather_strikes(scored(model, (None,) * K)) == Missing("no contact was struck")


def test_each_sense_is_shown_or_says_why_not(shown: Blocks, album: Path) -> None:
    (picture, refused), sections = shown
    assert isinstance(picture, CaptionedPicture)
    assert "green star" in picture.caption
    assert refused == Missing("no answer from touch: these are not presses of this object")
    assert list(sections) == ["Strikes", "Peaks and modes"]
    assert (album / "senses.png").exists()
    assert (album / "spectrograms.png").exists()


def test_peaks_stand_beside_the_modes_that_made_them(whole: ScoredContact, shown: Blocks) -> None:
    found, strike_evidence = analyse(whole)
    peaks, factor = match_peaks(found, strike_evidence), estimate_sound_scale(found, strike_evidence)
    assert not isinstance(peaks, Missing)
    assert factor == pytest.approx(SCALE, abs=0.012)
    assert len(peaks) >= 6
    for peak in peaks:
        assert peak.modes
        true = SCALE * MODES.frequencies[np.array(peak.modes)].mean()
        assert peak.frequency == pytest.approx(true, rel=0.01)
        assert peak.frequency / peak.model_frequency == pytest.approx(1.0, abs=0.02)
        assert peak.model_damping > 0.0
    assert sum(strike_evidence.term.weight * peak.nats for peak in peaks) > 0.0
    band = strike_evidence.term.evidence.band
    assert 0.0 < band[0] < peaks[0].frequency < peaks[-1].frequency < band[1]
    words, _, table = shown[1]["Peaks and modes"]
    assert f"{len(peaks)} resonances in common, {len(peaks)} of them matched to modes" in str(words)
    assert f"The object rings {100.0 * (factor - 1.0):.1f} % above its model." in str(words)
    assert isinstance(table, ReportTable)
    weights = np.array([abs(peak.nats) for peak in peaks])
    bars = [row[-1] for row in table.rows if not isinstance(row[-1], str)]
    assert [bar.percent for bar in bars] == pytest.approx(100.0 * weights / weights.max())
    assert [bar.is_negative for bar in bars] == [peak.nats < 0.0 for peak in peaks]


@pytest.mark.parametrize(
    ("row", "cells"),
    [
        (
            ModeRow(2465.0, 44.0, 0.031, 0.0, (1, 2), 2471.7, 49.0, 0.71, -1.4),
            "2465 Hz|0 dB|2 to 3|2471.7 Hz|-0.27 %|71 %|44 1/s|49 1/s|3.1 %|-1.40 at weight 0.2",
        ),
        (
            ModeRow(1225.7, 31.0, 0.013, -4.0, (0,), 1225.1, 24.0, 0.97, 5.21),
            "1225.7 Hz|-4 dB|1|1225.1 Hz|+0.05 %|97 %|31 1/s|24 1/s|1.3 %|+5.21 at weight 0.2",
        ),
        (
            ModeRow(5111.0, 60.0, 0.092, -21.0, (), 0.0, 0.0, 0.88, 0.0),
            f"5111 Hz|-21 dB|none|{NONE}|{NONE}|88 %|60 1/s|{NONE}|9.2 %|+0.00 at weight 0.2",
        ),
    ],
)
def test_a_peak_is_a_row_with_its_modes(row: ModeRow, cells: str) -> None:
    assert "|".join(format_peak(row, 0.2)) == cells


def test_every_strike_has_a_line_and_without_a_truth_none_is_shown(model: Model, tmp_path: Path) -> None:
    damaged = (
        STRIKES[0],
        replace(STRIKES[1], double_hit=True),
        None,
        replace(STRIKES[3], overload=True),
        silent(STRIKES[4]),
    )
    made = scored(model, damaged)
    found, strike_evidence = analyse(made)
    (picture, _), sections = blocks_of(replace(made, truth=None), tmp_path)
    assert isinstance(picture, CaptionedPicture)
    assert "green star" not in picture.caption
    words, table, _ = sections["Strikes"]
    assert words == "1 of 5 strikes count."
    assert isinstance(table, ReportTable)
    assert [row[0] for row in table.rows] == ["1", "2", "3", "4", "5"]
    unused = ["the hammer hit twice", "not struck", "a channel was overloaded", "no strike came"]
    assert [row[1] for row in table.rows] == ["used", *(f"not used: {reason}" for reason in unused)]
    assert [row[2] == NONE for row in table.rows] == [False, False, True, False, True]
    force, contact, pressure = STRIKES[0].force, STRIKES[0], np.abs(STRIKES[0].pressure).max()
    assert force.max() == pytest.approx(20.0, rel=0.05)
    assert table.rows[0][2:] == (
        f"{force.max():.3g} N",
        duration(contact_time(force, contact.rate)),
        f"{pressure:.3g} Pa",
    )
    (missing,) = sections["Peaks and modes"]
    assert isinstance(missing, Missing)
    assert "strikes" in missing.reason
    pair = pair_spectrograms(found, strike_evidence)
    assert not isinstance(pair, Missing)
    assert pair[0] == 1


def test_the_spectrograms_are_of_the_last_strike_that_counts(model: Model) -> None:
    pair = pair_spectrograms(*analyse_strikes(model, (*STRIKES[:-1], silent(STRIKES[-1]))))
    assert not isinstance(pair, Missing)
    contact, recorded, simulated = pair
    assert contact == K - 1
    assert recorded.levels.shape == simulated.levels.shape
    assert recorded.levels.shape == (len(recorded.frequencies), len(recorded.times))
    early = [shown.levels[:, :5].max(axis=1) for shown in (recorded, simulated)]
    assert np.corrcoef(*early)[0, 1] > 0.5
    none = analyse_strikes(model, tuple(silent(strike) for strike in STRIKES))
    assert pair_spectrograms(*none) == Missing("no strike counts")


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
    assert format_strike(3, None, "not struck") == ("3", "not used: not struck", NONE, NONE, NONE)
