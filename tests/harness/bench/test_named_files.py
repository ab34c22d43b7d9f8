"""Stations and scenes are found by name from any folder, and by their paths."""

from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.named_files import SHIPPED, named_file
from harness.bench.scene import load_scene, scene_from_options
from harness.bench.station_file import station_path


def test_a_name_means_the_same_file_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = SHIPPED / "scenes" / "mug_touch.toml"
    assert named_file("mug_touch", "scene") == named_file(str(path), "scene") == path
    assert load_scene(Path("mug_touch")) == load_scene(path) == load_scene(Path("scenes/mug_touch.toml"))
    assert station_path("stations/mock.toml") == station_path("mock")
    assert scene_from_options("objects/mug/") == scene_from_options("mug")
    assert named_file("mock", "station") == SHIPPED / "stations" / "mock.toml"


def test_a_file_here_comes_before_one_of_that_name_that_comes_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "scenes" / "mug_touch.toml"
    own.parent.mkdir()
    own.touch()
    assert named_file("mug_touch", "scene") == own


@pytest.mark.parametrize("name", ["mug_tuch", "mug_tuch.toml", "./mug_touch"])
def test_what_is_not_there_is_named_with_what_is(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(WrongUse, match="mug_touch"):
        named_file(name, "scene")
