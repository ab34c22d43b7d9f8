"""ObjectFolder's query files: read without running them, refused by row, cameras and lights as published."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.objectfile.published.answers import read_rows
from harness.objectfile.published.look import views_of
from harness.objectfile.published.query import require_trained
from tests.oracles import objectfolder_formulas as formulas


def saved(array: Any, path: Path) -> Path:
    np.save(path, array, allow_pickle=True)
    return path


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64])
def test_rows_of_any_number_are_read_as_float64(kind: Any, tmp_path: Path) -> None:
    rows = np.arange(6).reshape(2, 3).astype(kind)
    found = read_rows(saved(rows, tmp_path / "q.npy"), 3, "vertices")
    assert found.dtype == np.float64
    assert np.array_equal(found, rows)
    assert np.array_equal(read_rows(saved(rows[0], tmp_path / "q.npy"), 3, "vertices"), rows[:1])


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.zeros((2, 4)), "rows of 3: vertices"),
        (np.zeros((0, 3)), "0 rows"),
        (np.zeros((1001, 3)), "1001 rows"),
        (np.zeros((2, 3, 1)), "rows of 3"),
        (np.array([[0.0, np.nan, 1.0]]), "row 0"),
        (np.array([["a", "b", "c"]]), "rows of 3"),
        (np.zeros((2, 3), np.complex128), "complex"),
        (np.array([[{}, 1, 2]], object), r"no \.npy file of numbers"),
    ],
)
def test_anything_else_is_refused(array: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(DataRefused, match=said):
        read_rows(saved(array, tmp_path / "q.npy"), 3, "vertices")


@pytest.mark.parametrize("data", [b"", b"\x93NUMPY", b"no array", b"\x93NUMPY\x01\x00v\x00{'descr': '<f8'"])
def test_a_damaged_file_is_refused(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "q.npy").write_bytes(data)
    with pytest.raises(DataRefused, match=r"no \.npy file of numbers"):
        read_rows(tmp_path / "q.npy", 3, "vertices")
    with pytest.raises(WrongUse, match=r"none\.npy"):
        read_rows(tmp_path / "none.npy", 3, "vertices")


def test_a_point_outside_of_the_trained_box_is_named_and_one_at_its_rim_is_not() -> None:
    low, high = np.array([-0.1, 0.0, 0.2]), np.array([0.1, 0.3, 0.4])
    rim = np.stack([low, high]).astype(np.float32).astype(np.float64)
    require_trained(rim, low, high, "strike", "m")
    with pytest.raises(OutOfDomain, match=r"strike 1 .*\(0, 0\.31, 0\.3\) m .*1 of 2"):
        require_trained(np.array([[0.0, 0.1, 0.3], [0.0, 0.31, 0.3]]), low, high, "strike", "m")


@pytest.mark.parametrize("eye", [(1.2, -1.5, 1.6), (-1.0, 0.1, 0.2), (0.0, -1.0, 0.0), (0.3, 0.4, -2.0)])
def test_a_camera_looks_at_the_origin_from_any_distance_and_as_published_at_its_own(eye: Any) -> None:
    unit = np.array(eye) / np.linalg.norm(eye)
    for distance in (1.5, 2.5, 40.0):
        view = views_of(np.array([[*(distance * unit), 0.0, 0.0, 2.0]]), 1.0, compat=False)[0]
        assert view.rotation @ view.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
        assert -view.rotation[:, 2] == pytest.approx(-unit, abs=1e-12)
        assert view.rotation[2, 1] >= 0.0  # z is up
        assert view.rotation[2, 0] == pytest.approx(0.0, abs=1e-12)  # and nothing is tilted
        assert view.light == pytest.approx([0.0, 0.0, 1.0])
    compat = views_of(np.array([[*(2.5 * unit), 0.0, 0.6, 0.8]]), 1.0, compat=True)[0]
    rays = formulas.camera_rays(2.5 * unit, 5).reshape(-1, 3)
    assert compat.directions(5, 0.0) == pytest.approx(rays, abs=1e-12)


def test_the_middle_of_a_picture_looks_along_the_axis_and_depth_is_one() -> None:
    view = views_of(np.array([[1.0, -2.0, 0.5, 0.0, 0.0, 1.0]]), 1.0, compat=False)[0]
    rays = view.directions(8, 0.5)
    assert rays.mean(axis=0) == pytest.approx(-view.rotation[:, 2])
    assert rays @ -view.rotation[:, 2] == pytest.approx(np.ones(64))
    right, up = view.rotation[:, 0], view.rotation[:, 1]
    assert (np.diff((rays @ right).reshape(8, 8), axis=1) > 0.0).all()
    assert (np.diff((rays @ up).reshape(8, 8), axis=0) < 0.0).all()


@pytest.mark.parametrize(
    ("row", "compat", "said"),
    [
        ((2.0, 0.0, 0.0, 0.0, 0.0, 1.0), True, "camera 0 is 2 "),
        ((2.5, 0.0, 0.0, 0.0, 0.0, 0.9), True, "light 0 .*0.9"),
        ((0.9, 0.0, 0.0, 0.0, 0.0, 1.0), False, "camera 0 .* 1"),
        ((2.5, 0.0, 0.0, 0.0, 0.0, 0.0), False, "light 0 is zero"),
    ],
)
def test_a_camera_or_light_that_cannot_be_is_refused(row: Any, compat: bool, said: str) -> None:
    with pytest.raises(OutOfDomain, match=said):
        views_of(np.array([row]), 1.0, compat)


def test_the_published_demonstrations_queries_are_read_unchanged(shared_data: Path) -> None:
    folder = shared_data / "meshes/objectfolder/demo_queries"
    views = views_of(read_rows(folder / "vision_demo.npy", 6, "camera and light"), 1.04, compat=True)
    assert all(abs(np.linalg.norm(view.eye) - 2.5) < 1e-3 for view in views)
    names = ("audio_demo_vertices", "audio_demo_forces", "touch_demo_vertices", "touch_demo_gelinfo")
    assert len({len(read_rows(folder / f"{name}.npy", 3, "rows")) for name in names}) == 1
