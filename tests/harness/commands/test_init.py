"""A new project's files are read as they are, and none that is there is written over."""

from pathlib import Path

import pytest

from harness.bench.named_files import SHIPPED
from harness.bench.scene import load_scene
from harness.bench.station_file import load_station, station_path
from harness.cli import invoke


def test_its_station_and_scene_are_found_by_name_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["init", str(tmp_path / "lab")]) == 0
    assert "--station bench --scene mug" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path / "lab")
    assert load_station(station_path("bench")) == load_station(SHIPPED / "stations" / "mock.toml")
    assert load_station(station_path("real_bench")).mock is None
    assert load_scene(Path("mug")) == load_scene(Path("mug_touch"))
    assert "--station bench --scene mug" in Path("README.md").read_text(encoding="utf-8")


def test_a_folder_with_such_files_is_left_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "README.md").write_text("mine", encoding="utf-8")
    assert invoke(["init", str(tmp_path)]) == 2
    assert "README.md" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["README.md"]
    assert (tmp_path / "README.md").read_text(encoding="utf-8") == "mine"
