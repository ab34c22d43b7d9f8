"""A teacher learns what the surface answers, ends in the same bits, and is told what its kind says."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.distilled import distilled, with_lamps
from harness.authoring.vision.lessons import OPAQUE, Lessons, draw_lamps, draw_lessons
from harness.authoring.vision.profiles import CellsSpec, VisionProfile, vision_profile
from harness.authoring.vision.teacher import require_torch, teacher_file
from harness.authoring.vision.teacher_pictures import TeacherRenderer
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.authoring.vision.vision import STRICT, TEACHER, Teaching, author_vision
from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.vision.network.network import NetworkSize
from harness.objectfile.vision.network.plain import Asked, evaluate
from harness.objectfile.vision_tensors import Kind
from harness.sim.light.direct_image import LitObject
from tests.samples.taught_ball import COLOUR, NOTHING, RADIUS, grid_for, lit_ball

TINY = TeacherSpec(
    width=16, turns=1, coarsest=4, finest=8, levels=2, features=2, slots=8, places=6000, steps=60, epochs=4,
    batch=256, rate=1e-2,
)  # fmt: skip
STUDENTS = CellsSpec(
    NetworkSize(width=8, octaves=2, turns=1, kind="osf-v"), cells=4, places=6000, steps=300, least=64
)
needs_torch = pytest.mark.skipif(
    importlib.util.find_spec("torch") is None, reason="teachers are trained by torch, of the extra 'author'"
)


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


def lessons_of(lit: LitObject, kind: Kind) -> tuple[Lessons, AnyArray]:
    _, voxel = grid_for(lit)
    told = kind == "osf-v"
    lessons = draw_lessons(lit, TINY.places, voxel, 3, NOTHING, 0 if told else 2)
    return lessons, draw_lamps(256 if told else 0, 3, NOTHING)


def training_of(lit: LitObject, spec: TeacherSpec = TINY, seed: int = 3):  # type: ignore[no-untyped-def]
    import torch

    from harness.authoring.vision.teacher_training import TeacherTraining

    torch.set_num_threads(1)
    grid, _ = grid_for(lit)
    extent = float(grid.cell * grid.shape.max())
    return TeacherTraining(spec, grid.low, extent, *lessons_of(lit, spec.kind), seed, "cpu")


def answers_of(training) -> AnyArray:  # type: ignore[no-untyped-def]
    way = np.eye(3, dtype=np.float32)
    extras = np.hstack([np.ones((3, 1), np.float32), way])
    return np.hstack([np.c_[each] for each in training.ask(RADIUS * np.eye(3), -way, way, extras)])


@needs_torch
def test_a_stopped_training_ends_in_the_same_bits(lit: LitObject, tmp_path: Path) -> None:
    whole = training_of(lit)
    while not whole.done:
        whole.step_epoch()
    kept = tmp_path / "teacher.npz"
    for _ in range(TINY.epochs):
        part = training_of(lit)
        if kept.exists():
            part.load(kept)
        part.step_epoch()
        part.save(kept)
    assert part.done
    assert part.losses == whole.losses
    assert answers_of(part).tobytes() == answers_of(whole).tobytes()


@needs_torch
def test_a_checkpoint_of_another_training_is_refused(lit: LitObject, tmp_path: Path) -> None:
    kept = tmp_path / "teacher.npz"
    training_of(lit).save(kept)
    for other in (training_of(lit, seed=4), training_of(lit, replace(TINY, rate=2e-3))):
        with pytest.raises(DataRefused, match="another network, object, data or seed"):
            other.load(kept)


@needs_torch
@pytest.mark.parametrize("kind", ["osf-v", "osf"])
def test_it_learns_more_than_the_mean_colour(lit: LitObject, kind: Kind) -> None:
    """Against the best constant, by the same measure: roots of linear light, weighted."""
    training = training_of(lit, replace(TINY, kind=kind, steps=200))
    while not training.done:
        training.step_epoch()
    lessons, _ = lessons_of(lit, "osf")
    roots = np.sqrt(lessons.colours + 1e-3)
    spread = float((lessons.weight[:, None] * (roots - np.average(roots, 0, lessons.weight)) ** 2).mean())
    assert training.losses[-1] < 0.5 * np.sqrt(spread)


@needs_torch
def test_of_the_papers_inputs_none_is_visibility_or_normal(lit: LitObject) -> None:
    """Another lesson in all but what it says of visibility and normals teaches a strict one the same."""
    import torch

    from harness.authoring.vision.teacher_training import TeacherTraining

    torch.set_num_threads(1)
    grid, _ = grid_for(lit)
    lessons, lamps = lessons_of(lit, "osf")
    other = replace(lessons, normals=-lessons.normals, seen=1.0 - lessons.seen)
    found = []
    for each in (lessons, other):
        training = TeacherTraining(replace(TINY, kind="osf"), grid.low, 0.12, each, lamps, 3, "cpu")
        training.step_epoch()
        way = np.eye(3, dtype=np.float32)
        found.append(training.ask(RADIUS * np.eye(3), -way, way, np.empty((3, 0), np.float32)))
    assert all(np.array_equal(a, b) for a, b in zip(*found, strict=True))


@needs_torch
def test_density_begins_at_the_surface(lit: LitObject) -> None:
    training = training_of(lit, replace(TINY, steps=200, opacity=1.0))
    while not training.done:
        training.step_epoch()
    _, voxel = grid_for(lit)
    ways = np.random.default_rng(1).normal(size=(200, 3))
    ways = (ways / np.linalg.norm(ways, axis=1, keepdims=True)).astype(np.float32)
    extras = np.hstack([np.ones((200, 1), np.float32), ways])
    before, behind = (
        training.ask((RADIUS + away * voxel) * ways.astype(np.float64), -ways, ways, extras)[0]
        for away in (1.5, -0.5)
    )
    assert (before < 0.0).mean() > 0.95
    assert (behind > 0.0).mean() > 0.95


def test_the_renderer_asks_a_large_network_what_it_asks_tiny_ones(lit: LitObject) -> None:
    """One that answers with the tiny networks' answers draws their picture."""
    from harness.authoring.vision.data import held_out_pictures
    from harness.objectfile.vision.network.graph import vision_graph
    from harness.objectfile.vision.render import VisionRenderer

    grid, voxel = grid_for(lit)
    lessons = draw_lessons(lit, STUDENTS.places, voxel, 3, NOTHING)
    spec = replace(STUDENTS, steps=20)
    training = CellTraining(spec, grid, lessons, draw_lamps(256, 3, NOTHING), OPAQUE / voxel, 3, 1)
    while not training.done:
        training.step_epoch()
    model, mesh = training.finish(), lit.appearance.mesh

    def ask(
        points: AnyArray, views: AnyArray, lights: AnyArray, extras: AnyArray
    ) -> tuple[AnyArray, AnyArray]:
        networks = grid.networks(points)
        density, colour = evaluate(model, Asked(networks, points, views, lights[0], extras))
        return density * voxel / OPAQUE, colour

    held_out = held_out_pictures(mesh, 1, 32, 32, 5)
    camera, light = held_out.cameras[0], held_out.lights[0]
    own = VisionRenderer(vision_graph(model).SerializeToString(), mesh, 1).render(camera, light).image
    other = TeacherRenderer(ask, mesh, grid, "osf-v", OPAQUE / voxel, 1).render(camera, light).image
    assert np.abs(own.colour - other.colour).max() < 5e-3
    assert np.abs(own.alpha - other.alpha).max() < 5e-3


