"""Imported networks against the published formulas in float64: every head, to 1e-5 of its greatest number.

The folders of the exporter and of the importer before it are committed; where torch is installed the same
files are imported again.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.published.look import PublishedLook, views_of
from harness.objectfile.published.query import query
from harness.objectfile.published.sound import (
    COMPAT_RATE,
    compat_sounds,
    inverse_spectrum,
    mode_gains,
    spectrum_queries,
    spectrum_sounds,
)
from harness.objectfile.published.touch import touch_images, touch_maps
from tests.oracles import objectfolder_formulas as formulas
from tests.samples.published_objects import (
    AUDIO_BOUNDS,
    TOUCH_BOUNDS,
    TREES,
    committed_object,
    import_tree,
)

CLOSE = 1e-5
BOX = np.array([-0.06, -0.05, 0.01]), np.array([0.05, 0.09, 0.12])

Imported = tuple[dict[str, Any], Any]

MADE = [
    f"{by}: {name}" for by in ("exported", "hand_built", "now") for name in ("kilo", "osf", "first")
    if (by, name) != ("hand_built", "osf")
]  # fmt: skip
"""Folders that were imported by the exporter, by the importer before it, and by this test where torch is."""


def of_kind(*names: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("imported", [made for made in MADE if made.endswith(names)], indirect=True)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], PublishedObject]:
    @cache
    def find(made: str) -> PublishedObject:
        by, name = made.split(": ")
        if by != "now":
            return committed_object(name, by)
        pytest.importorskip("onnxscript", reason="the extra `author` is not installed")
        return import_tree(name, tmp_path_factory.mktemp("now") / name)

    return find


@pytest.fixture
def imported(request: pytest.FixtureRequest, opened: Callable[[str], PublishedObject]) -> Imported:
    return TREES[request.param.split(": ")[1]](), opened(request.param)


def points(count: int, seed: int = 5) -> FloatArray:
    found: FloatArray = BOX[0] + np.random.default_rng(seed).random((count, 3)) * (BOX[1] - BOX[0])
    return found


def directions(count: int, seed: int = 6) -> FloatArray:
    drawn = np.random.default_rng(seed).normal(size=(count, 3))
    found: FloatArray = drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
    return found


def apart(found: AnyArray, wanted: AnyArray) -> float:
    """Of the head's greatest number."""
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


@of_kind("kilo", "osf")
def test_gains_of_modes_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    entry = of.description.audio_gains
    found = mode_gains(of, entry, points(9))
    wanted = np.stack([formulas.gains(tree["AudioNet"], point) for point in points(9)])
    for axis in range(3):
        assert apart(found[..., axis], wanted[..., axis]) < CLOSE


@of_kind("kilo", "osf")
def test_distances_of_the_gel_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    vertices, gel = points(2), np.array([[0.1, 2.3, 0.7e-3], [0.25, -1.0, 1.9e-3]])
    maps = touch_maps(of, of.description.touch_depth, vertices, gel)
    assert maps.shape == (2, 120, 160)
    at = [(0, 0, 0), (0, 119, 3), (1, 7, 159), (1, 60, 80), (1, 118, 158)]
    wanted = [formulas.depth(tree["TouchNet"], vertices[n], gel[n], row, column) for n, row, column in at]
    assert apart(np.array([maps[place] for place in at]) - 0.0339, np.array(wanted) - 0.0339) < CLOSE


@of_kind("osf")
def test_one_network_of_a_look_is_that_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    look, state = of.description.vision, tree["VisionNet"]["model_state_dict"]
    places, views = np.random.default_rng(0).uniform(-1.0, 1.0, (9, 3)), directions(9)
    light = directions(1, 8)[0]
    opened: Any = PublishedLook.open(of, look)
    for prefix, network in zip(("model_coarse.", "model_fine."), (opened.coarse, opened.fine), strict=True):
        wanted = np.stack(
            [formulas.osf(state, prefix, 4, 1, p, v, light) for p, v in zip(places, views, strict=True)]
        )
        found = network(places, views, light)
        assert apart(found[:, :3], wanted[:, :3]) < CLOSE
        assert apart(found[:, 3], wanted[:, 3]) < CLOSE


@of_kind("kilo")
def test_the_networks_of_cells_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    places = np.random.default_rng(0).uniform(-0.61, 0.61, (300, 3))
    views, light = directions(300), directions(1, 8)[0]
    look = PublishedLook.open(of, of.description.vision)
    wanted = np.stack(
        [formulas.kilo(tree["VisionNet"], p, v, light) for p, v in zip(places, views, strict=True)]
    )
    found = look.coarse(places, views, light)
    nothing = ~wanted.any(axis=1)
    assert 40 < np.count_nonzero(nothing) < 260
    assert not found[nothing].any()
    assert apart(found[:, :3], wanted[:, :3]) < CLOSE
    assert apart(found[:, 3], wanted[:, 3]) < CLOSE


@of_kind("first")
def test_spectra_of_version_1_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    entry = of.description.audio_spectrum
    solid = tree["AudioNet"]["voxel_vertex"]
    place = (solid[0] - AUDIO_BOUNDS[0]) / (AUDIO_BOUNDS[1] - AUDIO_BOUNDS[0])
    values = query(of.network(entry.network), {"place": spectrum_queries(entry, place)})["spectrum"]
    found = (values[:, 0] + 1j * values[:, 1]).reshape(257, 201, 3)
    at = [(0, 0), (256, 200), (3, 150), (200, 9), (77, 78)]
    wanted = np.stack([formulas.spectrum(tree["AudioNet"], solid[0], AUDIO_BOUNDS, place) for place in at])
    assert apart(np.stack([found[place] for place in at]), wanted) < CLOSE


