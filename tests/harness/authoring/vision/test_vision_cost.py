"""What pictures cost and err, knob by knob: nothing is made twice, and errors fall where they must."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.cost import DEFAULT, Studio, Way, measure, ways
from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.profiles import CellsSpec
from harness.basics.errors import DataRefused
from harness.objectfile.vision.network import NetworkSize
from harness.objectfile.vision.render import RenderSettings
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import ball

TINY = CellsSpec(
    NetworkSize(width=8, octaves=2, turns=1, kind="osf-v"), cells=4, places=20_000, steps=400, least=64
)
SIDE = 32
PLAIN = Way(DEFAULT, DEFAULT, TINY, SIDE)


def unsaid(_what: str, _share: float) -> None:
    """Progress that nobody is told of."""


def studio_of_a_ball() -> Studio:
    lit = LitObject(plain(ball(0.05, 3), (0.7, 0.4, 0.1)))
    return Studio(lit, held_out_pictures(lit.appearance.mesh, 2, SIDE, SIDE, 0), 1)


@pytest.fixture(scope="module")
def studio(tmp_path_factory: pytest.TempPathFactory) -> Studio:
    made = studio_of_a_ball()
    made.train(TINY, 0, tmp_path_factory.mktemp("networks"), unsaid)
    return made


def test_each_way_turns_one_knob_and_none_is_there_twice() -> None:
    every = ways(TINY, SIDE)
    assert every[0] == PLAIN
    unnamed = [replace(way, knob="", level="") for way in every]
    assert len(set(unnamed)) == len(unnamed)
    for way in every[1:]:
        turned = [
            *(vars(way.settings)[name] != value for name, value in vars(RenderSettings()).items()),
            way.side != SIDE,
            way.networks != TINY,
        ]
        assert sum(turned) == 1


def test_the_error_of_a_view_is_that_of_its_peak_signal_to_noise_ratio(studio: Studio) -> None:
    (found,) = measure([PLAIN], studio, 2, unsaid)
    decibels = [20.0 * math.log10(255.0 / error) for error in found.point.errors]
    assert sum(decibels) / 2.0 == pytest.approx(found.worth.exact["psnr_db"])
    assert min(decibels) == pytest.approx(found.worth.exact["psnr_db_worst"])
    assert 10.0 < found.worth.exact["psnr_db"] < 60.0
    assert found.point.error.value == pytest.approx(found.point.errors.mean())
    assert 0.0 < found.point.seconds.low <= found.point.seconds.high


def test_networks_are_trained_once_and_a_damaged_file_is_refused(
    studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    again = studio_of_a_ball()
    again.train(TINY, 0, tmp_path, unsaid)
    assert again.file_bytes == studio.file_bytes
    (kept,) = tmp_path.iterdir()
    monkeypatch.setattr(CellTraining, "step_epoch", lambda _: pytest.fail("trained again"))
    studio_of_a_ball().train(TINY, 0, tmp_path, unsaid)
    kept.write_bytes(kept.read_bytes()[:1000])
    with pytest.raises(DataRefused):
        studio_of_a_ball().train(TINY, 0, tmp_path, unsaid)
