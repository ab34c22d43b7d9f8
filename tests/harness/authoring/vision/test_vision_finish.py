"""Tiny networks that are finished on pictures come nearer to them, and end in the same bits."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.finish import CellFinishing
from harness.authoring.vision.finish_profiles import CellsFinish
from harness.authoring.vision.lessons import OPAQUE, draw_lamps, draw_lessons
from harness.authoring.vision.pixels import shares_along
from harness.authoring.vision.profiles import CellsSpec
from harness.authoring.vision.seen import Exact, RayRecorder, pictures_to_learn, together
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import RenderSettings
from harness.objectfile.vision_tensors import Kind
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.direct_image import LitObject
from tests.samples.taught_ball import COLOUR, NOTHING, SIZE, TINY, grid_for, lit_ball

FINISH = CellsFinish(pictures=3, side=40, samples=2, rounds=2, steps=150, slower=1.0)


@pytest.fixture(scope="module")
def lit() -> LitObject:
    return lit_ball()


@pytest.fixture(scope="module")
def pictures(lit: LitObject) -> list[Exact]:
    said: list[float] = []
    found = pictures_to_learn(lit, FINISH, 3, NOTHING, lambda _what, share: said.append(share), threads=2)
    assert said == [0.0, 2 / 3]
    for camera, light, exact in found:
        assert np.array_equal(exact.colour, lit.render(camera, [light], FINISH.samples).image.colour)
    return found


def of_kind(kind: Kind) -> CellsSpec:
    return replace(TINY, size=replace(SIZE, kind=kind))


def taught(lit: LitObject, spec: CellsSpec = TINY, fade: float = 1.0, threads: int = 1) -> CellTraining:
    """To the end, on a surface that is so many times as bright."""
    grid, voxel = grid_for(lit)
    strict = spec.size.kind == "osf"
    lessons = draw_lessons(lit, spec.places, voxel, 3, NOTHING, 4 if strict else 0)
    lamps = draw_lamps(0 if strict else 256, 3, NOTHING)
    faded = replace(lessons, colours=np.float32(fade) * lessons.colours)
    training = CellTraining(spec, grid, faded, lamps, OPAQUE / voxel, 3, threads)
    while not training.done:
        training.step_epoch()
    return training


def finished(training: CellTraining, lit: LitObject, pictures: Sequence[Exact], finish: CellsFinish = FINISH):  # type: ignore[no-untyped-def]
    return CellFinishing(training, finish, lit.appearance.mesh, pictures)


def data_of(model: VisionModel) -> bytes:
    return vision_graph(model).SerializeToString()


def apart(model: VisionModel, lit: LitObject, pictures: Sequence[Exact]) -> float:
    """Root mean square of linear light."""
    renderer = VisionRenderer(data_of(model), lit.appearance.mesh, threads=1)
    drawn = [renderer.render(camera, light).image.colour - exact.colour for camera, light, exact in pictures]
    return float(np.sqrt(np.mean(np.square(drawn))))


@pytest.mark.parametrize("kind", ["osf-v", "osf"])
def test_what_is_kept_of_rays_is_what_the_picture_was_made_of(
    lit: LitObject, pictures: list[Exact], kind: Kind
) -> None:
    """Rays composited plainly are the renderer's pixels, and are asked as the networks are."""
    training = taught(lit, replace(of_kind(kind), steps=20))
    recorder = RayRecorder(data_of(training.finish()), lit.appearance.mesh)
    camera, light, exact = pictures[0]
    rays = recorder.seen(camera, light, exact)
    drawn = recorder.render(camera, light, RenderSettings()).image
    shares = shares_along(training.scale * rays.density.astype(np.float64) * rays.lengths, rays.first)
    found = np.add.reduceat(shares[:, None] * rays.scattered, rays.first[:-1])
    stopped = np.add.reduceat(shares, rays.first[:-1])
    both = (exact.alpha * drawn.alpha).reshape(-1) > 0.0
    pixels, alpha = drawn.colour.reshape(-1, 3)[both], drawn.alpha.reshape(-1)[both]
    shown = stopped > 0.0
    found, stopped = found[shown], stopped[shown]
    assert len(found) == len(pixels) > 200
    # Where rays are ended early, light is told as if all of it had been stopped.
    cover = alpha / np.where(stopped > 0.99, 1.0, stopped)
    assert cover[:, None] * found == pytest.approx(pixels, abs=2e-2)
    assert rays.extras.shape[1] == (4 if kind == "osf-v" else 0)
    inside = (rays.weight == 1.0) & (np.einsum("nx,nx->n", rays.lights, rays.views) < -0.2)
    assert np.median(rays.wanted[inside] / np.array(COLOUR), axis=1).max() < 1.01


