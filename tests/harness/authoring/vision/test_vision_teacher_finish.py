"""A teacher finished on pictures sees along their rays what the renderer draws, and comes nearer to them."""

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.finish_profiles import TeacherFinish
from harness.authoring.vision.lessons import OPAQUE
from harness.authoring.vision.seen import SeenRays, TeacherRecorder, pictures_to_learn, together
from harness.authoring.vision.teacher import finished_file, made_teacher
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.vision.settings import RenderSettings
from harness.picture.pinhole import DirectionalLight
from harness.sim.light.direct_image import LitObject
from tests.samples.taught_ball import COLOUR, NOTHING, RADIUS, grid_for, lit_ball

FINISH = TeacherFinish(pictures=2, side=24, samples=2, steps=6, epochs=3, rays=64)
TINY = TeacherSpec(
    width=16, turns=1, coarsest=4, finest=8, levels=2, features=2, slots=8, places=6000, steps=60, epochs=2,
    batch=256, finish=FINISH,
)  # fmt: skip
needs_torch = pytest.mark.skipif(
    importlib.util.find_spec("torch") is None, reason="teachers are trained by torch, of the extra 'author'"
)


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


def thin(points: AnyArray, _views: AnyArray, lights: AnyArray, extras: AnyArray) -> tuple[AnyArray, AnyArray]:
    """So thin that no ray ends, and of another colour everywhere."""
    density = np.full(len(points), 0.002, np.float32)
    cosine = np.clip(np.einsum("nx,nx->n", lights, extras[:, 1:]), 0.0, None)
    return density, ((0.2 + 0.8 * cosine)[:, None] * (0.5 + points / (4.0 * RADIUS))).astype(np.float32)


def seen_by(lit: LitObject, irradiance: float = np.pi) -> tuple[TeacherRecorder, SeenRays, AnyArray]:
    grid, voxel = grid_for(lit)
    mesh = lit.appearance.mesh
    recorder = TeacherRecorder(thin, mesh, grid, "osf-v", OPAQUE / voxel)
    camera = held_out_pictures(mesh, 1, 32, 32, 5).cameras[0]
    light = DirectionalLight(camera.eye + np.array([0.02, 0.05, 0.0]), irradiance)
    exact = lit.render(camera, [light], 3).image
    rays = recorder.seen(camera, light, exact)
    drawn = recorder.render(camera, light, RenderSettings(termination=0.0)).image
    shown = np.column_stack([drawn.colour.reshape(-1, 3), drawn.alpha.reshape(-1)])
    return recorder, rays, shown[(exact.alpha * drawn.alpha).reshape(-1) > 0.0]


def composited(rays: SeenRays, ask, scale: float) -> tuple[AnyArray, AnyArray]:  # type: ignore[no-untyped-def]
    """Plainly, ray by ray, in float64: colours and what goes through."""
    every = np.diff(rays.first)
    each = (np.repeat(told, every, axis=0) for told in (rays.views, rays.lights, rays.extras))
    density, colour = ask(rays.points, *each)
    found, through = np.zeros((len(rays), 3)), np.ones(len(rays))
    for ray in range(len(rays)):
        for s in range(rays.first[ray], rays.first[ray + 1]):
            passed = np.exp(-scale * float(density[s]) * float(rays.lengths[s]))
            found[ray] += through[ray] * (1.0 - passed) * colour[s]
            through[ray] *= passed
    return found, through


def test_what_is_kept_of_rays_is_what_the_picture_was_made_of(lit: LitObject) -> None:
    """Rays composited plainly are the renderer's pixels, in their order, whatever the lamp's strength."""
    _, voxel = grid_for(lit)
    _, rays, pixels = seen_by(lit)
    found, through = composited(rays, thin, OPAQUE / voxel)
    assert len(rays) == len(pixels) > 100
    assert np.diff(rays.first).min() >= 1
    # Partly through, so that order and lengths matter.
    assert 0.05 < np.median(through) < 0.9
    # The renderer's own share of each pixel, which its colour and coverage have in common.
    cover = pixels[:, 3] / (1.0 - through)
    assert cover.max() < 1.001
    assert cover[:, None] * found == pytest.approx(pixels[:, :3], abs=2e-4)


def test_what_is_wanted_of_rays_is_the_exact_colour_whatever_the_lamp(lit: LitObject) -> None:
    for irradiance in (np.pi, 1.0):
        _, rays, _ = seen_by(lit, irradiance=irradiance)
        cosine = np.clip(np.einsum("nx,nx->n", rays.lights, rays.extras[:, 1:]), 0.0, None)
        inside = (rays.weight == 1.0) & (rays.extras[:, 0] == 1.0) & (cosine > 0.2)
        assert inside.sum() > 50
        assert rays.wanted[inside] == pytest.approx(cosine[inside, None] * np.array(COLOUR), abs=0.05)


