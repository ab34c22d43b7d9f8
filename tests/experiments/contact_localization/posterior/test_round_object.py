"""A round object turned under its contacts: nothing but the yaw's own prior says by how much."""

import numpy as np
import pytest
import trimesh

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh
from tests.samples.synthetic_press import BASE_FROM_OBJECT, Press, contact, solid, tilted

RADIUS, HEIGHT = 60.0e-3, 30.0e-3
UP = np.array([0.0, 0.0, 1.0])
TURNS = np.radians([-2.5, -1.5, 0.0, 1.5, 2.5])


def _on_the_rim(azimuth: float, down: float) -> Press:
    """On the wall where ``down`` is 0, at the rim's edge from above where it is more."""
    out = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    point = (RADIUS - 4e-3 * down) * out + (0.5 * HEIGHT if down else 0.0) * UP
    return Press(tuple(point), tilted(tuple(-(1.0 - down) * out - down * UP)), yaw=0.3)


PRESSES = tuple(_on_the_rim(np.radians(azimuth), down) for azimuth, down in ((0, 0), (9, 0), (4, 1), (15, 1)))


@pytest.fixture(scope="module")
def search(block: Model) -> Search:
    # So many faces that the gel feels none of their edges.
    mesh = solid(trimesh.creation.cylinder(radius=RADIUS, height=HEIGHT, sections=720))
    raster, prior = RasterMesh(mesh), Prior(BASE_FROM_OBJECT[:3, :3])
    contacts = [contact(raster, press) for press in PRESSES]
    return Search(contacts, Model(mesh, GELSIGHT_R15, block.calibration), prior, 3e-3, Noise())


def _turned(search: Search, turns: FloatArray) -> Hypotheses:
    """The true hypothesis and those that have the object, and with it every contact, turned by so much."""
    gel = PRESSES[0].object_from_gel[:3, 3]
    gels = np.array([rotation_about(UP, turn) @ gel for turn in turns])
    return Hypotheses(gels, -turns, np.zeros(len(turns)))


def test_the_contacts_are_where_the_object_is_turned_to(search: Search) -> None:
    for k, press in enumerate(PRESSES):
        found = search.gel_centres(k, _turned(search, TURNS))
        expected = [rotation_about(UP, turn) @ press.object_from_gel[:3, 3] for turn in TURNS]
        assert found == pytest.approx(np.array(expected), abs=1e-9)


def test_turning_it_costs_what_the_prior_of_the_yaw_says(search: Search) -> None:
    """By the nominal picture alone, four contacts would tell the yaw better than its prior does."""
    at = _turned(search, TURNS)
    weighed = search.weigh(at, np.arange(len(PRESSES)), 2, 2)
    images = weighed.log_weights - search.log_yaw_prior(at.yaws)
    assert np.ptp(images) < 0.5


def test_a_turned_object_is_refused_no_sooner(search: Search) -> None:
    """What says whether a contact is of the object at all expects the turn too."""
    members = np.arange(len(PRESSES))
    straight, turned = (search.gates(_turned(search, TURNS[[k]]), members) for k in (2, 4))
    assert turned == pytest.approx(straight, abs=0.15)
