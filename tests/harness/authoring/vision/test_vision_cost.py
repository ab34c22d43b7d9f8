"""What pictures cost and err, knob by knob: nothing is measured twice, and errors fall where they must."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.cost import Cost, CostRequest, Views, measured, networks_of
from harness.authoring.vision.cost_networks import trained
from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.profiles import CellsSpec
from harness.authoring.vision.trades import (
    HALF,
    Networks,
    Variation,
    every_sample,
    in_bits,
    kept_bytes,
    trades,
)
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import NetworkSize, VisionModel
from harness.objectfile.vision.settings import RenderSettings
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball

TINY = CellsSpec(
    NetworkSize(width=8, octaves=2, turns=1, kind="osf-v"), cells=4, places=20_000, steps=400, least=64
)
SIDE = 32


def unsaid(_what: str, _share: float) -> None:
    """Progress that nobody is told of."""


@pytest.fixture(scope="module")
def views() -> Views:
    lit = LitObject(plain(ball(0.05, 3), (0.7, 0.4, 0.1)))
    return Views(lit, held_out_pictures(lit.appearance.mesh, 2, SIDE, SIDE, 0))


@pytest.fixture(scope="module")
def model(views: Views, tmp_path_factory: pytest.TempPathFactory) -> VisionModel:
    return trained(Networks(TINY), views, 0, tmp_path_factory.mktemp("networks"), unsaid, 1)


def test_every_knob_has_the_default_among_its_levels_and_turns_nothing_else() -> None:
    asked = trades(TINY, SIDE)
    plain_way = Variation(Networks(TINY), RenderSettings(), SIDE)
    for knob in {each.knob for each in asked} - {"grid, cells", "width"}:
        levels = [each.way for each in asked if each.knob == knob]
        assert plain_way in levels, knob
        assert len(set(levels)) == len(levels) > 1
    for way in {each.way for each in asked}:
        turned = [
            *(vars(way.settings)[name] != value for name, value in vars(RenderSettings()).items()),
            way.side != SIDE,
            way.networks != Networks(TINY),
        ]
        assert sum(turned) <= 1
    assert len(networks_of(asked)) == len({each.way.networks.spec for each in asked})


def test_many_samples_leave_nothing_out_of_themselves_and_few_leave_out_more(
    views: Views, model: VisionModel
) -> None:
    way = Variation(Networks(TINY), RenderSettings(), SIDE)
    finest = every_sample(RenderSettings())
    ways = [
        replace(way, settings=each) for each in (finest, replace(finest, step=0.5), RenderSettings(step=4.0))
    ]
    found = costs(views, model, [*ways, ways[0]])
    assert len(found) == 3
    many = [found[each].worth.many["psnr_db"] for each in ways]
    assert math.isinf(many[0])
    assert many[0] > many[1] > many[2]
    samples = [found[each].worth.samples for each in ways]
    assert samples[0] > samples[1] > samples[2]
    for cost in found.values():
        assert 10.0 < cost.worth.exact["psnr_db"] < 60.0
        assert 0.0 < cost.wall.low <= cost.wall.middle <= cost.wall.high
        assert cost.cpu.middle > 0.0


def costs(views: Views, model: VisionModel, ways: list[Variation]) -> Mapping[Variation, Cost]:
    return measured(ways, CostRequest({Networks(TINY): model}, views.lit, 1), views, 2, unsaid)


def test_fewer_bits_change_each_weight_by_half_a_step_at_most(model: VisionModel) -> None:
    assert in_bits(model, HALF) is model
    coarse = in_bits(model, 6)
    for (name, before), (_, after) in zip(model.weights.arrays(), coarse.weights.arrays(), strict=True):
        if name.endswith("bias"):
            np.testing.assert_array_equal(after, before)
            continue
        # The scale of a column is its greatest over 31; float16 rounds the product once more.
        most = np.abs(before.astype(np.float64)).max(axis=1, keepdims=True)
        apart = np.abs(after.astype(np.float64) - before)
        assert (apart <= most * (0.5 / 31.0 + 2.0**-11) + 1e-7).all(), name
    blank = (model.weights.scatter == 0.0).all(axis=0)
    assert blank.any(), "the rows of views"
    assert (coarse.weights.scatter[:, blank] == 0.0).all()
    assert 0.25 < kept_bytes(coarse, 6) / kept_bytes(model, HALF) < 1.0


def test_kept_bytes_are_those_of_the_file_without_its_graph(model: VisionModel) -> None:
    whole = len(vision_graph(model).SerializeToString())
    assert kept_bytes(model, HALF) < whole < kept_bytes(model, HALF) + 25_000


@pytest.mark.parametrize("bits", [-1, 1, 17])
def test_bits_that_hold_no_weight_are_refused(model: VisionModel, bits: int) -> None:
    with pytest.raises(WrongUse, match="2 to 16 are made"):
        in_bits(model, bits)


def test_networks_are_trained_once_and_a_damaged_file_is_refused(
    views: Views, model: VisionModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = trained(Networks(TINY), views, 0, tmp_path, unsaid, 1)
    for (name, one), (_, other) in zip(first.weights.arrays(), model.weights.arrays(), strict=True):
        np.testing.assert_array_equal(one, other, name)
    (kept,) = tmp_path.iterdir()
    monkeypatch.setattr(CellTraining, "step_epoch", lambda _: pytest.fail("trained again"))
    trained(Networks(TINY, 8), views, 0, tmp_path, unsaid, 1)
    kept.write_bytes(kept.read_bytes()[:1000])
    with pytest.raises(DataRefused):
        trained(Networks(TINY), views, 0, tmp_path, unsaid, 1)