@of_kind("first")
def test_a_sound_of_version_1_is_that_of_the_nearest_voxels(imported: Imported) -> None:
    tree, of = imported
    entry, point, force = (
        of.description.audio_spectrum,
        np.array([0.02, 0.03, 0.12]),
        np.array([0.5, 0.0, -1.0]),
    )
    solid = tree["AudioNet"]["voxel_vertex"]
    far = np.linalg.norm(solid - (point + np.array([0.1, 0.05, 0.0])) * 4.0 * 32, axis=1)
    wanted = np.zeros(32000)
    for voxel in solid[np.argsort(far)[:4]]:
        places = spectrum_queries(entry, (voxel - AUDIO_BOUNDS[0]) / (AUDIO_BOUNDS[1] - AUDIO_BOUNDS[0]))
        values = query(of.network(entry.network), {"place": places})["spectrum"]
        wanted += inverse_spectrum(entry, (values[:, 0] + 1j * values[:, 1]) @ force)
    assert apart(spectrum_sounds(of, entry, point[None], force[None])[0], wanted) < 1e-9


@of_kind("first")
def test_colours_of_version_1_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    vertices = points(2)
    images = touch_images(of, of.description.touch_colours, vertices)
    assert images.shape == (2, 160, 120, 3)
    for n, row, column in [(0, 0, 0), (0, 159, 2), (1, 5, 119), (1, 80, 60)]:
        wanted = formulas.colour(tree["TouchNet"], vertices[n], TOUCH_BOUNDS, row, column)
        grey = np.clip((wanted + 1) / 2 * 255, 0, 255)
        assert np.abs(images[n, row, column] - grey).max() <= 0.5 + 255 * CLOSE * np.abs(wanted).max()


@of_kind("first")
def test_both_networks_of_a_look_of_version_1_are_those_of_the_published_formulas(imported: Imported) -> None:
    tree, of = imported
    places, views = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 3)), directions(3)
    light = directions(1, 8)[0]
    keys = ("network_fn_state_dict", "network_fine_state_dict")
    look: Any = PublishedLook.open(of, of.description.vision)
    for key, network in zip(keys, (look.coarse, look.fine), strict=True):
        state = tree["VisionNet"][key]
        wanted = np.stack(
            [formulas.osf(state, "", 8, 4, p, v, light) for p, v in zip(places, views, strict=True)]
        )
        assert apart(network(places, views, light), wanted) < CLOSE


@of_kind("kilo")
def test_a_compatible_sound_is_the_published_programs(imported: Imported) -> None:
    tree, of = imported
    entry = of.description.audio_gains
    force = np.array([0.3, -1.0, 2.0])
    amplitudes = mode_gains(of, entry, points(1)) @ force
    found = compat_sounds(amplitudes, np.array(entry.frequencies_hz), np.abs(entry.dampings_per_s))[0]
    assert COMPAT_RATE == 44100.0
    assert np.abs(found - formulas.ring(tree["AudioNet"], points(1)[0], force)).max() < CLOSE


@of_kind("first")
def test_a_spectrum_becomes_the_sound_that_overlapped_windows_make(imported: Imported) -> None:
    _, of = imported
    random = np.random.default_rng(0)
    spectrum = random.normal(size=(257, 201)) + 1j * random.normal(size=(257, 201))
    found = inverse_spectrum(of.description.audio_spectrum, spectrum)
    assert found.shape == (32000,)
    assert apart(found, formulas.inverse_stft(spectrum)) < 1e-12


@of_kind("kilo", "osf")
def test_a_compatible_picture_is_the_published_programs(imported: Imported) -> None:
    tree, of = imported
    look, size, eye, light = of.description.vision, 6, np.array([1.2, -1.5, 1.6]), np.array([0.0, -0.6, 0.8])
    eye *= 2.5 / np.linalg.norm(eye)
    view = views_of(np.array([[*eye, *light]]), 1.04, compat=True)[0]
    found = PublishedLook.open(of, look).picture(view, size, 0.0)
    rays, settings = formulas.camera_rays(eye, size), tree["VisionNet"]["cfg"]
    assert found.min() < 0.9  # the background is white
    for row, column in [(0, 0), (2, 3), (3, 3), (4, 1), (5, 5)]:
        ray = rays[row, column]
        depths = np.linspace(settings["near"], settings["far"], settings["num_samples_per_ray"])
        raw = _raw(tree, "model_coarse.", eye, ray, depths, light)
        colour, weights = formulas.ray_colour(raw, depths, ray)
        if settings["num_importance_samples_per_ray"]:
            depths = formulas.finer_depths(depths, weights, settings["num_importance_samples_per_ray"])
            colour, _ = formulas.ray_colour(_raw(tree, "model_fine.", eye, ray, depths, light), depths, ray)
        assert found[row, column] == pytest.approx(colour, abs=CLOSE)


def _raw(
    tree: dict[str, Any], prefix: str, eye: FloatArray, ray: FloatArray, depths: FloatArray, light: FloatArray
) -> FloatArray:
    look, view = tree["VisionNet"], ray / np.linalg.norm(ray)
    if "occupancy_grid" in look:
        return np.stack([formulas.kilo(look, eye + z * ray, view, light) for z in depths])
    state = look["model_state_dict"]
    return np.stack([formulas.osf(state, prefix, 4, 1, eye + z * ray, view, light) for z in depths])
