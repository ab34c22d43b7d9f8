"""When places and sounds are taken for another object's, and what is said of strikes that cannot be used."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.posterior.strike_consistency import (
    REFUSE_BELOW,
    REFUSE_UNHEARD_BELOW,
    SoundFit,
    distinct_strikes,
    doubts_of_sound,
)
from harness.basics.geometry import rotation_about, transform
from harness.bench.acquisition import Strike
from harness.recording.observation import Observation

RATE = 50_000.0


def struck(seed: int, frequency: float = 900.0) -> Strike:
    """A half sine of force and one decaying tone, over a little noise."""
    times = (np.arange(25_000) - 1000) / RATE
    noise = np.random.default_rng(seed).standard_normal((2, len(times)))
    force = np.where((times > 0.0) & (times < 2e-4), 90.0 * np.sin(np.pi * times / 2e-4), 0.0)
    after = np.maximum(times, 0.0)
    tone = np.where(times > 0.0, np.exp(-15.0 * after) * np.sin(2.0 * np.pi * frequency * after), 0.0)
    return Strike(RATE, force + 0.01 * noise[0], tone + 1e-3 * noise[1], 1000, 0.0, False, False, False)


def fit(places: list[float], sound: float, resonances: int, unexplained: int = 0) -> SoundFit:
    return SoundFit(np.array(places), 0.0, sound, resonances, unexplained)


def test_the_total_is_of_places_yaw_and_sound() -> None:
    assert SoundFit(np.array([-1.0, -2.0, -0.25]), -0.5, 4.0, 5, 0).total == pytest.approx(2.25)


def test_one_contact_that_slipped_is_forgiven_two_are_not() -> None:
    one, two = fit([0.0, -9.0, -0.5], 2.0, 8), fit([0.0, -9.0, -9.0], 2.0, 8)
    assert one.total > one.limit
    assert two.total < two.limit


@pytest.mark.parametrize(
    ("resonances", "limit"), [(0, REFUSE_UNHEARD_BELOW), (2, REFUSE_UNHEARD_BELOW), (3, REFUSE_BELOW)]
)
def test_the_limit_is_stricter_where_the_sound_can_tell(resonances: int, limit: float) -> None:
    assert fit([-1.0, 0.0], 0.0, resonances).limit == limit
    assert REFUSE_UNHEARD_BELOW < REFUSE_BELOW


@pytest.mark.parametrize(
    ("resonances", "unexplained", "strange"), [(2, 2, False), (10, 3, False), (10, 4, True), (0, 0, False)]
)
def test_many_resonances_of_no_mode_are_strange(resonances: int, unexplained: int, strange: bool) -> None:
    assert fit([0.0, 0.0], 5.0, resonances, unexplained).strange is strange


def at(x: float, strike: Strike | None) -> Observation:
    """A contact at a place of the bench."""
    pose = np.eye(4)
    pose[0, 3] = x
    return Observation(pose, np.zeros((1, 4, 4, 3), np.uint8), strike)


def row(*strikes: Strike | None) -> list[Observation]:
    """Contacts 10 mm from each other."""
    return [at(0.01 * k, strike) for k, strike in enumerate(strikes)]


def test_strikes_that_can_be_used_raise_no_doubt() -> None:
    assert doubts_of_sound(row(struck(1), struck(2))) == ()


def test_a_run_that_was_not_struck_raises_no_doubt() -> None:
    assert doubts_of_sound(row(None, None)) == ()
    assert doubts_of_sound([]) == ()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"silent": True}, "no strike"),
        ({"overload": True}, "overload"),
        ({"double_hit": True}, "twice"),
    ],
)
def test_a_strike_that_cannot_be_used_is_named(change: dict[str, Any], reason: str) -> None:
    (doubt,) = doubts_of_sound(row(struck(1), replace(struck(2), **change), struck(3)))
    assert re.search(f"1 of 3 .*contact 2 .*{reason}", doubt)


def test_a_contact_that_was_not_struck_is_named() -> None:
    (doubt,) = doubts_of_sound(row(struck(1), struck(2), None))
    assert re.search("1 of 3 .*contact 3 ", doubt)


def test_fewer_than_two_strikes_say_nothing() -> None:
    (doubt,) = doubts_of_sound(row(struck(1), replace(struck(2), silent=True)))
    assert re.search("1 of 2 strikes.* 2 .*contact 2 ", doubt)


def test_strikes_without_a_resonance_say_nothing() -> None:
    strikes = [replace(struck(k), pressure=np.random.default_rng(k).standard_normal(25_000)) for k in (1, 2)]
    (doubt,) = doubts_of_sound(row(*strikes))
    assert "resonance" in doubt


def test_a_place_struck_again_is_one_witness() -> None:
    first, again, other = at(0.0, struck(1)), at(1e-3, struck(2)), at(0.01, struck(3))
    (doubt,) = doubts_of_sound([first, again, other])
    assert re.search("1 of 3 .*contact 2 .*contact 1 ", doubt)
    poses = [one.base_from_gel for one in (first, again, other)]
    strikes = [one.strike for one in (first, again, other)]
    assert distinct_strikes(poses, strikes) == [strikes[0], None, strikes[2]]


def test_a_strike_that_failed_does_not_stand_for_its_repetition() -> None:
    strikes = [replace(struck(1), overload=True), struck(2)]
    assert distinct_strikes([np.eye(4), np.eye(4)], strikes) == strikes


def test_a_place_struck_from_another_side_counts() -> None:
    turned = transform(rotation_about(np.array([1.0, 0.0, 0.0]), 0.2), np.zeros(3))
    strikes = [struck(1), struck(2)]
    assert distinct_strikes([np.eye(4), turned], strikes) == strikes
