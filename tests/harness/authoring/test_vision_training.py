"""Networks of a look learn what they are shown, end in the same bits however they came there, and meet."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from seen_shapes import ball

from harness.arrays import AnyArray
from harness.authoring.vision import CHECKPOINT, STRICT_CHECKPOINT, author_vision
from harness.authoring.vision_cells import CellTraining
from harness.authoring.vision_data import HeldOut, held_out_pictures
from harness.authoring.vision_kernels import Lesson, _adam, _back, _forth, _wrong, batch_of, encode
from harness.authoring.vision_layers import (
    first_weights,
    layer_shapes,
    layers_of,
    octave_factors,
    parameter_count,
    weights_of,
)
from harness.authoring.vision_lessons import AHEAD, OPAQUE, Lessons, draw_lamps, draw_lessons
from harness.authoring.vision_metrics import picture_errors
from harness.authoring.vision_profiles import CellsSpec, VisionProfile, vision_profile
from harness.errors import DataRefused, OutOfDomain, WrongUse
from harness.linear_image import LinearImage
from harness.objectfile.vision_network import COMPACT, PAPER, NetworkSize, VisionGrid, VisionModel
from harness.objectfile.vision_plain import Asked, evaluate
from harness.objectfile.vision_shell import grid_of, lattice_of, surface_shell
from harness.sim.appearance import plain
from harness.sim.direct_image import LitObject

SIZE = NetworkSize(width=16, octaves=3, turns=2, kind="osf-v")
TINY = CellsSpec(SIZE, cells=4, places=6000, steps=300, batch=64, least=64)
NOTHING = HeldOut((), ())
RADIUS = 0.05


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return LitObject(plain(ball(RADIUS, 3), (0.7, 0.4, 0.1)))


def grid_for(lit: LitObject) -> tuple[VisionGrid, float]:
    lattice = lattice_of(lit.appearance.mesh, TINY.cells)
    shell = surface_shell(lit.appearance.mesh, lattice)
    return grid_of(shell, lattice), shell.voxel


def training_of(lit: LitObject, spec: CellsSpec = TINY, seed: int = 3, threads: int = 1) -> CellTraining:
    grid, voxel = grid_for(lit)
    lessons = draw_lessons(lit, spec.places, voxel, seed, NOTHING)
    lamps = draw_lamps(256, seed, NOTHING)
    return CellTraining(spec, grid, lessons, lamps, OPAQUE / voxel, seed, threads)


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
        with pytest.raises(DataRefused, match="another network, object, data or seed"):
            other.load(kept)
    kept.write_bytes(b"PK\x03\x04")
    with pytest.raises(DataRefused, match="delete it to begin anew"):
        training_of(lit).load(kept)


def test_more_steps_leave_smaller_errors(lit: LitObject, trained: CellTraining) -> None:
    short = training_of(lit, replace(TINY, steps=30))
    first = short.step_epoch()
    assert np.mean(trained.losses) < 0.5 * first


def test_slopes_are_those_of_the_error(lit: LitObject) -> None:
    """Against differences of the loss, in the middle of the range, where no slope is raised."""
    random = np.random.default_rng(5)
    count, shapes = 64, layer_shapes(SIZE)
    flat = first_weights(SIZE, 1)
    layers_of(flat, SIZE).colour_bias[:] = 0.0
    slope = np.zeros_like(flat)
    batch = batch_of(count, SIZE.place, shapes.told[0], SIZE.width)
    lesson = Lesson(
        np.empty((count, SIZE.place), np.float32),
        np.empty((count, 0), np.float32),
        np.empty((count, 3), np.float32),
        np.empty((count, 3), np.float32),
        (0.9 * random.uniform(-1.0, 1.0, count)).astype(np.float32),
        random.random(count).astype(np.float32),
        np.empty((0, 3), np.float32),
    )
    batch.at[:] = np.arange(count)
    encode(random.uniform(-1, 1, (count, 3)).astype(np.float32), octave_factors(SIZE), 0, batch.encoded)
    batch.told[:] = random.standard_normal(batch.told.shape)
    batch.wanted[:] = random.random(batch.wanted.shape)
    opacity = 0.3

    def loss(at: AnyArray) -> float:
        layers = layers_of(at, SIZE)
        _forth(layers, batch.encoded, batch.told, batch)
        raw = batch.raw[:, 0].astype(np.float64) + layers.density_bias[0] - lesson.depth
        return 0.5 * float(_wrong(layers, lesson, opacity, batch) + opacity * (raw**2).sum()) / count

    loss(flat)
    _back(layers_of(flat, SIZE), layers_of(slope, SIZE), batch)
    for ours, sloped in zip(layers_of(flat, SIZE), layers_of(slope, SIZE), strict=True):
        # Along all slopes at once nothing cancels; the step crosses next to no ReLU's bend.
        way = np.zeros_like(flat)
        begin = (ours.__array_interface__["data"][0] - flat.__array_interface__["data"][0]) // flat.itemsize
        way[begin : begin + ours.size] = np.sign(sloped).ravel()
        step = np.float32(2e-4)
        measured = (loss(flat + step * way) - loss(flat - step * way)) / (2.0 * float(step))
        assert measured == pytest.approx(float(np.abs(sloped).sum()), rel=0.02)


def test_what_is_written_answers_as_what_was_trained() -> None:
    random, size = np.random.default_rng(2), replace(SIZE, octaves=6)
    flats = np.stack([first_weights(size, seed) for seed in (1, 2)])
    flats = flats.astype(np.float16).astype(np.float32)
    grid = VisionGrid(np.zeros(3), 2.0, np.array([[0, 0, 0], [1, 0, 0]]))
    points = random.random((40, 3)) * (4.0, 2.0, 2.0)
    networks = grid.networks(points)
    light = np.array([0.6, 0.0, 0.8])
    extras = random.random((40, 4))
    model = VisionModel(grid, weights_of(flats, size, 7.0))
    density, colour = evaluate(model, Asked(networks, points, np.tile(light, (40, 1)), light, extras))
    for cell in (0, 1):
        at = np.flatnonzero(networks == cell)
        batch = batch_of(len(at), size.place, layer_shapes(size).told[0], size.width)
        local = grid.local(points[at], networks[at]).astype(np.float32)
        encode(local, octave_factors(size), 0, batch.encoded)
        encode(np.tile(light, (len(at), 1)).astype(np.float32), np.ones(2, np.float32), 0, batch.told)
        batch.told[:, -4:] = extras[at]
        layers = layers_of(flats[cell], size)
        _forth(layers, batch.encoded, batch.told, batch)
        raw = batch.raw[:, 0] + layers.density_bias
        assert density[at] == pytest.approx(7.0 * np.maximum(raw, 0.0), abs=7.0 * 1e-2)
        assert colour[at] == pytest.approx(1 / (1 + np.exp(-batch.logits - layers.colour_bias)), abs=2e-3)


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
        evaluate(model, Asked(side[both], points[both], -normals[both], light, extras[both]))[1]
        for side in sides
    ]
    assert np.sqrt(np.mean((found[0] - found[1]) ** 2)) < 0.04


def test_lessons_lie_along_views_of_the_surface() -> None:
    """On a ball the distance to the surface is known: colours are near it, and depth is what it says."""
    voxel = RADIUS / 30.0
    fine = LitObject(plain(ball(RADIUS, 4), (0.7, 0.4, 0.1)))
    lessons = draw_lessons(fine, 3000, voxel, 1, NOTHING)
    behind = (RADIUS - np.linalg.norm(lessons.points, axis=1)) / voxel
    coloured = lessons.weight == 1.0
    assert np.all(np.abs(behind[coloured]) < 0.85)
    # A view goes straight where the ball curves away, by 4^2 / 60 voxels at most; faces lean by 0.05.
    clear = np.abs(lessons.depth) < 1.0
    assert lessons.depth[clear] == pytest.approx(behind[clear] + AHEAD, abs=0.5)
    assert np.all(lessons.depth[behind < -1.6] == -1.0)
    assert np.all(lessons.colours == np.array([0.7, 0.4, 0.1], np.float32))


def test_lessons_and_lamps_are_clear_of_what_is_kept_back(lit: LitObject) -> None:
    held_out = held_out_pictures(lit.appearance.mesh, 3, 32, 32, 5, apart=np.radians(20.0))
    lamps = draw_lamps(500, 1, held_out).astype(np.float64)
    kept = np.stack([light.direction for light in held_out.lights])
    assert np.abs(lamps @ kept.T).max() < np.cos(held_out.apart) + 1e-6
    everywhere = held_out_pictures(lit.appearance.mesh, 200, 32, 32, 5, apart=np.radians(44.0))
    with pytest.raises(OutOfDomain, match="keep back fewer"):
        draw_lamps(500, 1, everywhere)


def test_lamps_of_a_place_light_it(lit: LitObject) -> None:
    """A ball is in the way of no lamp that its place faces; those kept back light nothing."""
    held_out = held_out_pictures(lit.appearance.mesh, 3, 32, 32, 5, apart=np.radians(20.0))
    lessons = draw_lessons(lit, 2000, 1e-3, 2, held_out, lamps=4)
    cosine = np.einsum("nx,nx->n", lessons.normals, lessons.lamps)
    assert np.count_nonzero(cosine < 0.0) > 50
    faced = cosine > 0.1
    lit_by = cosine[faced, None] * np.array([0.7, 0.4, 0.1])
    assert lessons.colours[faced] == pytest.approx(lit_by, abs=1e-5)
    assert not lessons.colours[cosine < -1e-6].any()
    assert held_out.clear_of_lights(lessons.lamps.astype(np.float64)).all()
    assert np.all(np.unique(lessons.points, axis=0, return_counts=True)[1] <= 4)


def test_fewer_lessons_are_the_first_of_more(lit: LitObject) -> None:
    few, many = (draw_lessons(lit, count, 1e-3, 6, NOTHING) for count in (100, 300))
    for name in Lessons.__dataclass_fields__:
        assert np.array_equal(getattr(few, name), getattr(many, name)[:100])


def test_a_look_becomes_networks_that_show_it(lit: LitObject, tmp_path: Path) -> None:
    said: list[str] = []
    strict = replace(TINY, size=replace(SIZE, kind="osf"))
    profile = VisionProfile(TINY, pictures=2, strict=strict, side=48, samples=3)
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
    # Told only place, view and light, they learn where the dark begins too, if not as sharply.
    assert made.errors["strict_psnr_db"] > picture_errors(exact, flat)["psnr_db"] + 3.0
    assert made.errors["psnr_db_object"] < made.errors["psnr_db"]
    assert len(made.model.weights) == len(made.model.grid)
    assert (tmp_path / CHECKPOINT).exists()
    assert (tmp_path / STRICT_CHECKPOINT).exists()
    assert {"drawing places", "measuring"} < set(said)
    stages = ("places", "networks", "measure")
    assert set(made.seconds) == {
        "references",
        *(f"{word}{stage}" for word in ("", "strict_") for stage in stages),
    }


def test_moments_of_what_learns_no_more_end_at_zero_and_not_below_what_numbers_can_be() -> None:
    """Against Adam in float64: weights whose slopes stop go on as there, and their moments vanish."""
    random, steps = np.random.default_rng(5), 12_000
    slopes = random.normal(size=(40, 64)) * 10.0 ** random.uniform(-12, 0, 64)
    flat, means, squares = (np.zeros(64, np.float32) for _ in range(3))
    weights, mean, square = np.zeros((3, 64))
    least = np.finfo(np.float32).tiny
    for step in range(steps):
        slope = slopes[step] if step < len(slopes) else np.zeros(64)
        _adam(flat, slope.astype(np.float32), means, squares, 1e-3, 1.0)
        mean, square = 0.9 * mean + 0.1 * slope, 0.99 * square + 0.01 * slope**2
        weights -= 1e-3 * mean / (np.sqrt(square) + 1e-9)
        for moment in (means, squares):
            assert not np.any((moment != 0.0) & (np.abs(moment) < least))
    assert not means.any()
    assert not squares.any()
    assert flat == pytest.approx(weights, rel=1e-4, abs=1e-7)


def test_profiles_are_as_large_as_they_are_named() -> None:
    compact, paper = vision_profile("standard"), vision_profile("paper")
    assert replace(paper.networks.size, kind="osf") == PAPER
    assert replace(compact.networks.size, kind="osf") == COMPACT
    assert paper.strict is not None
    # The paper's very network, of 20 292 parameters.
    assert paper.strict.size == PAPER
    assert paper.strict.size.parameters == 20_292


def test_networks_of_the_papers_size_learn_too(lit: LitObject, tmp_path: Path) -> None:
    """Ten octaves, of which the highest turn 160 times in a cell, do not spoil what lies between places."""
    wide = replace(vision_profile("paper").networks, cells=4, places=6000, steps=100, batch=64)
    profile = VisionProfile(wide, pictures=2, side=48, samples=3)
    errors = {}
    for name, size in (("paper", wide.size), ("compact", vision_profile("standard").networks.size)):
        chosen = replace(profile, networks=replace(wide, size=size))
        folder = tmp_path / name
        folder.mkdir()
        errors[name] = author_vision(lit.appearance, chosen, 0, folder, lambda *_: None, threads=1).errors
    # Nearly as good as of six octaves, on a ball of one colour that needs none of them.
    assert errors["paper"]["psnr_db"] > errors["compact"]["psnr_db"] - 1.0
    assert errors["paper"]["bytes"] > 2.0 * errors["compact"]["bytes"]


def test_what_cannot_be_trained_says_so(lit: LitObject, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="told more than the paper's"):
        VisionProfile(TINY, pictures=1, strict=TINY)
    for wrong in ({"places": 0}, {"overlap": 0.7}, {"hidden": 1.5}, {"rate": 0.0}):
        with pytest.raises(WrongUse, match="give"):
            replace(TINY, **wrong)
    with pytest.raises(WrongUse, match="no profile 'smok'"):
        vision_profile("smok")
    assert parameter_count(SIZE) == len(first_weights(SIZE, 0))