def test_what_is_wanted_of_rays_is_the_exact_colour_whatever_the_lamp(
    lit: LitObject, pictures: list[Exact]
) -> None:
    recorder = RayRecorder(data_of(taught(lit, replace(TINY, steps=20)).finish()), lit.appearance.mesh)
    camera, lamp, _ = pictures[0]
    for irradiance in (np.pi, 1.0):
        light = DirectionalLight(lamp.direction, irradiance)
        rays = recorder.seen(camera, light, lit.render(camera, [light], 3).image)
        cosine = np.clip(np.einsum("nx,nx->n", rays.lights, rays.extras[:, 1:]), 0.0, None)
        inside = (rays.weight == 1.0) & (rays.extras[:, 0] == 1.0) & (cosine > 0.2)
        assert inside.sum() > 50
        assert rays.wanted[inside] == pytest.approx(cosine[inside, None] * np.array(COLOUR), abs=0.05)


def test_rays_of_pictures_keep_their_own_samples_together(lit: LitObject, pictures: list[Exact]) -> None:
    recorder = RayRecorder(data_of(taught(lit, replace(TINY, steps=20)).finish()), lit.appearance.mesh)
    rays = recorder.seen(*pictures[0])
    both = together([rays, rays])
    assert len(both) == 2 * len(rays)
    assert both.first[-1] == 2 * rays.first[-1] == len(both.points)
    assert np.array_equal(np.diff(both.first), np.tile(np.diff(rays.first), 2))


@pytest.mark.slow  # of the longest training alone
@pytest.mark.parametrize("kind", ["osf-v", "osf"])
def test_pictures_bring_networks_nearer_to_them(lit: LitObject, pictures: list[Exact], kind: Kind) -> None:
    """Taught a surface of half its colours, they have less than half of the error after pictures of it."""
    training = taught(lit, of_kind(kind), fade=0.5)
    before = apart(training.finish(), lit, pictures)
    finishing = finished(training, lit, pictures, replace(FINISH, share=0.9))
    while not finishing.done:
        finishing.step_epoch()
    assert apart(finishing.finish(), lit, pictures) < 0.5 * before


@pytest.mark.slow  # of the longest training alone
def test_a_stopped_finish_ends_in_the_same_bits_of_any_number_of_threads(
    lit: LitObject, pictures: list[Exact], tmp_path: Path
) -> None:
    whole, broken = (finished(taught(lit, threads=threads), lit, pictures) for threads in (1, 2))
    while not whole.done:
        whole.step_epoch()
    broken.step_epoch()
    kept = tmp_path / "kept.npz"
    broken.save(kept)
    again = finished(taught(lit, threads=2), lit, pictures)
    again.load(kept)
    again.step_epoch()
    assert again.done
    assert again.losses == whole.losses
    assert data_of(again.finish()) == data_of(whole.finish())
    others = (replace(FINISH, slower=0.5), pictures), (FINISH, pictures[:2])
    for finish, other in others:
        with pytest.raises(DataRefused, match="another network, object, data or seed"):
            finished(taught(lit), lit, other, finish).load(kept)


def test_cells_that_no_picture_shows_go_on_from_the_surface(lit: LitObject, pictures: list[Exact]) -> None:
    """One camera sees one side; of the other nothing is lost, and nothing is not a number."""
    training = taught(lit)
    before = apart(training.finish(), lit, pictures)
    finishing = finished(training, lit, pictures[:1])
    finishing.step_epoch()
    assert np.isfinite(training.flats).all()
    assert apart(finishing.finish(), lit, pictures) < 1.5 * before


@pytest.mark.slow  # of the longest training alone
def test_of_a_picture_that_shows_nothing_nothing_is_learned(lit: LitObject, pictures: list[Exact]) -> None:
    """Of a camera that looks away no ray asks anything; what is learned is what the surface says."""
    camera, light, exact = pictures[0]
    away = Pinhole.looking_at(camera.eye, 2.0 * camera.eye, (0.0, 0.0, 1.0), 40, 40, 0.5)
    nothing = LinearImage(*(np.zeros_like(each) for each in (exact.colour, exact.alpha, exact.depth)))
    training = taught(lit)
    before = apart(training.finish(), lit, pictures)
    rays = RayRecorder(data_of(training.finish()), lit.appearance.mesh).seen(away, light, nothing)
    assert len(rays) == len(rays.points) == 0
    finishing = finished(training, lit, [(away, light, nothing)])
    finishing.step_epoch()
    assert apart(finishing.finish(), lit, pictures) < 1.5 * before


def test_what_finishes_nothing_is_refused() -> None:
    for wrong in ({"pictures": 0}, {"rounds": 0}, {"steps": 0}, {"slower": 0.0}, {"share": 1.0}):
        with pytest.raises(WrongUse):
            replace(FINISH, **wrong)
