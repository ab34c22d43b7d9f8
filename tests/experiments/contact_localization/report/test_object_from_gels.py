"""Where the report puts a gel: as deep behind its estimated contact as its own picture says."""

import numpy as np
import pytest

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import locate
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.report.report import object_from_gels
from experiments.contact_localization.touch.touch import Contact
from harness.recording.observation import Observation
from harness.sim.optics.inverse import GelReading
from tests.samples.synthetic_press import PRESSES
from tests.support.localization import dials


def test_a_gel_is_put_as_deep_behind_its_contact_as_its_image_says(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    last = locate(contacts, block, prior, dials(spacing=3e-3, rounds=1, samples=600), Noise())[-1]
    images = np.zeros((1, 120, 160, 3), np.uint8)
    observations = tuple(Observation(contact.base_from_gel, images) for contact in contacts)
    maps = [np.full((120, 160), 1e-4 * (k + 1)) for k in range(len(PRESSES))]
    gels = tuple(GelReading(heights, np.zeros_like(heights), "", (0.0, 0.0)) for heights in maps)
    placed = object_from_gels(Answer(Readings(observations, gels, block, prior, 0), last, 0.1))
    for k, pose in enumerate(placed):
        assert pose[:3, 3] == pytest.approx(last.contacts[k] + 1e-4 * (k + 1) * pose[:3, 2], abs=1e-12)
        turned = prior.object_from_base(np.array([last.yaw]))[0]
        assert pose[:3, :3] == pytest.approx(turned @ observations[k].base_from_gel[:3, :3], abs=1e-12)
