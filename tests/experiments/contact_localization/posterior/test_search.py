"""The whole estimator on exact presses of a small object: it finds them, and hangs on nothing it may not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.baselines import without_images
from experiments.contact_localization.posterior.estimate import SOUND_LEFT_OUT, Estimate, locate
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import Noise, SharedNoise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.posterior.strikes import StrikeEvidence
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest_surface import nearest_point
from harness.basics.geometry import rotation_about, rotation_from_vector, translation
from harness.basics.materials import MATERIALS
from tests.samples import sounding_plate as plate
from tests.samples.synthetic_press import BASE_FROM_OBJECT, PRESSES
from tests.support.localization import dials

QUICK = dials(spacing=3e-3, samples=1000)
UP = np.array([0.0, 0.0, 1.0])
TRUE = np.array([press.point for press in PRESSES])
ALL = np.arange(len(PRESSES))


def located(contacts: tuple[Contact, ...], block: Model, prior: Prior, seed: int = 0) -> Estimate:
    return locate(contacts, block, prior, QUICK, Noise(), seed)[-1]


@pytest.fixture(scope="module")
def found(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Estimate:
    return located(contacts, block, prior)


def true_gel(search: Search) -> FloatArray:
    """The gel's centre at the first contact, in the object's frame."""
    return np.asarray(PRESSES[0].object_from_gel[:3, 3])


def at(gels: FloatArray, yaws: FloatArray) -> Hypotheses:
    """Hypotheses, all of one weight."""
    return Hypotheses(gels, yaws, np.zeros(len(yaws)))


def truth(search: Search) -> Hypotheses:
    """The true one alone."""
    return at(true_gel(search)[None], np.zeros(1))


def test_exact_presses_are_found(found: Estimate) -> None:
    # Contacts tell a place to 0.6 mm each; six of them, and a sample of the draws.
    assert np.linalg.norm(found.position_in_object - TRUE[-1]) < 0.6e-3
    assert np.linalg.norm(found.contacts - TRUE, axis=1).max() < 1.2e-3
    assert found.region.contains(TRUE[-1])
    assert abs(found.yaw) < np.radians(1.5)


def test_strikes_of_an_object_without_modes_leave_touch_as_sure_as_it_is(
    found: Estimate, contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """As a steel cube is, whose lowest mode no microphone hears."""
    sounding = plate.plate_modes()
    places = plate.places(len(contacts), np.random.default_rng(0))
    strikes = plate.strikes(sounding, places, np.random.default_rng(1))
    silent = replace(sounding, frequencies=np.zeros(0), shapes=np.zeros((len(sounding.points), 0, 3)))
    struck = replace(block, modes=silent, material=MATERIALS["steel"])
    both = locate(contacts, struck, prior, QUICK, Noise(), strikes=strikes)[-1]
    np.testing.assert_array_equal(both.position_in_object, found.position_in_object)
    np.testing.assert_array_equal(both.region.inside, found.region.inside)
    assert both.credible90 == found.credible90


def test_strikes_that_fit_no_place_of_the_images_do_not_refuse_what_touch_answers(
    found: Estimate,
    contacts: tuple[Contact, ...],
    block: Model,
    prior: Prior,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Strikes whose likelihood is greatest 30 mm from the contacts, by thousands of nats."""
    wrong = PRESSES[0].object_from_gel[:3, 3] + np.array([0.0, 0.03, 0.0])

    def misleading(*arguments: object, **_: object) -> FloatArray:
        hypotheses = next(one for one in arguments if isinstance(one, Hypotheses))
        return np.asarray(-1.0e5 * np.linalg.norm(hypotheses.gels - wrong, axis=1))

    sounding = plate.plate_modes()
    places = plate.places(len(contacts), np.random.default_rng(0))
    strikes = plate.strikes(sounding, places, np.random.default_rng(1))
    struck = replace(block, modes=sounding, material=MATERIALS["steel"])
    monkeypatch.setattr(StrikeEvidence, "nats", misleading)
    monkeypatch.setattr(StrikeEvidence, "nats_of_draws", misleading)
    both = locate(contacts, struck, prior, QUICK, Noise(), strikes=strikes)[-1]
    np.testing.assert_array_equal(both.position_in_object, found.position_in_object)
    assert both.credible90 == found.credible90
    assert SOUND_LEFT_OUT in both.doubts


