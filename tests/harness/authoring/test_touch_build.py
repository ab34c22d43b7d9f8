"""``touchstone object build --only touch`` on a small block: what it writes, says, keeps and refuses."""

import json
from pathlib import Path

import pytest
import trimesh

from harness.cli import invoke
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch import open_touch
from harness.objectfile.verify import verify


@pytest.fixture
def block(tmp_path: Path) -> Path:
    path = tmp_path / "block.stl"
    trimesh.creation.box([0.06, 0.05, 0.02]).export(path)
    return path


def build(block: Path, *more: str) -> int:
    out = str(block.parent / "object")
    return invoke(
        ["object", "build", str(block), "--units", "m", "--material", "wood", "--profile", "smoke",
         "--only", "touch", "--out", out, *more]
    )  # fmt: skip


def test_a_block_becomes_an_object_file_that_can_be_touched(
    block: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert build(block, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["bytes"] <= 4e6
    assert set(answer["seconds"]) == {
        "mesh", "codes", "measure trained_places", "measure unseen_places", "write",
    }  # fmt: skip
    for kind, median, tenth in (("trained_places", 40.0, 30.0), ("unseen_places", 34.0, 24.0)):
        rows = answer["errors"][kind]
        assert rows["level"]["psnr_db_median"] > median
        assert rows["level"]["psnr_db_p10"] > tenth
        assert rows["level"]["psnr_db_median"] > rows["background"]["psnr_db_median"]
    of = ObjectFile.open(block.parent / "object")
    assert all(check.passed for check in verify(of)), verify(of)
    assert open_touch(of).entry.gel.rows == 120
    first = (of.folder / "touch.onnx").read_bytes()
    assert build(block) == 0
    said = capsys.readouterr().out
    assert "untouched gel" in said
    assert "10th percentile" in said
    assert (of.folder / "touch.onnx").read_bytes() == first
    assert invoke(["object", "info", str(of.folder)]) == 0
    assert "0.5 to 2 mm deep, tilts to 15 deg" in capsys.readouterr().out


def test_an_unknown_profile_of_touch_is_wrong_use(block: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert build(block, "--profile", "small") == 2
    assert "no profile 'small' of touch" in capsys.readouterr().err
