"""What imported senses promise beyond the formulas: domains, loudness, company, refusals of damage."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.answers import QuerySettings, answer_queries
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.published.look import CellNetworks, PublishedLook
from harness.objectfile.published.sound import (
    compat_sounds,
    mode_gains,
    peak_normalised,
    spectrum_sounds,
    sum_modes,
)
from harness.objectfile.published.touch import TaximPicture, table_colours, touch_images, touch_maps
from harness.objectfile.verify import verify
from tests.samples.object_bench import egg_file
from tests.samples.published_objects import committed_object, without_bounds


@pytest.fixture(scope="module")
def second() -> Any:
    return committed_object("kilo")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Any:
    return without_bounds(tmp_path_factory.mktemp("published") / "old")


POINT = np.array([[0.0, 0.02, 0.05]])


def test_a_mode_rings_as_it_is_written() -> None:
    times = np.arange(4410) / 44100
    found = sum_modes(np.array([[2.0], [-1.0]]), np.array([440.0]), np.array([3.0]), 4410, 44100.0)
    assert found[0] == pytest.approx(2.0 * np.exp(-3.0 * times) * np.sin(2 * np.pi * 440 * times), abs=1e-12)
    assert found[1] == pytest.approx(-0.5 * found[0])


def test_a_compatible_sound_knows_the_sign_of_a_force_and_not_its_size(second: Any) -> None:
    entry, force = second.description.audio_gains, np.array([0.2, -0.7, 1.0])
    amplitudes = mode_gains(second, entry, POINT) @ force
    modes = np.array(entry.frequencies_hz), np.abs(entry.dampings_per_s)
    one, ten, back = (compat_sounds(scale * amplitudes, *modes)[0] for scale in (1.0, 10.0, -1.0))
    assert one.shape == (132300,)
    assert not one[:2].any()
    assert not one[2 + 88200 :].any()
    assert np.abs(one).max() == 1.0
    assert ten == pytest.approx(one)
    assert back == pytest.approx(-one)


@pytest.mark.parametrize("name", ["kilo", "first"])
def test_a_force_of_zero_and_a_silent_sound_are_refused_and_never_divided_by(
    name: str, tmp_path: Path
) -> None:
    rows = np.repeat(POINT, 2, axis=0), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    settings = QuerySettings(8, 0.1, 44100.0, compat=False, calibration=None, metres_per_unit=None)
    with pytest.raises(OutOfDomain, match="force 1 is zero"):
        answer_queries(committed_object(name), {"audio": rows}, settings, tmp_path)
    with pytest.raises(OutOfDomain, match="silent"):
        peak_normalised(np.zeros((1, 5)))


def test_a_strike_outside_of_the_trained_box_is_refused(second: Any) -> None:
    with pytest.raises(OutOfDomain, match="strike 0"):
        mode_gains(second, second.description.audio_gains, POINT + 1.0)


@pytest.mark.parametrize(
    ("press", "said"),
    [
        ((0.3, 0.0, 1e-3), r"tilt 0 at \(17.1887\) deg"),
        ((-0.01, 0.0, 1e-3), r"tilt 0 at \(-0.57"),
        ((0.0, 0.0, 2.1e-3), r"depth 0 at \(2.1\) mm"),
        ((0.0, 0.0, 2e-3 + 1e-9), r"depth 0 at \(2\) mm"),
        ((0.0, 0.0, 0.4e-3), r"depth 0 at \(0.4\) mm"),
    ],
)
def test_a_press_that_was_not_trained_is_refused(second: Any, press: tuple[float, ...], said: str) -> None:
    with pytest.raises(OutOfDomain, match=said):
        touch_maps(second, second.description.touch_depth, POINT, np.array([press]))


def test_presses_at_the_limits_are_allowed_and_an_azimuth_is_an_angle(second: Any) -> None:
    gel = np.array([[np.radians(15), 1.0, 2e-3], [np.radians(15), 1.0 + 2 * np.pi, 2e-3], [0.0, 0.0, 0.5e-3]])
    maps = touch_maps(second, second.description.touch_depth, np.repeat(POINT, 3, axis=0), gel)
    assert np.isfinite(maps).all()
    assert maps[0] == pytest.approx(maps[1], rel=1e-3)


def test_a_look_answers_a_point_alike_in_any_company(second: Any) -> None:
    field = PublishedLook.open(second, second.description.vision).coarse
    random = np.random.default_rng(0)
    points, views = random.uniform(-0.6, 0.6, (500, 3)), random.normal(size=(500, 3))
    light = np.array([0.0, 0.6, 0.8])
    together = field(points, views, light)
    assert together.any()
    apart = np.concatenate([field(points[k : k + 7], views[k : k + 7], light) for k in range(0, 500, 7)])
    assert apart == pytest.approx(together, rel=1e-5, abs=1e-5)


def test_a_thousandth_within_the_faces_of_its_cube_a_look_is_empty(second: Any) -> None:
    entry = second.description.vision
    cells = CellNetworks.open(second, entry.cells, second.network(entry.network))
    field = replace(cells, networks=np.zeros_like(cells.networks), occupied=None).raw
    inward = np.array([0.0, 0.9e-3, 1.1e-3, 0.1])
    for axis in range(3):
        for side in (-1.0, 1.0):
            points = np.full((4, 3), 0.11)
            points[:, axis] = side * (0.6 - inward)
            found = field(points, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([0.0, 0.0, 1.0]))
            assert found.any(axis=1).tolist() == [False, False, True, True]


def test_a_sense_of_version_1_without_bounds_refuses_in_one_sentence(first: Any) -> None:
    entry = first.description.audio_spectrum
    with pytest.raises(WrongUse, match="--audio-bounds LOW HIGH"):
        spectrum_sounds(first, entry, POINT, np.ones((1, 3)))
    with pytest.raises(WrongUse, match="--touch-bounds LOW HIGH"):
        touch_images(first, first.description.touch_colours, POINT)


def test_with_the_querys_bounds_a_touch_depends_on_its_company_and_with_given_ones_not(first: Any) -> None:
    near, far = np.array([[0.01, 0.02, 0.03]]), np.array([[0.01, 0.02, 0.03], [0.05, 0.05, 0.12]])
    known: Any = committed_object("first")
    entry = first.description.touch_colours
    alone, company = (touch_images(first, entry, each, of_query=True)[0] for each in (near, far))
    assert not np.array_equal(alone, company)
    entry = known.description.touch_colours
    assert np.array_equal(*(touch_images(known, entry, each)[0] for each in (near, far)))
    with pytest.raises(OutOfDomain, match="press 0"):
        touch_images(known, entry, np.array([[0.0, 0.0, 0.2]]))


def test_an_untouched_gel_is_seen_as_its_background(tmp_path: Path) -> None:
    folder, rest = _pack(tmp_path), _dome()
    optics = TaximPicture.open(folder, (24, 32))
    untouched = 0.04 - rest * 0.1245e-3
    base = np.broadcast_to([10.0, 20.0, 30.0], (24, 32, 3))
    contact = optics.colours(untouched, -1.0)  # everything counts as contact, so that nothing is blurred
    assert contact == pytest.approx(base, abs=1e-6)
    assert (optics.compat_image(untouched, -1.0)[..., ::-1] <= optics.image(untouched, -1.0)).all()


def test_a_table_is_looked_up_by_steepness_and_direction_of_each_place() -> None:
    bins = 9
    table = np.zeros((bins, bins, 6, 3))
    table[..., 5, 0] = np.arange(bins)[:, None]
    table[..., 5, 1] = np.arange(bins)[None]
    table[..., 3, 2] = 1.0
    for down, right in ((0.0, 1.0), (1.0, 0.0), (-2.0, 0.5), (0.0, 0.0)):
        y, x = np.mgrid[:5, :6].astype(float)
        found = table_colours(down * y + right * x, table)
        steep = int(np.arctan(np.hypot(down, right)) / (0.5 * np.pi / (bins - 1)))
        turned = int((np.arctan2(down, right) + np.pi) / (2 * np.pi / (bins - 1)))
        assert (found[..., 0] == steep).all()
        assert (found[..., 1] == turned).all()
        assert (found[..., 2] == x).all()


def test_the_published_calibration_shows_the_untouched_gel(shared_data: Path) -> None:
    folder = shared_data / "tactile/objectfolder_calibs"
    optics = TaximPicture.open(folder, (120, 160))
    assert optics.base[..., ::-1] == pytest.approx(np.load(folder / "real_bg.npy"), abs=1e-6)
    rest = np.load(folder / "depth_bg.npy").astype(float)
    seen = optics.compat_image(0.04 - rest * 0.1245e-3, -1.0)
    assert np.abs(seen.astype(int) - np.load(folder / "dataPack.npz")["f0"]).max() <= 1


def _dome() -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    y, x = np.mgrid[:24, :32] - np.array([11.5, 15.5])[:, None, None]
    return np.asarray(np.sqrt(60.0**2 - x * x - y * y), np.float64)


def _pack(folder: Path) -> Path:
    table = np.random.default_rng(0).normal(size=(16, 16, 6)) * np.array([1e-3, 1e-3, 1e-3, 0.01, 0.01, 1.0])
    np.savez(folder / "polycalib.npz", bins=16, grad_r=table, grad_g=2 * table, grad_b=3 * table)
    frame = np.empty((24, 32, 3), np.uint8)
    frame[...] = (30, 20, 10)
    np.savez(folder / "dataPack.npz", f0=frame)
    np.save(folder / "depth_bg.npy", _dome())
    return folder


def test_a_folder_of_either_kind_is_not_taken_for_the_other(second: Any, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="object render queries"):
        ObjectFile.open(second.folder)
    with pytest.raises(WrongUse, match="ObjectFile"):
        PublishedObject.open(egg_file(tmp_path / "built").folder)


def test_everything_of_an_imported_folder_is_verified_and_damage_is_found(tmp_path: Path) -> None:
    of: Any = PublishedObject.open(shutil.copytree(committed_object("osf").folder, tmp_path / "mug"))
    assert all(check.passed for check in verify(of))
    path = of.folder / "vision_fine.onnx"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))
    assert "vision_fine.onnx: bytes" in [check.check for check in verify(of) if not check.passed]
    (of.folder / "audio.onnx").unlink()
    with pytest.raises(DataRefused, match=r"audio\.onnx"):
        mode_gains(of, of.description.audio_gains, POINT)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": 2}, "schema 2"),
        ({"kind": "borrowed"}, "kind"),
        ({"colour": "red"}, "colour"),
        ({"format": "ObjectFolder 3.0"}, "format"),
    ],
)
def test_a_description_of_another_kind_is_refused(
    second: Any, change: dict[str, object], said: str, tmp_path: Path
) -> None:
    tree = json.loads((second.folder / "object.json").read_text())
    (tmp_path / "object.json").write_text(json.dumps(tree | change))
    with pytest.raises((DataRefused, WrongUse), match=said if said != "kind" else "ObjectFile"):
        PublishedObject.open(tmp_path)
