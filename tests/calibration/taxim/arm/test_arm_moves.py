"""Pitch, aspect and rotation from known moves: exact where nothing errs, honest where something does."""

import numpy as np
import pytest

from calibration.taxim.arm.moves import LEAST, ArmScale, Uncertain, arm_scale
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused

PITCH, ASPECT, ROTATION, SKEW = 0.12e-3, 1.01, 0.02, -0.003
NOISE = 0.03e-3


def matrix(
    pitch: float = PITCH, aspect: float = ASPECT, turned: float = ROTATION, skew: float = SKEW
) -> FloatArray:
    """``G`` of a picture: ``(2, 2)`` m a pixel."""
    wide, high = pitch / np.sqrt(aspect), pitch * np.sqrt(aspect)
    across, down = turned - 0.5 * skew, turned + 0.5 * skew
    return np.array(
        [[wide * np.cos(across), -high * np.sin(down)], [wide * np.sin(across), high * np.cos(down)]]
    )


def pixels(count: int = 30, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform((15.0, 15.0), (145.0, 105.0), (count, 2))


def moved(places: FloatArray, gel: FloatArray, noise: float = 0.0, seed: int = 1) -> FloatArray:
    on_gel: FloatArray = places @ gel.T + np.array([3e-3, -7e-3])
    return on_gel + np.random.default_rng(seed).normal(0.0, noise, places.shape)


def steps(scale: ArmScale) -> FloatArray:
    return np.array([scale.wide.value, scale.high.value])


def values(scale: ArmScale) -> FloatArray:
    return np.array([scale.pitch.value, scale.aspect.value, scale.rotation.value, scale.skew.value])


@pytest.mark.parametrize("turned", [0.0, 0.02, 1.5, -3.1, np.pi / 2])
@pytest.mark.parametrize("aspect", [0.7, 1.0, 1.3])
def test_without_errors_the_map_is_found_to_rounding(turned: float, aspect: float) -> None:
    places = pixels()
    found = arm_scale([places], moved(places, matrix(aspect=aspect, turned=turned)))
    assert values(found) == pytest.approx([PITCH, aspect, turned, SKEW], rel=1e-9, abs=1e-9)
    assert steps(found) == pytest.approx(PITCH * np.array([aspect**-0.5, aspect**0.5]), rel=1e-9)
    assert found.scatter < 1e-15
    assert found.off == ()


def test_where_the_gel_and_the_picture_have_their_origins_changes_nothing() -> None:
    places = pixels()
    on_gel = moved(places, matrix(), NOISE)
    one, other = arm_scale([places], on_gel), arm_scale([places + 1000.0], on_gel + 5.0)
    assert values(one) == pytest.approx(values(other), rel=1e-7)
    order = np.random.default_rng(3).permutation(len(places))
    assert values(arm_scale([places[order]], on_gel[order])) == pytest.approx(values(one), rel=1e-9)


def test_longer_moves_are_a_larger_pitch_and_turned_ones_a_rotation_and_nothing_else() -> None:
    places = pixels()
    on_gel = moved(places, matrix(), NOISE)
    plain, longer = arm_scale([places], on_gel), arm_scale([places], 1.7 * on_gel)
    assert longer.pitch.value == pytest.approx(1.7 * plain.pitch.value)
    assert longer.pitch.sigma == pytest.approx(1.7 * plain.pitch.sigma)
    assert values(longer)[1:] == pytest.approx(values(plain)[1:])
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    turned = arm_scale([places], on_gel @ turn.T)
    assert values(turned) == pytest.approx(values(plain) + np.array([0.0, 0.0, 0.3, 0.0]))


def test_errors_are_what_they_are_said_to_be() -> None:
    """Of 300 draws the numbers' errors over their sigmas have a spread of one, and 95 % lie within 95 %."""
    true = np.array([PITCH, ASPECT, ROTATION, SKEW, PITCH * ASPECT**-0.5, PITCH * ASPECT**0.5])
    over, within = [], []
    for seed in range(300):
        places = pixels(20, seed)
        found = arm_scale([places], moved(places, matrix(), NOISE, seed + 1000))
        each: list[Uncertain] = [
            found.pitch,
            found.aspect,
            found.rotation,
            found.skew,
            found.wide,
            found.high,
        ]
        off = np.concatenate([values(found), steps(found)]) - true
        over.append(off / [one.sigma for one in each])
        within.append(np.abs(off) <= [one.within95 for one in each])
    # A standard deviation of 300 normal numbers is known to 4 %, a share of 95 % to 1.3 %.
    assert np.std(over, axis=0) == pytest.approx(np.ones(6), abs=0.2)
    assert np.abs(np.mean(over, axis=0)).max() < 0.25
    assert np.mean(within, axis=0) == pytest.approx(np.full(6, 0.95), abs=0.045)


def test_four_times_as_many_presses_halve_the_scatters_part() -> None:
    sigmas = []
    for count in (40, 160):
        places = pixels(count)
        sigmas.append(arm_scale([places], moved(places, matrix(), NOISE)).pitch.of_scatter)
    assert sigmas[0] / sigmas[1] == pytest.approx(2.0, rel=0.2)


def test_ways_to_see_that_disagree_are_part_of_the_error() -> None:
    places = pixels()
    on_gel = moved(places, matrix(), NOISE)
    alone = arm_scale([places], on_gel).pitch
    both = arm_scale([places, 1.01 * places], on_gel).pitch
    assert both.value == pytest.approx(alone.value * (1.0 + 1.0 / 1.01) / 2.0, rel=1e-6)
    assert both.sigma > 0.004 * PITCH > 2.0 * alone.sigma
    assert both.of_scatter < 1.1 * alone.of_scatter


def test_a_part_of_a_correction_counts_as_error() -> None:
    places = pixels()
    on_gel = moved(places, matrix(), NOISE)
    plain = arm_scale([places], on_gel)
    same, much = arm_scale([places], on_gel, places), arm_scale([places], on_gel, places / 1.04)
    assert values(same) == pytest.approx(values(plain))
    assert same.pitch.sigma == pytest.approx(plain.pitch.sigma)
    assert much.pitch.value == plain.pitch.value
    by_correction = np.sqrt(much.pitch.sigma**2 - plain.pitch.sigma**2)
    assert by_correction == pytest.approx(0.05 * 0.04 * PITCH, rel=0.01)
    assert much.rotation.sigma == pytest.approx(plain.rotation.sigma)


def test_a_press_that_slipped_is_named_and_not_used() -> None:
    places = pixels()
    on_gel = moved(places, matrix(), NOISE)
    on_gel[7] += (0.6e-3, 0.0)
    places[11] = np.nan
    found = arm_scale([places], on_gel)
    assert 7 in found.off
    assert 11 not in found.off
    assert {7, 11}.isdisjoint(found.used)
    assert abs(found.pitch.value - PITCH) < 4.0 * found.pitch.sigma
    assert np.hypot(*found.residuals[7]) == pytest.approx(0.6e-3, rel=0.3)


def test_too_few_presses_are_refused() -> None:
    places = pixels(LEAST - 1)
    with pytest.raises(CalibrationRefused, match=f"{LEAST - 1} presses.* {LEAST} "):
        arm_scale([places], moved(places, matrix()))


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.6, 0.8)])
def test_presses_in_one_line_are_refused(direction: tuple[float, float]) -> None:
    along = np.linspace(0.0, 60.0, 20)[:, None] * np.array(direction) + 30.0
    with pytest.raises(CalibrationRefused, match="20 presses"):
        arm_scale([along], moved(along, matrix(), NOISE))
    wavy = along + np.random.default_rng(0).normal(0.0, 0.3, along.shape)
    with pytest.raises(CalibrationRefused, match=r"0\.0\d mm.*0\.0\d+ mm"):
        arm_scale([wavy], moved(wavy, matrix(), NOISE))