def test_the_answer_is_on_the_surface(found: Estimate, block: Model) -> None:
    point = found.position_in_object
    assert nearest_point(block.mesh, point) == pytest.approx(point, abs=1e-9)


def test_no_exact_contact_is_doubted(found: Estimate) -> None:
    for gate in found.gates:
        assert gate.fit is not None
        assert not gate.missed
        assert not gate.slipped
        assert gate.repeats is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_other_seeds_give_the_same_answer_to_the_width_of_the_posterior(
    found: Estimate, contacts: tuple[Contact, ...], block: Model, prior: Prior, seed: int
) -> None:
    other = located(contacts, block, prior, seed)
    assert np.linalg.norm(other.position_in_object - found.position_in_object) < 0.3e-3
    assert other.credible90 == pytest.approx(found.credible90, rel=0.15)


def test_where_the_bench_stands_does_not_matter(
    found: Estimate, contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    by = translation(np.array([1.5, -0.7, 0.3]))
    moved = tuple(replace(c, base_from_gel=by @ c.base_from_gel) for c in contacts)
    again = located(moved, block, prior)
    assert again.position_in_object == pytest.approx(found.position_in_object, abs=1e-9)
    assert again.credible90 == pytest.approx(found.credible90, abs=1e-9)


def test_turning_bench_and_belief_together_does_not_matter(
    found: Estimate, contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    turn = np.eye(4)
    turn[:3, :3] = rotation_about(UP, 0.8)
    turned = tuple(replace(c, base_from_gel=turn @ c.base_from_gel) for c in contacts)
    again = located(turned, block, Prior(turn[:3, :3] @ prior.base_from_object))
    # Rays along an edge may fall on its other side by rounding: a view's pixel may change.
    assert np.linalg.norm(again.position_in_object - found.position_in_object) < 0.2e-3


def test_without_a_yaw_the_object_is_found_turned_as_it_is(
    contacts: tuple[Contact, ...], block: Model
) -> None:
    """The prior says another angle; the answer says by how much it was wrong."""
    wrong = 1.1
    nominal = rotation_about(UP, -wrong) @ BASE_FROM_OBJECT[:3, :3]
    found = locate(contacts, block, Prior(nominal, "unknown"), QUICK, Noise())[-1]
    assert np.linalg.norm(found.position_in_object - TRUE[-1]) < 1e-3
    assert np.angle(np.exp(1j * (found.yaw - wrong))) == pytest.approx(0.0, abs=np.radians(2.0))


def test_a_wrong_yaw_within_its_sigma_is_made_good(contacts: tuple[Contact, ...], block: Model) -> None:
    nominal = rotation_about(UP, np.radians(-1.5)) @ BASE_FROM_OBJECT[:3, :3]
    found = locate(contacts, block, Prior(nominal), QUICK, Noise())[-1]
    assert np.linalg.norm(found.position_in_object - TRUE[-1]) < 1e-3
    assert found.yaw == pytest.approx(np.radians(1.5), abs=np.radians(1.0))


def test_the_true_hypothesis_outweighs_others(search: Search) -> None:
    """Against two thousand around it."""
    rng = np.random.default_rng(0)
    gels = true_gel(search) + rng.normal(size=(2000, 3)) * np.where(np.arange(2000) > 0, 4e-3, 0.0)[:, None]
    yaws = rng.normal(size=2000) * np.where(np.arange(2000) > 0, np.radians(1.5), 0.0)
    weights = search.weigh(at(gels, yaws), ALL, 1, 2).log_weights
    # Within half a millimetre others may fit as well.
    far = np.linalg.norm(gels - true_gel(search), axis=1) > 1.5e-3
    assert weights[0] > weights[far].max()


def test_translations_carry_the_gel_from_contact_to_contact(search: Search) -> None:
    for k, press in enumerate(PRESSES):
        assert search.gel_centres(k, truth(search))[0] == pytest.approx(
            press.object_from_gel[:3, 3], abs=1e-12
        )


def test_named_errors_put_contacts_where_a_crooked_bench_has_them(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """A tilted, larger object and a gel off its place, told in sigmas, are the true places again."""
    noise, shared = SharedNoise(), np.array([[0.7, -0.4, 1.1, 0.5, -0.8, 0.3]])
    tilt = rotation_from_vector(np.array([*noise.tilt * shared[0, :2], 0.0]))
    size, off = 1.0 + noise.scale * shared[0, 2], noise.gel_centre * shared[0, 3:]

    def reported(contact: Contact) -> Contact:
        """The pose that the arm reports where the true one, of the crooked object, is ``contact``'s."""
        pose = contact.base_from_gel.copy()
        pose[:3, 3] = tilt.T @ (pose[:3, 3] - contacts[0].base_from_gel[:3, 3]) / size - pose[:3, :3] @ off
        return replace(contact, base_from_gel=pose)

    crooked = Search([reported(c) for c in contacts], block, prior, 3e-3, Noise())
    true = np.array([press.object_from_gel[:3, 3] for press in PRESSES])
    told, plain = (
        np.vstack([crooked.gel_centres(k, replace(truth(crooked), shared=named)) for k in range(len(true))])
        for named in (shared, None)
    )
    off_told, off_plain = (
        places - places.mean(axis=0) - true + true.mean(axis=0) for places in (told, plain)
    )
    # First order in half a degree and half a percent, over a block of 60 mm.
    assert np.linalg.norm(off_told, axis=1).max() < 10e-6
    assert np.linalg.norm(off_plain, axis=1).max() > 0.3e-3


def test_errors_of_size_zero_are_none(search: Search) -> None:
    unnamed = truth(search)
    named = replace(unnamed, shared=np.zeros((1, 6)))
    for k in range(len(PRESSES)):
        np.testing.assert_array_equal(search.gel_centres(k, named), search.gel_centres(k, unnamed))


def test_the_contact_is_where_the_tools_line_first_meets_the_object(search: Search) -> None:
    for k, press in enumerate(PRESSES):
        point = search.surface_points(k, truth(search))[0]
        # To a pixel of the view, half a millimetre; on a slope that much again in depth.
        assert np.linalg.norm(point - press.point) < 0.5e-3


def test_a_line_that_misses_the_object_ends_on_the_surface_all_the_same(search: Search) -> None:
    away = at(true_gel(search)[None] + np.array([0.2, 0.0, 0.0]), np.zeros(1))
    point = search.surface_points(0, away)[0]
    assert np.linalg.norm(search.surface.points - point, axis=1).min() < 1e-12


def test_the_grid_starts_everywhere_the_tool_may_have_stood(search: Search) -> None:
    """The truth is not given up before the images are looked at."""
    for anchor in (0, 3, 5):
        grid = search.grid(ALL, anchor)
        assert grid.log_weights.max() == 0.0
        gaps = np.linalg.norm(grid.gels - true_gel(search), axis=1)
        assert gaps.min() < 1.5 * search.surface.spacing


def test_weights_of_hypotheses_do_not_hang_on_their_company(search: Search) -> None:
    rng = np.random.default_rng(1)
    gels, yaws = true_gel(search) + rng.normal(size=(60, 3)) * 2e-3, rng.normal(size=60) * 0.02
    whole = search.weigh(at(gels, yaws), ALL, 2, 2).log_weights
    for half in (slice(30), slice(30, 60)):
        alone = search.weigh(at(gels[half], yaws[half]), ALL, 2, 2).log_weights
        assert alone == pytest.approx(whole[half] - whole[half].max(), abs=1e-9)


def test_hypotheses_that_fall_behind_are_dropped_and_no_other_is_weighed_anew(search: Search) -> None:
    """Dropped as contacts come in, so a few that were to recover may be missing; none that leads."""
    rng = np.random.default_rng(3)
    gels, yaws = true_gel(search) + rng.normal(size=(400, 3)) * 3e-3, rng.normal(size=400) * 0.02
    whole, few = (search.weigh(at(gels, yaws), ALL, 2, 2, within) for within in (np.inf, 18.0))
    leading = whole.best(6.0, 400)
    assert len(leading.yaws) <= len(few.yaws) < len(whole.yaws)
    assert set(leading.yaws) <= set(few.yaws)
    order = dict(zip(whole.yaws, whole.log_weights, strict=True))
    assert few.log_weights == pytest.approx([order[yaw] for yaw in few.yaws], abs=1e-9)


def test_repeating_a_press_makes_no_one_surer(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """Five times the same press is one witness heard five times; only the arm's own error averages out."""
    once = located(contacts[:3], block, prior)
    often = located((*contacts[:2], *[contacts[2]] * 5), block, prior)
    assert often.credible90 > 0.8 * once.credible90
    assert [gate.repeats for gate in often.gates] == [None, None, None, 2, 2, 2, 2]


def test_a_contact_without_image_changes_no_weight(
    contacts: tuple[Contact, ...], block: Model, prior: Prior, found: Estimate
) -> None:
    """Missing is not a match: the arm's place of a missed contact is not used either."""
    missed = Contact(contacts[1].base_from_gel)
    without = (contacts[0], *contacts[2:])
    one = locate((contacts[0], missed, *contacts[2:]), block, prior, QUICK, Noise())[-1]
    other = locate(without, block, prior, QUICK, Noise())[-1]
    assert one.position_in_object == pytest.approx(other.position_in_object, abs=1e-9)
    assert one.gates[1].missed


def test_geometry_alone_recovers_exact_places(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """Six exact places on five faces leave a rigid object no room, but for samples and presses' depths."""
    poses = [c.base_from_gel for c in contacts]
    for use_axis in (False, True):
        answer = without_images(poses, block, prior, 2e-3, use_axis)
        assert np.linalg.norm(answer - TRUE[-1]) < 2.5e-3
        assert nearest_point(block.mesh, answer) == pytest.approx(answer, abs=1e-9)


def test_geometry_alone_does_not_know_a_single_contact(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """One place says nothing: the answer is the same wherever the arm stood."""
    here = contacts[-1].base_from_gel
    there = translation(np.array([0.1, 0.0, 0.0])) @ here
    one, other = (without_images([pose], block, prior, 3e-3) for pose in (here, there))
    np.testing.assert_array_equal(one, other)


def test_hypotheses_of_one_contact_are_where_its_gel_was_pressed_in(search: Search) -> None:
    here = truth(search)
    for k, press in enumerate(PRESSES):
        place = search.contact_places(k, here)[0]
        # The image's own depth at the centre is a little less than the press over edges.
        assert np.linalg.norm(place - press.point) < 0.4e-3


def test_a_models_stated_error_keeps_the_truth_in_the_running(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """Unstated, every contact costs all that it may, at the truth as anywhere else."""
    rms = 0.3e-3

    def bumpy(view_from_object: FloatArray, pitch: float, rows: int, columns: int) -> FloatArray:
        bumps = gaussian_filter(np.random.default_rng(0).normal(size=(rows, columns)), 3.0)
        depth = block.first_surface(view_from_object, pitch, rows, columns)
        return np.asarray(depth + rms * bumps / bumps.std())

    off, far = replace(block, seen=bumpy), np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]])
    fits, ahead = [], []
    for model in (off, replace(off, seen_rms=rms)):
        # A search keeps the scores of its views: each of both fills in its own.
        gating, weighing = (Search(contacts, model, prior, 3e-3, Noise()) for _ in range(2))
        fits.append(gating.gates(truth(gating), ALL))
        pair = at(true_gel(weighing) + far, np.zeros(2))
        ahead.append(float(np.subtract(*weighing.weigh(pair, ALL, 1, 2).log_weights)))
    assert np.all(fits[1] > fits[0])
    assert ahead[1] > ahead[0] + len(ALL)
