"""Error against seconds, and live beside simulated: what the report draws from one recording."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.contact_localization.accuracy.dials import accuracy_at
from experiments.contact_localization.answer import Answer, read
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.dials import METHOD, PARTICLES, ROUNDS, SPACING
from experiments.contact_localization.posterior.estimate import locate
from experiments.contact_localization.posterior.noise import Noise
from experiments.contact_localization.report.report import LEVELS, object_from_gels, trade
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.recording.observation import Observation
from harness.sim.optics.optics import Optics
from tests.samples.synthetic_press import PRESSES, felt
from tests.support.localization import dials

ALL = {name: accuracy_at(setting) for name, setting in LEVELS.items()}


def test_the_levels_tried_go_from_cheap_to_exact_for_each_method() -> None:
    grids = [levels for levels in ALL.values() if levels.of(METHOD) == "grid"]
    filters = [levels for levels in ALL.values() if levels.of(METHOD) == "particle"]
    assert [g.of(SPACING) for g in grids] == sorted((g.of(SPACING) for g in grids), reverse=True)
    assert [g.of(ROUNDS) for g in grids] == sorted(g.of(ROUNDS) for g in grids)
    assert [f.of(PARTICLES) for f in filters] == sorted(f.of(PARTICLES) for f in filters)
    assert dials() in grids
    assert len({tuple(levels.items()) for levels in ALL.values()}) == len(ALL)


@pytest.fixture(scope="module")
def answered(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Answer:
    """With the pictures that an exact sensor would have taken."""
    heights = np.array([felt(block.raster, press) for press in PRESSES])
    images = Optics(block.calibration, "exact").render(heights).images
    observations = tuple(
        Observation(c.base_from_gel, image[None]) for c, image in zip(contacts, images, strict=True)
    )
    quick = dials(spacing=3e-3, rounds=1, samples=300)
    last = locate(contacts, block, prior, quick, Noise())[-1]
    return Answer(observations, tuple(heights), block, prior, last, 0.1)


def test_every_level_is_tried_on_the_same_readings_and_scored(answered: Answer) -> None:
    true = np.array(PRESSES[-1].point)
    readings = read(answered.observations, answered.model, answered.prior, seed=0)
    points = trade(readings, true)
    assert [point.name for point in points] == list(LEVELS)
    for point in points:
        assert point.accuracy == ALL[point.name]
        assert point.seconds_a_contact > 0.0
        assert 0.0 <= point.error < answered.model.mesh.diagonal
    # Exact readings of a small object: every level of ours is near, whatever it cost.
    assert max(point.error for point in points if point.accuracy.of(METHOD) == "grid") < 4e-3


def test_a_gel_is_put_as_deep_behind_its_contact_as_its_image_says(answered: Answer) -> None:
    heights: FloatArray = np.array([np.full((120, 160), 1e-4 * (k + 1)) for k in range(len(PRESSES))])
    placed = object_from_gels(replace(answered, heights=tuple(heights)))
    for k, pose in enumerate(placed):
        point = answered.last.contacts[k]
        assert pose[:3, 3] == pytest.approx(point + 1e-4 * (k + 1) * pose[:3, 2], abs=1e-12)
        turned = answered.prior.object_from_base(np.array([answered.last.yaw]))[0]
        expected = turned @ answered.observations[k].base_from_gel[:3, :3]
        assert pose[:3, :3] == pytest.approx(expected, abs=1e-12)
