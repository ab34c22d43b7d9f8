"""Mitsuba and the direct level: two programs, one picture, wherever no light bounces."""

import numpy as np
import pytest

from harness.basics.errors import OutOfDomain, WrongUse
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance, plain
from harness.sim.light.appearance_source import builtin_appearance
from harness.sim.light.direct_image import DirectImage, LitObject
from tests.oracles.seen_shapes import ball, square
from tests.oracles.traced.mitsuba_variant import ALWAYS, FAST, chosen_variant
from tests.oracles.traced.path_traced import PathTraced, TracedImage

UP = (0.0, 0.0, 1.0)
GREY = (0.8, 0.5, 0.2)
ASLANT = DirectionalLight(np.array([0.5, -0.6, 0.7]))


@pytest.fixture(scope="module")
def _mitsuba() -> None:
    pytest.importorskip("mitsuba", reason="the extra 'oracles' is not installed")


def seen_from(eye: tuple[float, float, float], target: tuple[float, float, float] = (0, 0, 0)) -> Pinhole:
    whole = Pinhole.looking_at(eye, target, UP, 40, 28, 0.45)
    # Off the middle, as a real camera's axis is.
    return Pinhole(40, 28, whole.focal_px, (22.0, 12.5), whole.object_from_camera)


def apart(traced: TracedImage, direct: DirectImage) -> tuple[float, float]:
    """Root mean square difference, and what both say that it may be."""
    assert direct.noise is not None
    difference = traced.image.colour - direct.image.colour
    return float(np.sqrt(np.mean(difference**2))), float(np.hypot(traced.noise, direct.noise))


@pytest.mark.usefixtures("_mitsuba")
@pytest.mark.parametrize("shadow", [True, False])
@pytest.mark.parametrize("name", ["ball", "mug"])
def test_without_bounces_both_levels_are_the_same_within_their_noise(name: str, shadow: bool) -> None:
    look = plain(ball(0.05, 4), GREY) if name == "ball" else builtin_appearance("mug", edge=4e-3)
    middle = (0.0, 0.0, 0.0) if name == "ball" else (0.0, 0.0, 0.05)
    camera = seen_from((0.2, -0.2, 0.2), middle)
    traced = PathTraced(look).render(camera, [ASLANT], 144, shadow)
    direct = LitObject(look).render(camera, [ASLANT], 12, shadow)
    difference, allowed = apart(traced, direct)
    # Noise is at outlines, and known from as many pixels as these have: three standard errors of its size.
    outline = int(((direct.image.alpha > 0.0) & (direct.image.alpha < 1.0)).sum())
    unsure = 1.0 + 3.0 / np.sqrt(outline)
    assert difference < unsure * allowed
    covered = traced.image.alpha - direct.image.alpha
    assert np.sqrt(np.mean(covered**2)) < unsure * np.hypot(traced.alpha_noise, direct.alpha_noise or 0.0)
    # No side is brighter: the mean over the picture is known better by the root of its pixels.
    mean = np.abs((traced.image.colour - direct.image.colour).mean(axis=(0, 1)))
    assert (mean < 4.0 * allowed / np.sqrt(camera.pixels)).all()


@pytest.mark.usefixtures("_mitsuba")
def test_a_plane_is_lamberts() -> None:
    traced = PathTraced(plain(square(10.0), GREY)).render(seen_from((0.0, -0.2, 0.4)), [ASLANT], 8)
    expected = np.array(GREY) * ASLANT.irradiance / np.pi * ASLANT.direction[2]
    # Mitsuba computes in single precision.
    np.testing.assert_allclose(traced.image.colour, np.broadcast_to(expected, (28, 40, 3)), rtol=1e-5)
    assert traced.noise < 1e-5
    np.testing.assert_array_equal(traced.image.alpha, 1.0)


