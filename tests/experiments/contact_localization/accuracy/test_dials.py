"""The estimator's dials: what an operator may choose, and that the choice is what is run."""

import pytest

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.estimate import (
    BLOCK,
    DIALS,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
)
from experiments.contact_localization.settings import (
    FINEST,
    KNOBS,
    needs_sound,
    settings,
    settings_by_count,
)
from harness.basics.errors import WrongUse
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.sound import EDGE
from harness.experiment.front import front_of
from tests.support.localization import chosen, dials


@pytest.mark.parametrize("knob", DIALS, ids=lambda knob: knob.name)
def test_turning_one_dial_changes_that_level_and_no_other(knob: Knob[Level]) -> None:
    for level in knob.levels:
        found = chosen([f"{knob.name}={level}"])
        assert found == dials().with_({knob.name: level})
        for other in DIALS:
            assert found.of(other) == (level if other is knob else other.default)
            assert type(found.of(other)) is type(other.default)


def test_dials_go_from_cheap_to_exact() -> None:
    for falls in (SPACING, BLOCK):
        assert list(falls.levels) == sorted(falls.levels, reverse=True)
    for rises in (PARTICLES, SAMPLES, ROUNDS):
        assert list(rises.levels) == sorted(rises.levels)


@pytest.mark.parametrize(
    "text", ["localization.spacin=0.002", "localization.spacing=0.0021", "localization.spacing"]
)
def test_a_mistyped_choice_is_refused(text: str) -> None:
    with pytest.raises(WrongUse):
        chosen([text])


def test_names_are_unique() -> None:
    names = [knob.name for knob in KNOBS]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("thorough", [False, True])
def test_what_is_measured_names_its_sense_and_only_levels_that_there_are(thorough: bool) -> None:
    found = settings(thorough)
    assert {setting[SENSES.name] for setting in found} == {"touch", "audio", "both"}
    for setting in found:
        Accuracy.default(KNOBS).with_(setting)
    assert FINEST in found


def test_runs_that_were_not_heard_are_measured_by_touch_alone() -> None:
    assert not any(needs_sound(setting) for setting in (*settings(sound=False), *settings_by_count(False)))
    assert all(setting in settings() for setting in settings(sound=False))


def test_what_is_measured_with_fewer_contacts_is_measured_with_the_most_too() -> None:
    for sound in (False, True):
        assert all(setting in settings(sound=sound) for setting in settings_by_count(sound))


def test_about_thirty_settings_are_measured_over_senses_modes_and_elements() -> None:
    found = settings()
    assert 25 <= len(found) <= 35
    assert {setting.get("sound.modes") for setting in found} >= {None, 16, 32}
    assert {setting.get("sound.edge") for setting in found} >= {None, 0.7}


def test_a_shipped_budget_never_buys_coarser_elements() -> None:
    """They are found sooner, once an object, and save an answer nothing: only luck would choose them."""
    curve = ContactMeasurement(EXPERIMENT).shipped_curve()
    coarse = [setting for setting in (point.levels for point in curve.points) if EDGE.name in setting]
    measured = [setting for setting in coarse if setting[EDGE.name] != EDGE.default]
    assert measured, "the curve no longer says what coarser elements cost"
    for condition in curve.conditions():
        offered = front_of(EXPERIMENT, curve, condition, (), shipped=True).points
        assert offered
        assert not [point.name for point in offered if point.levels in measured]
