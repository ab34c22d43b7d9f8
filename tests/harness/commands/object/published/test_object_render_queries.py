"""``touchstone object import`` and ``object render queries``: files, one JSON object, and refusals."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from harness.cli import invoke
from harness.objectfile.published.entries import PublishedObject
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import require_self_test
from harness.picture.image_file import read_image
from tests.samples import published_trees
from tests.samples.published_files import write_published
from tests.samples.published_objects import committed_object, without_bounds

VIEW = [1.7678, 0.0, 1.7678, 0.0, -0.7071, 0.7071]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Imported objects of both versions, and query files."""
    folder = tmp_path_factory.mktemp("queries")
    shutil.copytree(committed_object("kilo").folder, folder / "mug")
    without_bounds(folder / "old")
    random, low, high = np.random.default_rng(0), np.array([-0.05, -0.04, 0.02]), np.array([0.04, 0.08, 0.11])
    np.save(folder / "vertices.npy", low + random.random((2, 3)) * (high - low))
    np.save(folder / "forces.npy", [[1.0, -2.0, 0.5], [10.0, -20.0, 5.0]])
    np.save(folder / "gel.npy", [[0.1, 2.0, 1e-3], [0.0, 0.0, 2e-3]])
    np.save(folder / "views.npy", [VIEW])
    return folder


def render(bench: Path, out: Path, which: str, *options: str) -> int:
    files = {"vertices": "vertices.npy", "forces": "forces.npy", "gel": "gel.npy", "views": "views.npy"}
    words = [str(bench / files[word[1:]]) if word.startswith("@") else word for word in options]
    return invoke(["object", "render", "queries", str(bench / which), "--out", str(out), *words, "--json"])


def answer(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_every_sense_is_rendered_into_files_named_as_published(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sound = ("--audio-vertices", "@vertices", "--audio-forces", "@forces")
    touch = ("--touch-vertices", "@vertices", "--touch-gelinfo", "@gel")
    assert render(bench, tmp_path, "mug", *sound, *touch, "--vision", "@views", "--size", "8") == 0
    said = answer(capsys)
    assert said["objectfolder_compat"] is False
    assert [Path(path).name for path in said["files"]["audio"]] == ["1.wav", "2.wav"]
    assert [Path(path).name for path in said["files"]["touch"]] == ["1.npy", "2.npy"]
    assert [Path(path).name for path in said["files"]["vision"]] == ["000.png"]
    assert np.load(said["files"]["touch"][0]).shape == (120, 160)
    assert read_image(Path(said["files"]["vision"][0])).shape == (8, 8, 3)
    assert any("--calibration" in note for note in said["notes"])
    assert any("half of 44100 Hz" in note for note in said["notes"])


def test_sounds_keep_their_loudness_unless_they_are_compatible(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "same.npy", np.repeat(np.load(bench / "vertices.npy")[:1], 2, axis=0))
    sound = ("--audio-vertices", str(tmp_path / "same.npy"), "--audio-forces", "@forces")
    assert render(bench, tmp_path / "ours", "mug", *sound) == 0
    ours = answer(capsys)
    assert render(bench, tmp_path / "theirs", "mug", *sound, "--objectfolder-compat") == 0
    theirs = answer(capsys)
    one, ten = (wavfile.read(path)[1].astype(float) for path in ours["files"]["audio"])
    assert np.abs(ten).max() / np.abs(one).max() == pytest.approx(10.0, rel=1e-4)
    assert theirs["full_scale"] is None
    for path in theirs["files"]["audio"]:
        rate, heard = wavfile.read(path)
        assert (rate, str(heard.dtype), len(heard)) == (44100, "float32", 132300)
        assert np.abs(heard).max() == 1.0


def test_touches_of_version_1_are_pictures_by_the_querys_own_bounds(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert render(bench, tmp_path / "no", "old", "--touch-vertices", "@vertices") == 2
    assert "--touch-bounds" in answer(capsys)["error"]
    assert render(bench, tmp_path, "old", "--touch-vertices", "@vertices", "--objectfolder-compat") == 0
    said = answer(capsys)
    assert [read_image(Path(path)).shape for path in said["files"]["touch"]] == [(160, 120, 3)] * 2
    assert "in other company" in said["notes"][0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "no query file"),
        (("--audio-vertices", "@vertices"), "--audio-forces go together"),
        (("--touch-gelinfo", "@gel"), "--touch-vertices and --touch-gelinfo go together"),
        (("--touch-vertices", "@vertices"), "tilt, azimuth and depth of each press"),
        (("--vision", "@views", "--metres-per-unit", "1m"), "no known size"),
        (("--vision", "@gel"), "not rows of 6"),
        (("--vision", "@views", "--seconds", "0"), "--seconds 0"),
        (("--vision", "@views", "--size", "8", "--objectfolder-compat"), "leave --size"),
        (("--audio-vertices", "@gel", "--audio-forces", "@forces"), "outside of the box"),
    ],
)
def test_what_cannot_be_answered_is_refused_in_one_sentence(
    options: tuple[str, ...], said: str, bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert render(bench, tmp_path / "out", "mug", *options) in (1, 2)
    error = answer(capsys)["error"]
    assert said in error
    assert "\n" not in error
    assert not list((tmp_path / "out").rglob("*.*"))


@pytest.mark.parametrize("which", ["mug", "old"])
def test_info_and_verify_know_an_imported_folder(
    which: str, bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["object", "info", str(bench / which)]) == 0
    said = capsys.readouterr().out
    for part in (
        "mug.pth",
        "licence   none",
        "sha256",
        "lacks     the object's mesh",
        "144 weights in 8 layers",
    ):
        assert part in said
    assert invoke(["object", "info", str(bench / which), "--json"]) == 0
    found = answer(capsys)
    assert found.pop("folder") == str(bench / which)
    assert found == json.loads((bench / which / "object.json").read_text())
    assert invoke(["object", "verify", str(bench / which), "--json"]) == 0
    assert answer(capsys)["verified"] is True


def test_a_published_file_is_imported_by_the_command(
    tmp_path: Path, bench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("onnxscript", reason="the extra `author` is not installed")
    path = write_published(published_trees.second(), tmp_path / "ObjectFile.pth")
    words = ["object", "import", str(path), "--out", str(tmp_path / "mug"), "--name", "a mug", "--json"]
    assert invoke(words) == 0
    said = answer(capsys)
    assert said["object"] == "a mug"
    assert said["format"] == "ObjectFolder 2.0"
    assert set(said["networks"]) == {"audio", "touch", "vision"}
    found, committed = (PublishedObject.open(folder / "mug").description for folder in (tmp_path, bench))
    for sense, network in found.networks.items():
        data = (tmp_path / "mug" / network.file).read_bytes()
        assert b"/harness/" not in data  # no path of the machine that imported it
        test = committed.networks[sense].self_test
        require_self_test(Network(data, network.file, network.inputs, network.outputs), test)
    assert invoke(words) == 2
    assert "holds an object already" in answer(capsys)["error"]
