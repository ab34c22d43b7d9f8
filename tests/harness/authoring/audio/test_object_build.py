"""``touchstone object build`` on a small block: what it writes, says and refuses."""

import contextlib
import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from harness.authoring.audio.object_audio import STAGES
from harness.cli import invoke
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.file import ObjectFile
from harness.objectfile.verify import verify


@pytest.fixture
def block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "block.stl"
    trimesh.creation.box([0.2, 0.05, 0.02]).export(path)
    return path


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A block that was built, with its cache beside it, and the answer."""
    folder, shown = tmp_path_factory.mktemp("first"), io.StringIO()
    trimesh.creation.box([0.2, 0.05, 0.02]).export(folder / "block.stl")
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(shown):
        patch.setenv("TOUCHSTONE_CACHE", str(folder / "cache"))
        assert build(folder / "block.stl") == 0
    return folder / "block.stl", json.loads(shown.getvalue())


@pytest.fixture
def built(
    first: tuple[Path, dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Path, dict[str, Any]]:
    """A copy of it to change."""
    folder = Path(shutil.copytree(first[0].parent, tmp_path / "copy"))
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(folder / "cache"))
    return folder / "block.stl", first[1]


def build(block: Path, *more: str) -> int:
    out = str(block.parent / "object")
    return invoke(
        ["object", "build", str(block), "--units", "m", "--material", "wood", "--edge", "15mm",
         "--profile", "smoke", "--only", "audio", "--modes", "12", "--out", out, "--json", *more]
    )  # fmt: skip


def test_a_block_becomes_an_object_file_that_verifies(first: tuple[Path, dict[str, Any]]) -> None:
    block, answer = first
    assert len(answer["frequencies_hz"]) == 12
    assert list(answer["seconds"]) == list(answer["cpu_seconds"]) == list(STAGES)
    assert min(answer["seconds"].values()) >= 0.0
    errors = answer["errors"]
    assert errors["network"]["gain_error_median"] < errors["linear"]["gain_error_median"]
    of = ObjectFile.open(block.parent / "object")
    assert of.description.audio is not None
    assert of.description.audio.provenance.seconds == answer["seconds"]
    assert of.description.audio.provenance.cpu_seconds == answer["cpu_seconds"]
    assert all(check.passed for check in verify(of))
    network, table = open_audio(of, "network"), open_audio(of, "table")
    points = table.as_modes().points[::7]
    gap = np.linalg.norm(network.at(points) - table.at(points))
    assert gap < 0.05 * np.linalg.norm(table.at(points))
    assert network.frequencies.tolist() == answer["frequencies_hz"]


def test_building_again_gives_the_same_bytes(
    built: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    block, answer = built
    before = (block.parent / "object" / "audio.onnx").read_bytes()
    solved = answer["seconds"]
    assert build(block) == 0
    assert (block.parent / "object" / "audio.onnx").read_bytes() == before
    shown = capsys.readouterr()
    again = json.loads(shown.out)["seconds"]
    assert "modes were kept" in shown.err
    assert [again[stage] for stage in ("mesh", "solve")] == [solved[stage] for stage in ("mesh", "solve")]


def test_a_folder_of_another_object_is_refused(
    built: tuple[Path, dict[str, Any]], capsys: pytest.CaptureFixture[str]
) -> None:
    block, _ = built
    before = (block.parent / "object" / "object.json").read_bytes()
    assert build(block, "--material", "steel") == 2
    assert "name another folder" in capsys.readouterr().err
    trimesh.creation.box([0.2, 0.05, 0.021]).export(block)
    assert build(block) == 2
    assert (block.parent / "object" / "object.json").read_bytes() == before


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--profile", "fine"), "no profile"),
        (("--only", "smell"), "there is audio, touch and vision"),
        (("--up-to", "20"), "--up-to"),
        (("--material", "cheese"), "no material"),
    ],
)
def test_what_cannot_be_built_is_wrong_use(
    block: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], said: str
) -> None:
    assert build(block, *more) == 2
    assert said in capsys.readouterr().err


def test_an_object_without_a_mode_in_reach_has_no_sound(
    block: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert build(block, "--up-to", "50Hz") == 1
    assert "50 Hz" in capsys.readouterr().err
