"""A published file's tables: both versions told apart, and whatever does not fit refused by its place."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.authoring.published.imported import gathered, import_published
from harness.authoring.published.layout import format_of
from harness.authoring.published.look import needed_cells
from harness.basics.errors import DataRefused, WrongUse
from tests.samples import published_trees
from tests.samples.published_files import write_published
from tests.samples.published_objects import committed_object

Tree = dict[str, Any]


def with_torch() -> None:
    for name in ("torch", "onnxscript"):
        pytest.importorskip(name, reason="the extra `author` is not installed")


def refused(tree: Tree) -> str:
    with pytest.raises(DataRefused) as raised:
        gathered(tree, "mug.pth", format_of(tree, "mug.pth"), None, None)
    said = str(raised.value)
    assert "\n" not in said
    return said


def test_the_two_versions_are_told_apart_whatever_senses_are_there() -> None:
    for key in ("VisionNet", "AudioNet", "TouchNet"):
        assert format_of({key: published_trees.second()[key]}, "a file") == "ObjectFolder 2.0"
        assert format_of({key: published_trees.first()[key]}, "a file") == "ObjectFolder 1.0"


@pytest.mark.parametrize(
    "tree", [None, 3, [], {}, {"model_state_dict": {}}, {"VisionNet": 3}, {"AudioNet": {}}]
)
def test_a_foreign_table_is_no_objectfile(tree: Any) -> None:
    with pytest.raises(DataRefused, match=r"ObjectFile"):
        format_of(tree, "a file")


def test_senses_of_two_versions_are_no_objectfile() -> None:
    tree = {
        "VisionNet": published_trees.first()["VisionNet"],
        "AudioNet": published_trees.second()["AudioNet"],
    }
    with pytest.raises(DataRefused, match=r"1\.0.*2\.0"):
        format_of(tree, "a file")


def test_a_sense_that_is_not_there_is_said() -> None:
    with_torch()
    tree = {"TouchNet": published_trees.second()["TouchNet"]}
    parts = gathered(tree, "a file", "ObjectFolder 2.0", None, None)
    assert "touch_depth" in parts.tree
    for sense in ("AudioNet", "VisionNet"):
        assert any(sense in sentence for sentence in parts.missing)


def test_layers_that_nothing_uses_are_dropped_and_counted() -> None:
    dropped = committed_object("kilo").description.dropped
    assert len(dropped) == 2 * 4
    assert all("views_linears" in name for name in dropped)
    assert sum(dropped.values()) == 4 * (8 * 4 + 4)


def _gone(tree: Tree) -> None:
    del tree["AudioNet"]["model_state_dict"]["module.model_y.pts_linears.3.bias"]


def _unknown(tree: Tree) -> None:
    tree["TouchNet"]["model_state_dict"]["module.gate.weight"] = np.zeros((2, 2), np.float32)


def _not_finite(tree: Tree) -> None:
    tree["TouchNet"]["model_state_dict"]["module.output_linear.weight"][0, 3] = np.nan


def _transposed(tree: Tree) -> None:
    state = tree["TouchNet"]["model_state_dict"]
    state["module.pts_linears.5.weight"] = state["module.pts_linears.5.weight"].T


def _other_modes(tree: Tree) -> None:
    tree["AudioNet"]["frequencies"] = np.arange(1.0, 4.0)


def _fewer_dampings(tree: Tree) -> None:
    tree["AudioNet"]["dampings"] = tree["AudioNet"]["dampings"][:-1]


def _flat(tree: Tree) -> None:
    tree["AudioNet"]["normalizer"]["xyz_max"] = tree["AudioNet"]["normalizer"]["xyz_min"]


def _text(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["near"] = "close"


def _boolean(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["far"] = True


def _half_a_sample(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["num_samples_per_ray"] = 2.5


def _other_cells(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["fixed_resolution"] = [4, 4, 2]


def _huge(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["occupancy"]["resolution"] = [10**6, 10**6, 10**6]


def _empty(tree: Tree) -> None:
    tree["VisionNet"]["occupancy_grid"] = np.zeros_like(tree["VisionNet"]["occupancy_grid"])


def _disparity(tree: Tree) -> None:
    tree["VisionNet"]["cfg"]["llff_lindisp"] = True


@pytest.mark.parametrize(
    ("damage", "sense", "named"),
    [
        (_other_modes, "AudioNet", "f1_min has 7 numbers"),
        (_flat, "AudioNet", "no extent"),
        (_text, "VisionNet", "near"),
        (_boolean, "VisionNet", "far is True"),
        (_half_a_sample, "VisionNet", "num_samples_per_ray"),
        (_huge, "VisionNet", "resolution"),
        (_empty, "VisionNet", "empty"),
        (_disparity, "VisionNet", "disparity"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_place(
    damage: Callable[[Tree], None], sense: str, named: str
) -> None:
    tree = published_trees.second()
    damage(tree)
    assert named in refused({sense: tree[sense]})


@pytest.mark.parametrize(
    ("damage", "sense", "named"),
    [
        (_gone, "AudioNet", "model_y.pts_linears.3.bias"),
        (_unknown, "TouchNet", "gate.weight"),
        (_not_finite, "TouchNet", "not finite"),
        (_transposed, "TouchNet", "pts_linears.5"),
        (_other_cells, "VisionNet", "32 cells"),
    ],
)
def test_weights_that_do_not_fit_are_refused_by_their_name(
    damage: Callable[[Tree], None], sense: str, named: str
) -> None:
    with_torch()
    tree = published_trees.second()
    damage(tree)
    assert named in refused({sense: tree[sense]})


def test_modes_without_dampings_of_their_own_are_refused(tmp_path: Path) -> None:
    with_torch()
    tree = published_trees.second()
    tree = {"AudioNet": tree["AudioNet"]}
    _fewer_dampings(tree)
    path = write_published(tree, tmp_path / "ObjectFile.pth")
    with pytest.raises(DataRefused, match="7 frequencies, 6 dampings"):
        import_published(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_bounds_are_for_version_1_and_in_order() -> None:
    tree = published_trees.second()
    with pytest.raises(WrongUse, match=r"--\w+.*ObjectFolder 1\.0"):
        gathered(tree, "a file", "ObjectFolder 2.0", (0.0, 1.0), None)
    with pytest.raises(WrongUse, match=r"0\.2 -0\.2"):
        gathered(published_trees.first(), "a file", "ObjectFolder 1.0", None, (0.2, -0.2))


def test_a_network_is_needed_where_an_occupied_voxel_reaches_into_its_cell() -> None:
    occupied = np.zeros((6, 4, 2), np.bool_)
    occupied[3, 3, 0] = True
    assert np.argwhere(needed_cells(occupied, (4, 2, 2))).tolist() == [[2, 1, 0]]
    assert np.argwhere(needed_cells(occupied, (5, 2, 1))).tolist() == [[2, 1, 0], [3, 1, 0]]