def test_rays_of_pictures_keep_their_own_samples_together(lit: LitObject) -> None:
    _, rays, _ = seen_by(lit)
    both = together([rays, rays])
    assert len(both) == 2 * len(rays)
    assert both.first[-1] == 2 * rays.first[-1] == len(both.points)
    assert np.array_equal(np.diff(both.first), np.tile(np.diff(rays.first), 2))


@needs_torch
def test_shares_of_light_are_those_of_a_plain_walk() -> None:
    import torch

    from harness.authoring.vision.teacher_finish import shares_of

    thick = np.random.default_rng(2).exponential(0.5, size=(40, 7)).astype(np.float32)
    thick[0], thick[1, 3] = 0.0, 1e4
    left, wanted = np.ones(40), np.empty((40, 7))
    for k in range(7):
        wanted[:, k] = left * -np.expm1(-thick[:, k].astype(np.float64))
        left *= np.exp(-thick[:, k].astype(np.float64))
    found = shares_of(torch.from_numpy(thick)).numpy()
    assert found == pytest.approx(wanted, abs=3e-6)
    assert found.sum(axis=1) == pytest.approx(1.0 - left, abs=3e-6)


def taught(lit: LitObject, folder: Path, spec: TeacherSpec = TINY):  # type: ignore[no-untyped-def]
    return made_teacher(lit, NOTHING, spec, 3, folder / "teacher.npz", lambda _what, _share: None, 1)


def answers_of(made) -> AnyArray:  # type: ignore[no-untyped-def]
    way = np.eye(3, dtype=np.float32)
    extras = np.hstack([np.ones((3, 1), np.float32), way])
    return np.hstack([np.c_[each] for each in made.ask(RADIUS * np.eye(3), -way, way, extras)])


class StoppedError(Exception):
    """In the middle of a training."""


@needs_torch
def test_a_stopped_finish_ends_in_the_same_bits(
    lit: LitObject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from harness.authoring.vision.teacher_finish import Finishing

    whole, broken = tmp_path / "whole", tmp_path / "broken"
    whole.mkdir()
    broken.mkdir()
    wanted = answers_of(taught(lit, whole))
    step = Finishing.step_epoch

    def stopping(self: Finishing) -> float:
        if self.epoch == 2:
            raise StoppedError
        return step(self)

    with monkeypatch.context() as patched:
        patched.setattr(Finishing, "step_epoch", stopping)
        with pytest.raises(StoppedError):
            taught(lit, broken)
    assert finished_file(broken / "teacher.npz").exists()
    again = taught(lit, broken)
    assert answers_of(again).tobytes() == wanted.tobytes()
    assert again.settings["finish_steps"] == FINISH.steps
    # And a finished one is only read again, as is the first stage without the second.
    assert answers_of(taught(lit, whole)).tobytes() == wanted.tobytes()
    alone = answers_of(taught(lit, whole, replace(TINY, finish=None)))
    assert not np.array_equal(alone, wanted)
    with pytest.raises(DataRefused, match="of another network, object, data or seed"):
        taught(lit, whole, replace(TINY, finish=replace(FINISH, rays=32)))


@needs_torch
def test_pictures_bring_a_teacher_nearer_to_them(lit: LitObject, tmp_path: Path) -> None:
    """Of pictures that it learned from, errors are less than half of what they were, plainly composited."""
    grid, voxel = grid_for(lit)
    short = replace(TINY, places=2000, steps=8, finish=None)
    finish = replace(FINISH, steps=150, rays=256, slower=1.0)
    (tmp_path / "a").mkdir()
    before = taught(lit, tmp_path / "a", short)
    after = taught(lit, tmp_path / "a", replace(short, finish=finish))
    errors = []
    for made in (before, after):
        recorder = TeacherRecorder(made.ask, lit.appearance.mesh, grid, "osf-v", OPAQUE / voxel)
        pictures = pictures_to_learn(lit, finish, 3, NOTHING, lambda _what, _share: None)
        rays = together([recorder.seen(*each) for each in pictures])
        found, _ = composited(rays, made.ask, OPAQUE / voxel)
        errors.append(np.sqrt(np.mean((found - rays.wanted) ** 2)))
    assert errors[1] < 0.5 * errors[0]


def test_what_finishes_nothing_is_refused() -> None:
    for wrong in ({"pictures": 0}, {"steps": 1}, {"rays": 0}, {"slower": 0.0}, {"weight": -1.0}):
        with pytest.raises(WrongUse):
            replace(FINISH, **wrong)
