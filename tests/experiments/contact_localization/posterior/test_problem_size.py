"""What there is to do is counted from the arm's poses alone."""

import numpy as np
import pytest

from experiments.contact_localization.accuracy.run import places_left
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.touch.touch import Contact
from harness.recording.observation import Observation

NO_IMAGE = np.zeros((1, 4, 4, 3), dtype=np.uint8)


@pytest.fixture(scope="module")
def observations(contacts: tuple[Contact, ...]) -> tuple[Observation, ...]:
    return tuple(Observation(contact.base_from_gel, NO_IMAGE) for contact in contacts)


def test_contacts_on_several_faces_leave_fewer_places(
    observations: tuple[Observation, ...], block: Model, prior: Prior
) -> None:
    assert 1.0 <= places_left(observations, block, prior) < places_left(observations[:1], block, prior)


def test_an_unknown_yaw_leaves_more(
    observations: tuple[Observation, ...], block: Model, prior: Prior
) -> None:
    unknown = Prior(prior.base_from_object, "unknown")
    assert places_left(observations[:1], block, unknown) > places_left(observations[:1], block, prior)


def test_where_the_bench_stands_does_not_matter(
    observations: tuple[Observation, ...], block: Model, prior: Prior
) -> None:
    elsewhere = np.eye(4)
    elsewhere[:3, 3] = [0.3, -1.0, 0.2]
    moved = [Observation(elsewhere @ one.base_from_gel, NO_IMAGE) for one in observations]
    assert places_left(moved, block, prior) == places_left(observations, block, prior)


def test_an_object_that_was_not_there_leaves_one_all_the_same(block: Model, prior: Prior) -> None:
    """The seconds of an answer that will be refused are to be foreseen too."""
    apart = [np.eye(4), np.eye(4)]
    apart[1][:3, 3] = 5.0
    assert places_left([Observation(pose, NO_IMAGE) for pose in apart], block, prior) >= 1.0