@pytest.mark.parametrize("skew", [-0.05, 0.05])
def test_a_picture_askew_is_refused_and_a_little_is_told(skew: float) -> None:
    places = pixels()
    with pytest.raises(CalibrationRefused, match=r"2\.\d\d deg.*\b2\b"):
        arm_scale([places], moved(places, matrix(skew=skew), NOISE))
    little = arm_scale([places], moved(places, matrix(skew=0.4 * skew), NOISE)).skew
    assert little.value == pytest.approx(0.4 * skew, abs=3.0 * little.sigma)
    assert abs(little.value) > little.within95


def test_an_aspect_is_taken_where_the_presses_can_tell_it_from_one() -> None:
    places = pixels()
    told = arm_scale([places], moved(places, matrix(aspect=1.03), NOISE))
    assert told.aspect_taken == told.aspect.value
    assert told.aspect_taken == pytest.approx(1.03, abs=3.0 * told.aspect.sigma)
    # With twenty times the noise three per cent are nothing that anybody could see.
    lost = arm_scale([places], moved(places, matrix(aspect=1.03), 15.0 * NOISE))
    assert lost.aspect.within95 > 0.03
    assert lost.aspect_taken == 1.0


def test_a_mirrored_picture_is_refused() -> None:
    places = pixels()
    with pytest.raises(CalibrationRefused, match=r"frames\.flange_from_gel"):
        arm_scale([places * [-1.0, 1.0]], moved(places, matrix()))
