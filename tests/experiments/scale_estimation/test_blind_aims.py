"""Lines to a flat object that was not seen lead onto it, as it may stand by what was met and what was not."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.scale_estimation.contact_planning import FLATTEST, aims_unmet, lowest_end, placed
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.touch.fit import POINTS, Patch, free_line
from harness.basics.arrays import FloatArray
from harness.basics.geometry import transform
from harness.bench.station_file import Station
from harness.objects.household import build
from harness.skills.exploring.lines import LOWEST
from harness.skills.exploring.unknown_space import FLAT, aims_unseen
from tests.experiments.scale_estimation.runs import scene_of

WAYS = 6
DOWN = np.diag([1.0, -1.0, -1.0])
REACH = 3.0e-3
"""M to a side within which the gel's face, 7 mm wide or more, meets what it comes down on."""


def model_of(name: str, station: Station) -> ObjectModel:
    return ObjectModel(build(name), scene_of(3, camera=False, mesh=f"builtin:{name}"), station)


def explored(model: ObjectModel, true: FloatArray, seed: int | None) -> int:
    """Of ``WAYS`` lines straight down, how many meet the object; no seed: lines to its supposed middle."""
    surface = placed(model, model.stand.points, true)
    random, met = np.random.default_rng(seed or 0), 0
    patches: list[Patch] = []
    free: list[FloatArray] = []
    for _ in range(WAYS):
        if seed is None:
            aim = next(aims_unseen(model.place, model.place_error, 0.0, False, random))
        else:
            aim = aims_unmet(model, patches, free, random)[0]
        near = np.flatnonzero(np.linalg.norm(surface[:, :2] - aim.end[:2], axis=1) < REACH)
        top = near[surface[near, 2].argmax()] if len(near) else 0
        hit = bool(len(near)) and surface[top, 2] > model.place[2] + aim.lowest
        height = surface[top, 2] if hit else model.place[2] + aim.lowest
        free.append(free_line(transform(DOWN, np.array([*aim.end[:2], height])), 0.05, hit))
        if hit:
            around = np.argsort(np.linalg.norm(surface - surface[top], axis=1))[:POINTS]
            patches.append(Patch(surface[around], np.array([0.0, 0.0, 1.0])))
            met += 1
    return met


@pytest.mark.parametrize("name", ["plate", "wrench"])
def test_more_of_them_meet_the_object_than_of_lines_to_its_middle(name: str, station: Station) -> None:
    model, random = model_of(name, station), np.random.default_rng(5)
    ours = middle = 0
    for log_size in np.log([0.6, 0.8, 1.2]):
        turn = random.uniform(0.0, 2.0 * np.pi)
        true = np.array([log_size, *random.normal(0.0, model.place_error, 2), turn])
        ours += explored(model, true, 1)
        middle += explored(model, true, None)
    assert ours >= WAYS  # a third of all
    assert ours > middle


def test_a_flat_object_is_met_lower_and_the_support_never(station: Station) -> None:
    wrench, mug = model_of("wrench", station), model_of("mug", station)
    thickness = float(np.ptp(wrench.corners[:, 2])) * wrench.sizes.low / wrench.nominal
    assert FLATTEST <= lowest_end(wrench) < min(thickness, LOWEST)
    assert lowest_end(mug) == LOWEST
    sheet = replace(wrench.mesh, vertices=wrench.mesh.vertices * [1.0, 1.0, 0.1])
    assert lowest_end(ObjectModel(sheet, wrench.scene, station)) == FLATTEST
    assert wrench.height < FLAT * wrench.nominal
    assert mug.height > FLAT * mug.nominal


def test_ways_that_met_nothing_are_not_gone_again(station: Station) -> None:
    """The gel came down all over a place: no object is thought of that is there."""
    model, random = model_of("wrench", station), np.random.default_rng(3)
    place = np.array([0.03, 0.0, 0.003])
    free = [
        free_line(transform(DOWN, model.place + place + [x, y, 0.0]), 0.02, touched=False)
        for x in np.linspace(-0.015, 0.015, 6)
        for y in np.linspace(-0.015, 0.015, 6)
    ]

    def there(ways: list[FloatArray]) -> float:
        ends = np.array([aim.end for _ in range(4) for aim in aims_unmet(model, [], ways, random)])
        return float((np.abs((ends - model.place - place)[:, :2]).max(axis=1) < 0.01).mean())

    assert there(free) < 0.5 * there([])
