"""Networks of a look learn what they are shown, end in the same bits however they came there, and meet."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.metrics import picture_errors
from harness.authoring.vision.profiles import VisionProfile
from harness.authoring.vision.vision import CHECKPOINT, author_vision
from harness.basics.errors import DataRefused
from harness.objectfile.vision.network import VisionModel
from harness.picture.linear_image import LinearImage
from harness.sim.light.direct_image import LitObject
from tests.oracles.plain_networks import Query, evaluate
from tests.samples.taught_ball import RADIUS, TINY, grid_for, lit_ball, training_of


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


@pytest.fixture(scope="module")
def trained(lit: LitObject) -> CellTraining:
    training = training_of(lit)
    while not training.done:
        training.step_epoch()
    return training


def bits(model: VisionModel) -> bytes:
    return b"".join(np.ascontiguousarray(array).tobytes() for _, array in model.weights.arrays())


def test_a_killed_training_ends_in_the_same_bits_of_any_number_of_threads(
    lit: LitObject, trained: CellTraining, tmp_path: Path
) -> None:
    kept = tmp_path / "kept.npz"
    for threads in (2, 1, 2):
        part = training_of(lit, threads=threads)
        if kept.exists():
            part.load(kept)
        if not part.done:
            part.step_epoch()
        part.save(kept)
    while not part.done:
        part.step_epoch()
    assert part.losses == trained.losses
    assert bits(part.finish()) == bits(trained.finish())


def test_a_checkpoint_of_another_training_is_refused(
    lit: LitObject, trained: CellTraining, tmp_path: Path
) -> None:
    kept = tmp_path / "kept.npz"
    trained.save(kept)
    for other in (training_of(lit, seed=4), training_of(lit, replace(TINY, rate=2e-3))):
        with pytest.raises(DataRefused, match="seed"):
            other.load(kept)
    kept.write_bytes(b"PK\x03\x04")
    with pytest.raises(DataRefused, match="checkpoint"):
        training_of(lit).load(kept)


def test_more_steps_leave_smaller_errors(lit: LitObject, trained: CellTraining) -> None:
    short = training_of(lit, replace(TINY, steps=30))
    first = short.step_epoch()
    assert np.mean(trained.losses) < 0.5 * first


def test_neighbours_agree_at_their_border(lit: LitObject, trained: CellTraining) -> None:
    """Every network is trained alone; what they answer on one side and the other of a border is the same."""
    grid, _ = grid_for(lit)
    model = trained.finish()
    random = np.random.default_rng(9)
    way = random.standard_normal((4000, 3))
    points = RADIUS * way / np.linalg.norm(way, axis=1, keepdims=True)
    # Onto the border between the cells along x that it is nearest to.
    border = grid.low[0] + grid.cell * np.round((points[:, 0] - grid.low[0]) / grid.cell)
    points = points[np.abs(points[:, 0] - border) < 1e-3 * RADIUS]
    points[:, 0] = grid.low[0] + grid.cell * np.round((points[:, 0] - grid.low[0]) / grid.cell)
    normals = points / np.linalg.norm(points, axis=1, keepdims=True)
    light = np.array([0.0, 0.6, 0.8])
    extras = np.concatenate([(normals @ light > 0.0)[:, None], normals], axis=1)
    beside = np.array([1e-6 * grid.cell, 0.0, 0.0])
    sides = [grid.networks(points + by) for by in (-beside, beside)]
    both = (sides[0] >= 0) & (sides[1] >= 0) & (sides[0] != sides[1])
    assert np.count_nonzero(both) > 5
    found = [
        evaluate(model, Query(side[both], points[both], -normals[both], light, extras[both]))[1]
        for side in sides
    ]
    assert np.sqrt(np.mean((found[0] - found[1]) ** 2)) < 0.04


def test_a_look_becomes_networks_that_show_it(lit: LitObject, tmp_path: Path) -> None:
    said: list[str] = []
    profile = VisionProfile(TINY, pictures=2, side=48, samples=3)
    made = author_vision(
        lit.appearance,
        profile,
        0,
        tmp_path,
        lambda what, _share: said.append(what),
        threads=1,
    )
    held_out = held_out_pictures(lit.appearance.mesh, 2, 48, 48, 0)
    exact = [
        lit.render(camera, [light], 3).image
        for camera, light in zip(held_out.cameras, held_out.lights, strict=True)
    ]
    mean = sum(image.colour.sum(axis=(0, 1)) for image in exact) / sum(image.alpha.sum() for image in exact)
    flat = [LinearImage(image.alpha[..., None] * mean, image.alpha, image.depth) for image in exact]
    # The right outline in its mean colour is off by more than twice as much.
    assert made.errors["psnr_db"] > picture_errors(exact, flat)["psnr_db"] + 6.0
    assert made.errors["psnr_db_object"] < made.errors["psnr_db"]
    assert len(made.model.weights) == len(made.model.grid)
    assert (tmp_path / CHECKPOINT).exists()
    assert {"drawing places", "measuring"} < set(said)
    assert set(made.seconds) == {"references", "places", "networks", "measure"}
