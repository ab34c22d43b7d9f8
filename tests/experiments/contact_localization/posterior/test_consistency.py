"""Who is refused and who is flagged: laws of the gates over the contacts' fits."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.consistency import (
    gates,
    likeness_of,
    refuse_bad_fit,
    refuse_inside_out,
)
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import SAME_AXIS, SAME_PLACE, Noise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import frame_facing, transform
from harness.basics.mesh import Mesh
from tests.samples.synthetic_press import PRESSES, box

GOOD, BAD = -2.0, -60.0
DOWN = np.array([0.0, 0.0, -1.0])


def searched(block: Model, prior: Prior, places: FloatArray, axes: FloatArray | None = None) -> Search:
    """Contacts of which only the poses matter."""
    axes = np.tile(DOWN, (len(places), 1)) if axes is None else axes
    contacts = [Contact(transform(frame_facing(a, 0.0), p)) for a, p in zip(axes, places, strict=True)]
    return Search(contacts, block, prior, 4e-3, Noise())


@pytest.fixture(scope="module")
def six(block: Model, prior: Prior) -> Search:
    """Far from each other."""
    return searched(block, prior, 0.02 * np.arange(18.0).reshape(6, 3))


def refused(search: Search, fits: list[float]) -> bool:
    try:
        refuse_bad_fit(search, np.arange(len(fits)), np.array(fits))
    except FitRefused:
        return True
    return False


def test_good_fits_pass_and_bad_ones_do_not(six: Search) -> None:
    for count in range(1, 7):
        assert not refused(six, [GOOD] * count)
        assert refused(six, [BAD] * count)


@pytest.mark.parametrize(
    "count",
    [
        4,
        5,
        6,
    ],
)
def test_one_bad_contact_is_no_reason_to_refuse(six: Search, count: int) -> None:
    for k in range(count):
        fits = [GOOD] * count
        fits[k] = -np.inf
        assert not refused(six, fits)


@pytest.mark.parametrize("count", [4, 5, 6])
def test_a_majority_of_bad_contacts_is(six: Search, count: int) -> None:
    bad = count // 2 + 1
    assert refused(six, [BAD] * bad + [GOOD] * (count - bad))


@given(fits=st.lists(st.floats(-80.0, 0.0), min_size=1, max_size=6))
@settings(max_examples=100, deadline=None)
def test_what_is_refused_is_what_is_not_clear_of_it(six: Search, fits: list[float]) -> None:
    likeness = likeness_of(six, np.arange(len(fits)), np.array(fits))
    assert refused(six, fits) is (likeness.margin < 0.0)


def test_a_compromise_is_clearer_than_four_good_contacts_and_two_impossible_ones(six: Search) -> None:
    """By the median alone the second would be taken, and refused for its quartile."""
    everyone = np.arange(6)
    compromise = likeness_of(six, everyone, np.array([-4.5, -1.2, -7.9, -8.9, -3.7, -4.3]))
    torn = likeness_of(six, everyone, np.array([-1.6, -1.7, -28.2, -28.4, -3.0, -0.6]))
    assert torn.typical > compromise.typical
    assert compromise.margin > 0.0 > torn.margin


@given(fits=st.lists(st.floats(-80.0, 0.0), min_size=1, max_size=6), worse=st.integers(0, 5))
@settings(max_examples=100, deadline=None)
def test_a_worse_fit_never_saves_a_run(six: Search, fits: list[float], worse: int) -> None:
    lower = list(fits)
    lower[worse % len(fits)] -= 30.0
    assert refused(six, lower) or not refused(six, fits)


@given(fits=st.lists(st.floats(-80.0, 0.0), min_size=1, max_size=6), seed=st.integers(0, 10))
@settings(max_examples=60, deadline=None)
def test_the_order_of_the_contacts_does_not_matter(six: Search, fits: list[float], seed: int) -> None:
    order = np.random.default_rng(seed).permutation(len(fits))
    assert refused(six, fits) == refused(six, [fits[k] for k in order])


@pytest.mark.parametrize("bad", [3, 6])
def test_a_contact_that_fits_nowhere_is_counted_and_not_passed_on_as_no_number(six: Search, bad: int) -> None:
    """Quantiles between two infinities are no numbers, and no number is below a limit."""
    with pytest.raises(FitRefused, match=r"-1000\.0 "):
        refuse_bad_fit(six, np.arange(6), np.array([-np.inf] * bad + [BAD] * (6 - bad)))


def test_the_refusal_names_the_worst_contact_as_an_operator_counts(six: Search) -> None:
    members = np.array([0, 2, 3, 5])
    with pytest.raises(FitRefused, match=r"contact 4 .*-90\.0"):
        refuse_bad_fit(six, members, np.array([BAD, BAD, -90.0, BAD]))


def test_a_run_without_a_touch_is_refused_with_what_to_do(six: Search) -> None:
    with pytest.raises(FitRefused, match="background"):
        refuse_bad_fit(six, np.empty(0, np.int64), np.empty(0))


def test_a_press_repeated_is_one_witness(block: Model, prior: Prior) -> None:
    """Three bad presses at one place among four good ones are one of five; apart they are three of seven."""
    apart = 0.02 * np.arange(21.0).reshape(7, 3)
    together = apart.copy()
    together[5:] = together[4]
    fits = [GOOD] * 4 + [BAD] * 3
    assert not refused(searched(block, prior, together), fits)
    assert refused(searched(block, prior, apart), fits)


def flagged(search: Search, fits: dict[int, float], count: int) -> list[tuple[bool, bool, int | None]]:
    found = gates(search, count, np.array(list(fits), np.int64), np.array(list(fits.values())))
    return [(gate.missed, gate.slipped, gate.repeats) for gate in found]


def test_each_contact_is_flagged_for_what_it_did(six: Search) -> None:
    found = flagged(six, {0: GOOD, 1: -np.inf, 3: BAD, 4: GOOD}, 5)
    assert [missed for missed, _, _ in found] == [False, False, True, False, False]
    assert [slipped for _, slipped, _ in found] == [False, True, False, True, False]
    assert [repeats for _, _, repeats in found] == [None] * 5


def test_a_repeat_is_the_same_place_and_the_same_attitude(block: Model, prior: Prior) -> None:
    near, far = 0.9 * SAME_PLACE, 1.1 * SAME_PLACE
    places = np.array([[0.0, 0.0, 0.0], [near, 0.0, 0.0], [0.0, far, 0.0], [0.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
    axes = np.tile(DOWN, (5, 1))
    axes[3] = [np.sin(1.1 * SAME_AXIS), 0.0, -np.cos(1.1 * SAME_AXIS)]
    found = flagged(searched(block, prior, places, axes), dict.fromkeys(range(5), GOOD), 5)
    assert [repeats for _, _, repeats in found] == [None, 0, None, None, None]


def test_an_object_inside_out_is_refused_and_one_that_is_not_is_not(
    search: Search, block: Model, contacts: tuple[Contact, ...], prior: Prior
) -> None:
    truth = Hypotheses(PRESSES[0].object_from_gel[None, :3, 3], np.zeros(1), np.zeros(1))
    members = np.arange(len(PRESSES))
    refuse_inside_out(search, truth, members)
    inverted = Model(Mesh(block.mesh.vertices, block.mesh.faces[:, ::-1]), block.sensor, block.calibration)
    with pytest.raises(FitRefused, match=r"contact \d.* 0 degrees.* 90 "):
        refuse_inside_out(Search(contacts, inverted, prior, 3e-3, Noise()), truth, members)


def test_a_contact_of_two_that_seems_to_be_from_inside_is_no_object_inside_out(
    block: Model, contacts: tuple[Contact, ...], prior: Prior
) -> None:
    """Of a mesh whose faces to the top alone are turned: one contact is on them, the other on a side."""
    up = block.mesh.face_normals[:, 2] > 0.5
    faces = np.where(up[:, None], block.mesh.faces[:, ::-1], block.mesh.faces)
    partly = Model(Mesh(block.mesh.vertices, faces), block.sensor, block.calibration)
    search = Search(contacts, partly, prior, 3e-3, Noise())
    truth = Hypotheses(PRESSES[0].object_from_gel[None, :3, 3], np.zeros(1), np.zeros(1))
    refuse_inside_out(search, truth, np.array([1, 2]))
    with pytest.raises(FitRefused, match=r"contact \d.* 0 degrees.* 90 "):
        refuse_inside_out(search, truth, np.array([1]))


def test_a_lone_contact_beside_a_thin_wall_does_not_say_that_the_object_is_inside_out(
    block: Model, prior: Prior
) -> None:
    """Which of a wall's two faces the nearest sample is of, one contact cannot tell."""
    one = np.array([0])
    for thickness, walled in ((2e-3, True), (2e-2, False)):
        plate = box(0.05, 0.05, thickness)
        turned = Model(Mesh(plate.vertices, plate.faces[:, ::-1]), block.sensor, block.calibration)
        search = searched(turned, prior, np.zeros((1, 3)))
        top = Hypotheses(np.array([[0.0, 0.0, 0.5 * thickness]]), np.zeros(1), np.zeros(1))
        if walled:
            refuse_inside_out(search, top, one)
        else:
            with pytest.raises(FitRefused, match=r"contact \d.* 0 degrees.* 90 "):
                refuse_inside_out(search, top, one)
