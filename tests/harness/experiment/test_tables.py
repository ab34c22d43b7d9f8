"""A table's folder holds runs of one set of the scene's keys."""

from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.scene import scene_from_options
from harness.commands.scenes import with_assignments
from harness.experiment.lookup import named
from harness.experiment.tables import require_same_keys


def test_a_folder_goes_on_with_the_keys_it_began_with(tmp_path: Path) -> None:
    folder = tmp_path / "table"
    require_same_keys(folder, ["strikes=1", "contacts=4"])
    (folder / "mug-0.json").write_text("{}")
    require_same_keys(folder, ["contacts=4", "strikes=1"])
    for other in ([], ["contacts=5", "strikes=1"]):
        with pytest.raises(WrongUse, match="another folder with --out"):
            require_same_keys(folder, other)


def test_a_folder_of_runs_without_keys_takes_none_later(tmp_path: Path) -> None:
    (tmp_path / "mug-0.json").write_text("{}")
    require_same_keys(tmp_path, [])
    with pytest.raises(WrongUse, match="--set nothing"):
        require_same_keys(tmp_path, ["contacts=4"])


def test_every_scene_has_the_keys_that_are_set() -> None:
    section = named("scale-estimation").section
    assert section is not None
    scenes = {name: scene_from_options(f"builtin:{name}") for name in ("mug", "bowl")}
    found = with_assignments(scenes, section, ["contacts=4", "paper_networks=some folder"])
    for scene in found.values():
        stated = scene.section(section).model_dump()
        assert (stated["contacts"], stated["paper_networks"]) == (4, "some folder")
    with pytest.raises(WrongUse, match="has no 'contcats'"):
        with_assignments(scenes, section, ["contcats=4"])
    with pytest.raises(WrongUse, match="no table in a scene"):
        with_assignments(scenes, None, ["contacts=4"])
