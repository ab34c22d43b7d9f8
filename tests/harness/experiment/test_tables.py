"""A table's folder holds runs of one set of the scene's keys; its rows are means over runs."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.basics.errors import WrongUse
from harness.bench.scene import scene_from_options
from harness.experiment.in_process import RunCell
from harness.experiment.lookup import find_experiment
from harness.experiment.measuring import MeasuredColumn, Measurement
from harness.experiment.subjects import REAL, objects
from harness.experiment.tables import by_object, require_same_keys, rows
from harness.tasks.scenes import with_assignments


def test_a_folder_goes_on_with_the_keys_it_began_with(tmp_path: Path) -> None:
    folder = tmp_path / "table"
    require_same_keys(folder, ["strikes=1", "contacts=4"])
    (folder / "mug-0.json").write_text("{}")
    require_same_keys(folder, ["contacts=4", "strikes=1"])
    for other in ([], ["contacts=5", "strikes=1"]):
        with pytest.raises(WrongUse, match="--out"):
            require_same_keys(folder, other)


def test_a_folder_of_runs_without_keys_takes_none_later(tmp_path: Path) -> None:
    (tmp_path / "mug-0.json").write_text("{}")
    require_same_keys(tmp_path, [])
    with pytest.raises(WrongUse, match="--set nothing"):
        require_same_keys(tmp_path, ["contacts=4"])


def test_every_scene_has_the_keys_that_are_set() -> None:
    section = find_experiment("scale-estimation").section
    assert section is not None
    scenes = {name: scene_from_options(f"builtin:{name}") for name in ("mug", "bowl")}
    found = with_assignments(scenes, section, ["contacts=4", "paper_networks=some folder"])
    for scene in found.values():
        stated = scene.section(section).model_dump()
        assert (stated["contacts"], stated["paper_networks"]) == (4, "some folder")
    with pytest.raises(WrongUse, match="'contcats'"):
        with_assignments(scenes, section, ["contcats=4"])
    with pytest.raises(WrongUse, match="contacts=4"):
        with_assignments(scenes, None, ["contacts=4"])


class TwoMethods(Measurement):
    methods = ("a", "b")
    columns = (MeasuredColumn("f", "F", "%"), MeasuredColumn("far_m", "far", "mm"))


RESULTS: dict[RunCell, dict[str, Any]] = {
    RunCell("mug", "none", 0): {"rows": {"a": {"error_m": 1.0, "seconds": 1.0, "f": True}}},
    RunCell("mug", "none", 1): {
        "rows": {"a": {"error_m": 3.0, "seconds": 1.0, "f": False}, "b": {"error_m": 5.0, "seconds": 1.0}}
    },
    RunCell("bowl", "none", 0): {"rows": {"a": {"error_m": 7.0, "seconds": 1.0}}},
    RunCell("bowl", "none", 1): {"failed": "WrongUse: no way"},
}


def test_further_columns_are_means_of_the_rows_that_have_them() -> None:
    # By another name, since the registry's own table of scale estimation would be taken instead.
    experiment = replace(find_experiment("scale-estimation"), name="two methods", measurement=TwoMethods)
    by_method = {row.method: row for row in rows(experiment, RESULTS)}
    assert by_method["a"].means == {"f": 0.5}
    assert by_method["b"].means == {}


def test_each_object_has_its_own_mean_of_what_is_named() -> None:
    condition = (("gap", "none"),)
    assert by_object(RESULTS, condition) == {"mug": {"a": 2.0, "b": 5.0}, "bowl": {"a": 7.0}}
    assert by_object(RESULTS, condition, "f") == {"mug": {"a": 0.5}}


def test_an_experiment_may_have_real_objects_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "ball.stl").write_text("")
    for file, _, _ in REAL.values():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("")
    more = {**REAL, "ball": ("ball.stl", "m", "plastic")}
    assert set(objects(tmp_path, more)) == {*objects(tmp_path), "ball"}
    assert "ball" not in objects(None, more)
    (tmp_path / "ball.stl").unlink()
    assert objects(tmp_path, more) == objects(tmp_path)
