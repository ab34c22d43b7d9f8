"""1.0's touch, trained for seconds, beats one colour; the untouched gel is known; presses are its kind."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.paper.rendering import FitSpec, RenderingWork, grid_points
from experiments.paper.touch import (
    MIDDLE,
    PressInputs,
    TouchBench,
    first_touch,
    second_touch,
    touch_bench,
    untouched,
)
from harness.authoring.touch.data import DEPTHS, MOST_TILT
from harness.basics.store import Store
from tests.samples.touch_bench import ball


def work(folder: Path) -> RenderingWork:
    return RenderingWork(Store(folder), lambda doing, share: None)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> TouchBench:
    return touch_bench(ball(), 6, "upright", work(tmp_path_factory.mktemp("store")))


def test_upright_presses_are_upright_and_equally_deep(bench: TouchBench) -> None:
    presses = bench.presses
    assert not presses.tilts.any()
    assert not presses.yaws.any()
    assert (presses.depths == MIDDLE).all()


def test_other_presses_lean_and_vary_within_the_papers_range(tmp_path: Path) -> None:
    presses = touch_bench(ball(), 12, "any", work(tmp_path)).presses
    assert (presses.depths >= DEPTHS[0]).all()
    assert (presses.depths <= DEPTHS[1]).all()
    assert 0.0 < presses.tilts.max() <= MOST_TILT
    assert not presses.yaws.any()  # the paper's networks know none


def test_the_reference_scores_as_the_same_and_the_untouched_gel_does_not(bench: TouchBench) -> None:
    same = bench.scores(0, bench.picture(bench.maps[0]))
    assert same["ssim"] == pytest.approx(1.0)
    assert same["psnr_db"] == pytest.approx(10.0 * np.log10(255.0**2 * 12.0))
    nothing = bench.scores(0, untouched(bench).make().render(0))
    assert nothing["psnr_db"] < 40.0


def test_inputs_of_2_0_are_normalised_as_the_paper_does(bench: TouchBench) -> None:
    inputs, count = PressInputs.of(bench.places), bench.maps[0].size
    rows = inputs.rows(bench.presses[:1], np.arange(count))
    assert (rows >= np.array([0.0] * 4 + [-1.0] * 2 + [0.0] * 3)).all()
    assert (rows <= 1.0).all()
    press, bounds = bench.presses[:1], bench.places.mesh.bounds
    np.testing.assert_allclose(rows[0, :3], ((press.points - bounds[0]) / np.ptp(bounds, axis=0))[0])
    np.testing.assert_allclose(rows[0, 3:6], [0.0, 1.0, 0.0], atol=1e-12)
    assert rows[1, 7:].tolist() == [0.0, 1.0 / (bench.maps.shape[2] - 1)]
    assert rows[-1, 7:].tolist() == [1.0, 1.0]


def test_pixels_are_placed_row_by_row() -> None:
    places = grid_points(-1.0, (2, 3))
    assert places.tolist() == [[-1, -1], [-1, 0], [-1, 1], [1, -1], [1, 0], [1, 1]]


@pytest.mark.parametrize(("method", "skip"), [(first_touch, 0), (second_touch, 2)])
def test_a_network_that_was_trained_for_seconds_beats_one_colour(
    bench: TouchBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, method: Any, skip: int
) -> None:
    pytest.importorskip("torch", reason="torch is in the extra `author`, which is not installed")
    small = FitSpec(depth=3, width=64, octaves=4, skip=skip, steps=150, batch=2048, rate=4e-3)
    monkeypatch.setattr("experiments.paper.touch.COLOURS", small)
    monkeypatch.setattr("experiments.paper.touch.TOUCHNET", small)
    picture = method(bench, work(tmp_path)).make().render(0)
    mean = np.broadcast_to(bench.picture(bench.maps[0]).mean(axis=(0, 1)), picture.shape)
    assert bench.scores(0, picture)["psnr_db"] > bench.scores(0, mean)["psnr_db"] + 3.0
