"""Exact presses on a stepped block, and what an estimator would know of them."""

import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples.synthetic_press import BASE_FROM_OBJECT, PRESSES, contact, stepped_block


@pytest.fixture(scope="session")
def block() -> Model:
    return Model(stepped_block(), GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"))


@pytest.fixture(scope="session")
def prior() -> Prior:
    return Prior(BASE_FROM_OBJECT[:3, :3])


@pytest.fixture(scope="session")
def contacts(block: Model) -> tuple[Contact, ...]:
    """Six, on five faces."""
    return tuple(contact(block.raster, press) for press in PRESSES)


@pytest.fixture(scope="session")
def search(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Search:
    return Search(contacts, block, prior, 3e-3, Noise())