def test_networks_distilled_from_the_surface_itself_learn_its_colour(lit: LitObject) -> None:
    """A teacher without error: what is left is what lamps that are not drawn anew cost."""
    grid, voxel = grid_for(lit)
    lamps = draw_lamps(256, 3, NOTHING)
    lessons = with_lamps(draw_lessons(lit, STUDENTS.places, voxel, 3, NOTHING), lamps, 2, 0.2, 3)
    depth = {tuple(point): each for point, each in zip(lessons.points, lessons.depth, strict=True)}

    def ask(
        points: AnyArray, _views: AnyArray, lights: AnyArray, extras: AnyArray
    ) -> tuple[AnyArray, AnyArray]:
        cosine = np.clip(np.einsum("nx,nx->n", lights, extras[:, 1:]), 0.0, None)
        density = np.array([depth[tuple(point)] for point in points], np.float32)
        return density, (extras[:, 0] * cosine)[:, None] * np.array(COLOUR, np.float32)

    taught = distilled(ask, lessons)
    training = CellTraining(STUDENTS, grid, taught, lamps[:0], OPAQUE / voxel, 3, 1)
    while not training.done:
        training.step_epoch()
    spread = np.sqrt(taught.colours + 1e-3).std()
    assert np.mean(training.losses) < 0.5 * spread


@needs_torch
@pytest.mark.parametrize("teaching", ["beside", "distilled"])
def test_an_objects_errors_tell_its_teachers(lit: LitObject, tmp_path: Path, teaching: Teaching) -> None:
    size = replace(STUDENTS.size, kind="osf")
    strict = replace(STUDENTS, size=size, steps=20)
    teachers = (replace(TINY, steps=8), replace(TINY, steps=8, kind="osf"))
    profile = VisionProfile(replace(STUDENTS, steps=20), 1, strict, 24, 2, teachers)
    folder = tmp_path / "object"
    folder.mkdir()
    made = author_vision(lit.appearance, profile, 0, folder, lambda _what, _share: None, 1, teaching)
    for word in ("", STRICT):
        for name in ("psnr_db", "two_rays_psnr_db", "one_sample_ssim"):
            assert np.isfinite(made.errors[f"{word}{TEACHER}{name}"])
    assert made.settings["teaching"] == teaching
    assert teacher_file(folder, "osf").is_file()
    assert not [each for each in folder.iterdir() if "teacher" in each.name]


def test_without_torch_it_is_said_in_plain_words(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(WrongUse, match="torch, which is not installed; install the extra 'author'"):
        require_torch()


def test_what_cannot_be_a_teacher_is_refused() -> None:
    for wrong in ({"width": 0}, {"finest": 2}, {"slots": 0}, {"steps": 1}, {"kind": "other"}):
        with pytest.raises(WrongUse):
            replace(TINY, **wrong)
    with pytest.raises(WrongUse, match="no teacher of kind 'osf'"):
        vision_profile("smoke").teacher("osf")
