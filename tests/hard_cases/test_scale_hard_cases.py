"""Readings that do not tell a size: a refusal with its reason, or an interval as wide as what is known."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.scale_estimation.size import Belief, SizeRange, fused
from experiments.scale_estimation.sound.hearing import Hearing, MaterialGuess, by_sound
from experiments.scale_estimation.sound.peaks import RingingModel
from experiments.scale_estimation.touch.fit import POINTS, Patch
from experiments.scale_estimation.touch.touch import DOUBTED, by_touch
from experiments.scale_estimation.vision.vision import by_sight, stands_seen
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.materials import MATERIALS
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import read_outline
from tests.experiments.scale_estimation.test_sound import BAND, DECAY, NOMINAL, model, of, peaks_at
from tests.experiments.scale_estimation.test_touch import PLACE, contacts, stand_of
from tests.experiments.scale_estimation.test_vision import mask_at, nominal, outline_at, view_of

RANGE = SizeRange(0.05, 0.45)
DRAWN = SizeRange(0.5 * NOMINAL, 2.0 * NOMINAL)


def width(belief: Belief) -> float:
    """Of the interval, in the logarithm."""
    low, high = belief.interval
    return float(np.log(high / low))


# Another object than the model's.


@pytest.mark.parametrize(
    ("known", "shown"), [("mug", "bowl"), ("bowl", "tray"), ("wrench", "plate"), ("pitcher", "mug")]
)
def test_the_outline_of_another_object_is_refused_with_its_misfit(known: str, shown: str) -> None:
    view = view_of(known)
    with pytest.raises(FitRefused, match=r" px.*0\.9 px"):
        by_sight(view, outline_at(view_of(shown), 1.1, yaw=0.5), nominal(view), RANGE)


def test_an_outline_that_fits_only_far_from_what_is_stated_is_refused_with_what_that_is() -> None:
    """A wrench that stood far aside, and tilted, would have the outline of a pitcher."""
    view, shown = view_of("wrench", CameraErrors(place=0.02)), view_of("pitcher")
    with pytest.raises(FitRefused, match=r"along x .*\d+ standard deviations"):
        by_sight(view, outline_at(shown, 0.8, 0.01, -0.01, 0.1), nominal(view), RANGE)


def another(seed: int) -> tuple[RingingModel, float]:
    """An object of other modes, and its size over the model's."""
    random = np.random.default_rng(seed)
    frequencies = np.sort(random.uniform(900.0, 18000.0, 30))
    return RingingModel(frequencies, np.full(30, 0.05), MATERIALS["ceramic"]), random.uniform(0.6, 1.6)


def heard_as_the_model(thing: RingingModel, scale: float) -> Hearing | None:
    heard = thing.frequencies / scale
    inside = (heard > BAND[0]) & (heard < BAND[1])
    levels = thing.levels(np.array([np.log(scale)]), DECAY)[0]
    try:
        return by_sound(of(heard[inside], levels[inside]), [MaterialGuess(model(), 0.03)], NOMINAL, RANGE)
    except FitRefused:
        return None


def test_peaks_of_another_object_are_mostly_refused_and_silence_no_right_sense() -> None:
    """No gate between objects is safe by sound: a wrong answer that passes must leave the truth open."""
    answered = 0
    for seed in range(24):
        thing, scale = another(seed)
        found = heard_as_the_model(thing, scale)
        if found is None:
            continue
        answered += 1
        true = scale * NOMINAL
        sight = Belief.of(RANGE, -0.5 * ((RANGE.logs - np.log(true)) / 0.015) ** 2)
        low, high = fused([sight, found.belief]).interval
        assert low <= true <= high
    assert answered <= 12


def test_two_senses_that_contradict_each_other_leave_both_sizes_open() -> None:
    for wrong in (0.07, 0.3):
        one, other = (
            Belief.of(RANGE, -0.5 * ((RANGE.logs - np.log(size)) / sigma) ** 2)
            for size, sigma in ((0.15, 0.01), (wrong, 0.04))
        )
        low, high = fused([one, other]).interval
        assert low <= min(0.15, wrong)
        assert high >= max(0.15, wrong)


@pytest.mark.parametrize(
    ("known", "touched"), [("mug", "plate"), pytest.param("pitcher", "mug", marks=pytest.mark.slow)]
)
def test_contacts_on_another_object_are_refused_or_leave_the_size_open(known: str, touched: str) -> None:
    stand, size = stand_of(known)
    try:
        found = by_touch(stand, contacts(touched, 1.0, 10), size, RANGE)
    except FitRefused:
        return
    assert found.cost > DOUBTED
    assert width(found.belief) > 0.5 * width(Belief.ignorant(RANGE))


def test_contacts_that_fit_worse_than_the_right_object_s_leave_the_size_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stand, size = stand_of("mug")
    sure = by_touch(stand, contacts("mug", 1.0, 10), size, RANGE)
    monkeypatch.setattr("experiments.scale_estimation.touch.touch.DOUBTED", 0.5 * sure.cost)
    doubted = by_touch(stand, contacts("mug", 1.0, 10), size, RANGE)
    ignorant = width(Belief.ignorant(RANGE))
    assert width(sure.belief) < 0.1 * ignorant
    assert width(doubted.belief) > 0.5 * ignorant