@pytest.mark.usefixtures("_mitsuba")
def test_depth_is_the_direct_levels() -> None:
    look = plain(ball(0.05, 4), GREY)
    camera = seen_from((0.2, -0.2, 0.2))
    traced, direct = (
        PathTraced(look).render(camera, [ASLANT], 64),
        LitObject(look).render(camera, [ASLANT], 8),
    )
    inside = (traced.image.alpha > 0.999) & (direct.image.alpha > 0.999)
    assert inside.sum() > 50
    # A pixel's mean of a ball, by other places in it: far below what a pixel is wide (0.4 mm).
    np.testing.assert_allclose(traced.image.depth[inside], direct.image.depth[inside], atol=4e-4)
    np.testing.assert_array_equal(np.isfinite(traced.image.depth), traced.image.alpha > 0.0)


@pytest.mark.usefixtures("_mitsuba")
def test_light_that_bounces_is_added_and_costs_its_own_seconds() -> None:
    look = builtin_appearance("bowl", edge=5e-3)
    camera = seen_from((0.25, -0.25, 0.35), (0.0, 0.0, 0.03))
    traced = PathTraced(look)
    straight = traced.render(camera, [ASLANT], 36)
    bounced = traced.render(camera, [ASLANT], 36, bounces=2)
    more = bounced.image.colour - straight.image.colour
    assert more.mean() > 5.0 * np.hypot(bounced.noise, straight.noise) / np.sqrt(camera.pixels)
    assert list(straight.seconds) == ["direct"]
    assert list(bounced.seconds) == ["indirect"]
    both = traced.render(camera, [ASLANT], 36, shadow=False, bounces=1)
    assert list(both.seconds) == ["unshadowed", "indirect", "direct"]


@pytest.mark.usefixtures("_mitsuba")
def test_one_seed_gives_one_picture() -> None:
    traced = PathTraced(plain(ball(0.05, 2), GREY))
    camera = seen_from((0.2, -0.2, 0.2))
    one, again, other = (traced.render(camera, [ASLANT], 8, seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(one.image.colour, again.image.colour)
    assert np.abs(one.image.colour - other.image.colour).max() > 0.0


@pytest.mark.usefixtures("_mitsuba")
def test_without_light_an_object_is_black_and_there() -> None:
    traced = PathTraced(plain(ball(0.05, 2), GREY)).render(seen_from((0.2, -0.2, 0.2)), [], 8)
    np.testing.assert_array_equal(traced.image.colour, 0.0)
    assert traced.image.alpha.max() == 1.0


@pytest.mark.usefixtures("_mitsuba")
def test_a_broken_compiler_is_found_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "/no/such/compiler.so")
    chosen_variant.cache_clear()
    chosen = chosen_variant(FAST)
    chosen_variant.cache_clear()
    assert chosen.name == ALWAYS
    assert FAST in chosen.because


@pytest.mark.usefixtures("_mitsuba")
def test_bad_questions_are_refused() -> None:
    with pytest.raises(WrongUse, match="abacus"):
        chosen_variant("abacus")
    traced, camera = PathTraced(plain(ball(0.05, 1), GREY)), seen_from((0.2, -0.2, 0.2))
    with pytest.raises(OutOfDomain, match="2 samples"):
        traced.render(camera, [ASLANT], 1)
    with pytest.raises(OutOfDomain, match="bounces"):
        traced.render(camera, [ASLANT], 4, bounces=-1)


@pytest.mark.usefixtures("_mitsuba")
def test_tinted_textures_are_named_as_not_there_yet() -> None:
    mesh = square(1.0)
    texture = np.full((1, 1, 3), 128, np.uint8)
    look = plain(mesh, GREY)
    tinted = Appearance(mesh, look.normals, look.tints, look.places, np.zeros(2, np.int64), (texture,))
    with pytest.raises(NotImplementedError, match="mitsuba_scene"):
        PathTraced(tinted)


def test_without_mitsuba_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    chosen_variant.cache_clear()
    with pytest.raises(WrongUse, match="'oracles'"):
        chosen_variant()
