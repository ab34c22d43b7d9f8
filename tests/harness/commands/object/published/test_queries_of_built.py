"""ObjectFolder's query files answered by objects built from their meshes, as by their own commands."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from harness.cli import invoke
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.vision.render import open_vision
from harness.picture.image_file import read_image
from harness.picture.pinhole import DirectionalLight, Pinhole, unit_vector
from harness.sim.gel.press_pose import Presses, contact_place
from tests.samples.look_bench import BOX, box_file
from tests.samples.object_bench import egg_file
from tests.samples.touch_bench import ball_file


def answered(
    folder: Path, out: Path, capsys: pytest.CaptureFixture[str], code: int, *options: str
) -> dict[str, Any]:
    assert invoke(["object", "render", "queries", str(folder), "--out", str(out), *options, "--json"]) == code
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def saved(path: Path, rows: Any) -> str:
    np.save(path, rows)
    return str(path)


def test_a_compatible_sound_is_the_sum_of_its_own_modes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = egg_file(tmp_path / "egg")
    vertices, forces = of.mesh.vertices[[3, 40]], np.array([[0.0, -1.0, 0.5], [2.0, 0.0, 0.0]])
    files = (
        "--audio-vertices",
        saved(tmp_path / "v.npy", vertices),
        "--audio-forces",
        saved(tmp_path / "f.npy", forces),
    )
    said = answered(of.folder, tmp_path / "out", capsys, 0, *files, "--objectfolder-compat")
    sound = open_audio(of)
    times = np.arange(88200) / 44100
    for path, gains, force in zip(said["files"]["audio"], sound.at(vertices), forces, strict=True):
        turns = np.sqrt((2 * np.pi * sound.frequencies) ** 2 - sound.dampings**2)[:, None] * times
        ring = ((gains @ force)[:, None] * np.exp(-sound.dampings[:, None] * times) * np.sin(turns)).sum(
            axis=0
        )
        rate, heard = wavfile.read(path)
        assert (rate, len(heard)) == (44100, 132300)
        assert heard[2:88202] == pytest.approx(ring / np.abs(ring).max(), abs=1e-6)
        assert not heard[:2].any()
        assert not heard[88202:].any()


def test_sounds_of_one_file_have_one_full_scale(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    of = egg_file(tmp_path / "egg")
    vertices, forces = of.mesh.vertices[[3, 3]], np.array([[0.0, -1.0, 0.5], [0.0, -10.0, 5.0]])
    files = (
        "--audio-vertices",
        saved(tmp_path / "v.npy", vertices),
        "--audio-forces",
        saved(tmp_path / "f.npy", forces),
    )
    said = answered(of.folder, tmp_path / "out", capsys, 0, *files, "--seconds", "0.2")
    one, ten = (wavfile.read(path)[1].astype(float) for path in said["files"]["audio"])
    assert np.abs(ten).max() / np.abs(one).max() == pytest.approx(10.0, rel=1e-4)


def test_a_touch_is_that_of_the_objects_own_networks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of = ball_file(tmp_path / "ball")
    vertices, gel = of.mesh.vertices[[5, 60]], np.array([[0.0, 0.0, 0.8e-3], [0.1, 2.0, 1e-3]])
    files = (
        "--touch-vertices",
        saved(tmp_path / "v.npy", vertices),
        "--touch-gelinfo",
        saved(tmp_path / "g.npy", gel),
    )
    said = answered(of.folder, tmp_path / "out", capsys, 0, *files)
    for number, (vertex, (tilt, azimuth, depth)) in enumerate(zip(vertices, gel, strict=True)):
        place = contact_place(of.mesh, vertex)
        press = Presses.one(place.point, place.normal, depth, tilt, azimuth, 0.0)
        assert np.array_equal(np.load(said["files"]["touch"][2 * number]), open_touch(of).at(press)[0])
        assert read_image(Path(said["files"]["touch"][2 * number + 1])).any()


@pytest.mark.parametrize("compat", [False, True])
def test_a_picture_is_that_of_a_camera_about_the_middle(
    compat: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of, size = box_file(tmp_path / "box"), 256 if compat else 40
    eye = 2.5 * unit_vector(np.array([1.0, -0.5, 0.8]), "the eye")
    rows = saved(tmp_path / "views.npy", [[*eye, 0.0, -0.6, 0.8]])
    more = ("--objectfolder-compat",) if compat else ("--size", str(size))
    said = answered(
        of.folder, tmp_path / "out", capsys, 0, "--vision", rows, "--metres-per-unit", "10cm", *more
    )
    middle = BOX.bounds.mean(axis=0)
    angle = 2.0 * np.arctan(128.0 / 355.5555419921875)
    camera = Pinhole.looking_at(middle + 0.1 * eye, middle, [0.0, 0.0, 1.0], size, size, angle)
    if compat:
        centre = (0.5 * size + 0.5, 0.5 * size + 0.5)
        camera = Pinhole(size, size, camera.focal_px, centre, camera.object_from_camera)
    wanted = open_vision(of, 1).picture(camera, DirectionalLight(np.array([0.0, -0.6, 0.8]))).image.display()
    found = read_image(Path(said["files"]["vision"][0]))
    assert 0.05 < (found != 255).any(axis=2).mean() < 0.95
    assert np.abs(found.astype(int) - wanted).max() <= 1


def test_what_a_built_object_is_not_told_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of, views = box_file(tmp_path / "box"), saved(tmp_path / "views.npy", [[2.5, 0.0, 0.0, 0.0, 0.0, 1.0]])
    points = saved(tmp_path / "v.npy", of.mesh.vertices[:1])
    for options, part in (
        (("--vision", views), "--metres-per-unit go together"),
        (("--touch-vertices", points), "--touch-vertices and --touch-gelinfo go together"),
        (("--audio-vertices", points, "--audio-forces", points), "has no sound"),
        ((), "no query file"),
    ):
        assert (
            part
            in answered(of.folder, tmp_path / "out", capsys, 1 if "sound" in part else 2, *options)["error"]
        )
