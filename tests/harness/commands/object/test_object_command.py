"""``touchstone object info`` and ``object verify``: what they print, and how they end."""

import json
from pathlib import Path

import pytest

from harness.cli import invoke
from tests.samples.object_bench import MODES, egg_file


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return egg_file(tmp_path / "egg").folder


def test_info_tells_what_there_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["object", "info", str(folder)]) == 0
    said = capsys.readouterr().out
    for part in (
        "egg, of ceramic",
        "60 x 80 x 100 mm",
        "7 modes, 900 to 9000 Hz",
        "CC0-1.0",
        "touch     none yet",
    ):
        assert part in said


def test_info_as_json_is_the_description(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["object", "info", str(folder), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer.pop("folder") == str(folder)
    assert answer == json.loads((folder / "object.json").read_text())
    assert len(answer["audio"]["frequencies_hz"]) == MODES


def test_verify_ends_with_0_where_all_holds(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["object", "verify", str(folder)]) == 0
    assert "11 checks" in capsys.readouterr().out


def test_verify_ends_with_1_and_says_which_failed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = bytearray((folder / "audio.onnx").read_bytes())
    data[len(data) // 2] ^= 1
    (folder / "audio.onnx").write_bytes(data)
    assert invoke(["object", "verify", str(folder)]) == 1
    said = capsys.readouterr().out
    assert "FAIL  audio.onnx: bytes:" in said
    assert "sha256" in said
    assert invoke(["object", "verify", str(folder), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert answer["schema"] == 1
    assert answer["verified"] is False
    failed = [check["check"] for check in answer["checks"] if not check["passed"]]
    assert failed[0] == "audio.onnx: bytes"


@pytest.mark.parametrize("command", ["info", "verify"])
def test_a_folder_that_is_no_object_is_wrong_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert invoke(["object", command, str(tmp_path), "--json"]) == 2
    answer = json.loads(capsys.readouterr().out)
    assert "no ObjectFile" in answer["error"]


def test_a_name_with_markup_in_it_is_printed_as_it_is(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = folder / "object.json"
    path.write_text(path.read_text().replace('"name": "egg"', '"name": "[red]egg[/]"'))
    assert invoke(["object", "info", str(folder)]) == 0
    assert "[red]egg[/], of" in capsys.readouterr().out
