"""The paper's filter: on the surface, carried by the arm's translations, and blind to the bench."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import CANDIDATES, Particles, particle_filter
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.basics.geometry import translation
from tests.samples.synthetic_press import PRESSES

TRUE = np.array([press.point for press in PRESSES])
COUNT = len(PRESSES)


@pytest.fixture(scope="module")
def found(search: Search) -> Particles:
    return particle_filter(search, COUNT, 3000, seed=0)


def untouched(search: Search, contacts: tuple[Contact, ...]) -> Search:
    bare = [Contact(c.base_from_gel) for c in contacts]
    return Search(bare, search.model, search.prior, search.surface.spacing, search.noise)


def test_particles_lie_on_the_surface(found: Particles, search: Search) -> None:
    assert found.points.shape == (3000, 3)
    assert np.max(search.surface.tree.query(found.points)[0]) == 0.0


def test_before_any_image_particles_are_even_over_the_area(
    search: Search, contacts: tuple[Contact, ...]
) -> None:
    start = particle_filter(untouched(search, contacts), 1, 20_000, seed=1)
    assert start.weights == pytest.approx(1.0 / 20_000)
    counts = np.bincount(search.surface.tree.query(start.points)[1], minlength=len(search.surface.points))
    expected = 20_000 * search.surface.areas / search.surface.areas.sum()
    # Poisson: the standardised counts vary by 1.
    assert np.std((counts - expected) / np.sqrt(expected)) == pytest.approx(1.0, abs=0.1)


def test_without_images_particles_only_move(search: Search, contacts: tuple[Contact, ...]) -> None:
    """Each goes by the arm's translation and is put back on the nearest sample; none is lost."""
    bare = untouched(search, contacts)
    first, second = (particle_filter(bare, count, 500, seed=2) for count in (1, 2))
    moved = first.points + search.prior.object_from_base(np.zeros(1))[0] @ search.positions[1]
    nearest = search.surface.tree.query(moved)[1]
    np.testing.assert_array_equal(second.points, search.surface.points[nearest])


def test_the_last_of_several_exact_contacts_is_among_the_likely(found: Particles) -> None:
    gaps = np.linalg.norm(found.points - TRUE[-1], axis=1)
    assert found.weights[gaps < 8e-3].sum() > 0.5
    assert np.linalg.norm(found.candidates().mean(axis=0) - TRUE[-1]) < 8e-3


def test_the_candidates_are_the_ten_heaviest(found: Particles) -> None:
    assert found.candidates().shape == (CANDIDATES, 3)
    order = np.sort(found.log_weights)[::-1]
    first = found.points[np.argmax(found.log_weights)]
    assert np.all(found.candidates()[0] == first)
    assert found.log_weights.max() == 0.0
    assert order[CANDIDATES - 1] >= order[CANDIDATES]
    assert found.weights.sum() == pytest.approx(1.0)


def test_a_seed_gives_the_same_particles(search: Search) -> None:
    one, same, other = (particle_filter(search, COUNT, 300, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.points, same.points)
    np.testing.assert_array_equal(one.log_weights, same.log_weights)
    assert not np.array_equal(one.points, other.points)


def test_where_the_bench_stands_does_not_matter(
    found: Particles, contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    by = translation(np.array([0.5, 0.25, -0.125]))
    moved = [replace(c, base_from_gel=by @ c.base_from_gel) for c in contacts]
    again = particle_filter(Search(moved, block, prior, 3e-3, Noise()), COUNT, 3000, seed=0)
    same = np.all(again.points == found.points, axis=1)
    # Rounding decides between two samples as near as each other, for hardly a particle.
    assert same.mean() > 0.97


def test_a_hotter_filter_is_less_sure(search: Search, monkeypatch: pytest.MonkeyPatch) -> None:
    """``exp(cosine / temperature)``: with temperature 1 it hardly converges, as one contact shows."""
    cool = particle_filter(search, 1, 1000, seed=5)
    monkeypatch.setattr("experiments.contact_localization.posterior.estimate.TEMPERATURE", 1.0)
    hot = particle_filter(search, 1, 1000, seed=5)
    np.testing.assert_array_equal(cool.points, hot.points)
    assert cool.log_weights == pytest.approx(20.0 * hot.log_weights, abs=1e-9)
    assert np.sum(cool.weights**2) > np.sum(hot.weights**2)


def test_an_unknown_yaw_is_drawn_from_the_whole_turn(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    anyhow = Search(contacts, block, Prior(prior.base_from_object, "unknown"), 3e-3, Noise())
    start = particle_filter(anyhow, 1, 3600, seed=0)
    counts = np.bincount(np.round(np.degrees(start.yaws) / 10.0).astype(np.int64) % 36, minlength=36)
    assert counts.min() > 60
    assert counts.sum() == 3600