# What is seen, or where the camera is.


@pytest.mark.parametrize("name", ["mug", "bowl"])
@pytest.mark.parametrize("scale", [0.6, 1.6])
def test_an_outline_behind_something_is_a_lower_bound_there(name: str, scale: float) -> None:
    """As an arm would, a bar hides the right quarter: taken for whole, the object is smaller, or refused."""
    view, mask = view_of(name), mask_at(name, scale)
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    bar = np.zeros_like(mask)
    bar[rows[0] - 5 : rows[-1] + 6, round(0.25 * columns[0] + 0.75 * columns[-1]) :] = True
    true = scale * nominal(view)
    found = by_sight(view, read_outline(mask & ~bar, bar), nominal(view), RANGE).belief
    low, high = found.interval
    assert low < true < high
    assert found.size == pytest.approx(true, rel=0.03)
    try:
        wrong = by_sight(view, read_outline(mask & ~bar), nominal(view), RANGE).belief
    except FitRefused:
        return
    assert wrong.interval[1] < true


@pytest.mark.parametrize("name", ["bowl", "plate"])
def test_a_round_object_has_a_size_and_any_turn(name: str) -> None:
    view = view_of(name)
    true = 1.2 * nominal(view)
    for yaw in (0.0, 2.5):
        found = by_sight(view, outline_at(view, 1.2, yaw=yaw), nominal(view), RANGE)
        assert found.belief.size == pytest.approx(true, rel=2e-3)
    turns = [stand.unknowns[3] for stand in stands_seen(view, outline_at(view, 1.2))]
    assert len(turns) >= 12  # none of them is ruled out


@pytest.mark.parametrize("unknown", [{"position": 10.0}, {"support": 10.0, "place": 10.0}])
def test_a_picture_from_nobody_knows_how_far_leaves_nearly_the_whole_range(unknown: dict[str, float]) -> None:
    view = view_of("mug", CameraErrors(**unknown))
    found = by_sight(view, outline_at(view, 1.2), nominal(view), RANGE)
    assert width(found.belief) > 0.75 * width(Belief.ignorant(RANGE))


# Contacts of one side only.


def one_face(scale: float, seed: int) -> tuple[list[Patch], float]:
    """Six contacts within 20 mm of a mug's wall (of the nominal mug), all on one side of it."""
    stand, size = stand_of("mug")
    side = (stand.normals[:, 0] > 0.9) & (stand.points[:, 2] > 0.03) & (stand.points[:, 2] < 0.05)
    random, patches = np.random.default_rng(seed), []
    for index in random.choice(np.flatnonzero(side), 6, replace=False):
        near = np.argsort(np.linalg.norm(stand.points - stand.points[index], axis=1))[:POINTS]
        off: FloatArray = 0.5e-3 * random.standard_normal(3)
        patches.append(Patch(scale * stand.points[near] + PLACE + off, stand.normals[index]))
    return patches, scale * size


@pytest.mark.parametrize(
    ("scale", "seed"),
    [(1.93, 1), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in ((0.5, 2), (1.01, 3), (1.93, 4)))],
)
def test_contacts_on_one_face_hold_the_size(scale: float, seed: int) -> None:
    stand, size = stand_of("mug")
    patches, true = one_face(scale, seed)
    low, high = by_touch(stand, patches, size, SizeRange(0.5 * size, 2.0 * size)).belief.interval
    assert low <= true <= high


def test_a_gel_that_met_nothing_is_no_answer() -> None:
    stand, size = stand_of("mug")
    with pytest.raises(FitRefused, match="gel"):
        by_touch(stand, [], size, RANGE)


# Too little sound, or of a size that nobody asked about.


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_peaks_are_refused(count: int) -> None:
    peaks = peaks_at(1.0)
    few = replace(
        peaks,
        frequencies=peaks.frequencies[:count],
        levels=peaks.levels[:count],
        decays=peaks.decays[:count],
    )
    with pytest.raises(FitRefused, match=f"{count} peaks?.* 3 "):
        by_sound(few, [MaterialGuess(model(), 0.03)], NOMINAL, RANGE)


def test_the_sound_of_a_larger_object_than_was_asked_about_is_named() -> None:
    """In a search within the range alone a wrong size inside it would win."""
    peaks = peaks_at(2.6, every=1, noise=0.005)
    found = by_sound(peaks, [MaterialGuess(model(), 0.03)], NOMINAL, DRAWN)
    assert found.belief.outside > 0.5
    assert found.belief.likeliest == pytest.approx(2.6 * NOMINAL, rel=0.02)


def test_the_sound_of_a_smaller_object_than_was_asked_about_has_few_modes_and_is_named() -> None:
    """Another size is less likely than a fifth: the one beyond the range is said to be beyond it."""
    found = by_sound(peaks_at(0.35, every=1, noise=0.005), [MaterialGuess(model(), 0.03)], NOMINAL, DRAWN)
    assert found.belief.outside > 0.5
    assert found.belief.likeliest == pytest.approx(0.35 * NOMINAL, rel=0.02)
