"""A contact alone is answered where it fits, however finely one asks and whatever the draws."""

import numpy as np
import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import locate
from experiments.contact_localization.posterior.grid import on_samples, refine
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import frame_facing, transform
from tests.samples.synthetic_press import PRESSES
from tests.support.localization import dials

ALONE = np.array([0])
HOPELESS = -20.0
"""Nats at which a place explains nothing."""

LEVELS = {
    "quick": dials(spacing=4e-3, rounds=1, samples=600),
    "finest": dials(spacing=1.5e-3, rounds=5, samples=6000),
}


def refined(one: Contact, block: Model, prior: Prior, seed: int) -> tuple[Search, Hypotheses]:
    search = Search((one,), block, prior, 2e-3, Noise())
    return search, refine(search, on_samples(search, ALONE, 0), ALONE, 3000, 5, seed)


def fits(search: Search, at: Hypotheses, chosen: IntArray) -> FloatArray:
    each = (at.taken(np.array([index]), np.zeros(1)) for index in chosen)
    return np.array([search.gates(one, ALONE)[0] for one in each])


@pytest.mark.parametrize("level", LEVELS)
def test_no_contact_of_the_right_object_is_refused_alone(
    contacts: tuple[Contact, ...], block: Model, prior: Prior, level: str
) -> None:
    for press, one in zip(PRESSES, contacts, strict=True):
        for seed in range(2):
            found = locate((one,), block, prior, LEVELS[level], Noise(), seed)[-1]
            assert found.gates[0].fit is not None
            assert found.gates[0].fit > HOPELESS / 2
            assert found.region.contains(np.array(press.point))


@pytest.mark.parametrize("press", [0, 5])
def test_places_that_explain_nothing_carry_no_weight(
    contacts: tuple[Contact, ...], block: Model, prior: Prior, press: int
) -> None:
    """An outlier that fits every place alike would put the answer of a peg or a corner anywhere."""
    search, found = refined(contacts[press], block, prior, seed=3)
    heavy = np.argsort(-found.log_weights)[:200]
    assert (fits(search, found, heavy) > HOPELESS).all()


def test_a_contact_that_fits_nowhere_has_weights_that_are_numbers(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    """Pressed from below, where nothing is like a peg."""
    peg, up = contacts[0], frame_facing(np.array([0.0, 0.0, 1.0]), 0.0)
    below = Contact(transform(up, peg.base_from_gel[:3, 3]), peg.touch, peg.coarse)
    _, found = refined(below, block, prior, seed=0)
    assert np.isfinite(found.log_weights).all()
    assert found.weights.sum() == pytest.approx(1.0)
