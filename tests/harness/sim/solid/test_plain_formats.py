"""OBJ, STL and OFF of other programs: their shape, or one sentence; never another shape."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import read_mesh
from harness.sim.solid.plain_formats import read_obj, read_stl
from harness.sim.solid.polygons import triangulated
from tests.oracles.volume_meshes import box

BLOCK = box((30.0, 20.0, 10.0), (1, 1, 1)).surface
U_SHAPE = np.array([[0, 0], [60, 0], [60, 40], [45, 40], [45, 12], [15, 12], [15, 40], [0, 40]], dtype=float)


def obj(path: Path, parts: int, number: Callable[[int, int], int]) -> Path:
    """Blocks 100 apart; ``number`` writes a vertex of a face line, by its index and how many stand before."""
    lines, so_far = ["# by hand"], 0
    for part in range(parts):
        lines += [f"v {x + 100 * part} {y} {z} 0.5 0.5 0.5" for x, y, z in BLOCK.vertices]
        faces = BLOCK.faces + so_far
        so_far += len(BLOCK.vertices)
        lines += ["f " + " ".join(f"{number(int(k), so_far)}/1/1" for k in face) for face in faces]
    path.write_text("\n".join(lines))
    return path


NUMBERED: dict[str, Callable[[int, int], int]] = {
    "from 1": lambda index, so_far: index + 1,
    "from 0": lambda index, so_far: index,
    "backwards": lambda index, so_far: index - so_far,
}


@pytest.mark.parametrize("numbered", NUMBERED)
def test_an_obj_is_the_same_object_however_it_counts(numbered: str, tmp_path: Path) -> None:
    report = take_in(obj(tmp_path / "some.obj", 3, NUMBERED[numbered]), "mm").report
    assert report.bodies == 3
    assert report.volume == pytest.approx(3 * 6e-6)
    assert any("from 0" in warning for warning in report.warnings) == (numbered == "from 0")


@pytest.mark.parametrize("face", ["f 0 1 4", "f 1 2 -5", "f 0 -1 -2", "f 1 2 3 5"])
def test_an_obj_whose_faces_name_no_vertex_is_refused(face: str, tmp_path: Path) -> None:
    (tmp_path / "some.obj").write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{face}\n")
    with pytest.raises(MeshRefused, match=r"some\.obj .*vertex"):
        read_obj(tmp_path / "some.obj")


def text_stl(path: Path, solids: int) -> Path:
    lines = []
    for solid in range(solids):
        lines.append("solid part")  # of one name, as many a program writes them
        for corners in BLOCK.corners + np.array([100.0 * solid, 0.0, 0.0]):
            lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in corners)]
            lines += ["endloop", "endfacet"]
        lines.append("endsolid part")
    path.write_text("\n".join(lines))
    return path


def binary_stl(path: Path, announced: int, after: bytes = b"") -> Path:
    facets = np.zeros(len(BLOCK.faces), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")]))
    facets["c"] = BLOCK.corners
    path.write_bytes(b"solid by hand".ljust(80) + announced.to_bytes(4, "little") + facets.tobytes() + after)
    return path


def test_no_solid_of_an_stl_is_lost(tmp_path: Path) -> None:
    report = take_in(text_stl(tmp_path / "some.stl", 4), "mm").report
    assert report.bodies == 4
    assert report.volume == pytest.approx(4 * 6e-6)


@pytest.mark.parametrize("write", [lambda path: text_stl(path, 1), lambda path: binary_stl(path, 12)])
def test_an_stl_that_is_cut_short_anywhere_is_refused_or_whole(
    write: Callable[[Path], Path], tmp_path: Path
) -> None:
    path = write(tmp_path / "some.stl")
    data, whole = path.read_bytes(), read_stl(path).vertices
    for length in range(1, len(data), 7):
        path.write_bytes(data[:length])
        try:
            found = read_mesh(path)
        except MeshRefused:
            continue
        assert np.array_equal(found.vertices, whole)


@pytest.mark.parametrize(
    ("announced", "after", "note"),
    [(12, b"", None), (6, b"", "announces 6 triangles and it holds 12"), (12, b"x" * 37, "37 bytes after")],
)
def test_what_is_odd_of_an_stl_is_said(
    announced: int, after: bytes, note: str | None, tmp_path: Path
) -> None:
    report = take_in(binary_stl(tmp_path / "some.stl", announced, after), "mm").report
    assert report.volume == pytest.approx(6e-6)
    assert [warning for warning in report.warnings if note and note in warning] == list(report.warnings)
    assert len(report.warnings) == (note is not None)


def area(places: FloatArray, faces: IntArray) -> FloatArray:
    a, b, c = (places[faces[:, k]] for k in range(3))
    return np.asarray(0.5 * np.cross(b - a, c - a))


@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("start", range(8))
def test_a_polygon_that_is_not_convex_is_covered_once(turn: int, start: int) -> None:
    """A fan from any corner of a U covers the opening too, and takes it off again."""
    lifted = np.column_stack([U_SHAPE, np.zeros(8)]) @ np.linalg.qr(np.arange(9.0).reshape(3, 3) ** 2 + 1)[0]
    corners = np.roll(np.arange(8)[::turn], start)
    pieces = area(lifted, triangulated(lifted, corners.astype(np.int64), np.array([8])))
    whole = pieces.sum(axis=0)
    assert np.linalg.norm(whole) == pytest.approx(60 * 40 - 30 * 28)
    assert np.linalg.norm(pieces, axis=1).sum() == pytest.approx(60 * 40 - 30 * 28)
    turned = np.roll(corners, -int(np.flatnonzero(corners == 0)[0]))[[1, 2]]
    assert whole @ np.cross(lifted[1] - lifted[0], lifted[2] - lifted[1]) * turn > 0.0 or turned[0] != 1
