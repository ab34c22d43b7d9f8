"""Text meshes of any encoding, line end and compression are the same object, or the cause is named."""

import codecs
import gzip
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from harness.basics.errors import MeshRefused
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import read_mesh
from harness.sim.solid.volume_mesh import read_volume
from tests.oracles.volume_meshes import box

FILES = Path(__file__).parents[3] / "samples" / "mesh_files"
BLOCK = box((40.0, 30.0, 20.0), (1, 1, 1))
VOLUME = 2.4e-5


def obj_text() -> str:
    lines = [f"v {x} {y} {z}" for x, y, z in BLOCK.surface.vertices]
    return "\n".join([*lines, *("f {} {} {}".format(*(face + 1)) for face in BLOCK.surface.faces)]) + "\n"


def stl_text() -> str:
    lines = ["solid block"]
    for corners in BLOCK.surface.corners:
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in corners)]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid block"]) + "\n"


def off_text() -> str:
    surface = BLOCK.surface
    lines = ["OFF", f"{len(surface.vertices)} {len(surface.faces)} 0"]
    lines += [f"{x} {y} {z}" for x, y, z in surface.vertices]
    return "\n".join([*lines, *("3 {} {} {}".format(*face) for face in surface.faces)]) + "\n"


def ply_text() -> str:
    mesh = trimesh.Trimesh(BLOCK.surface.vertices, BLOCK.surface.faces, process=False)
    written = mesh.export(file_type="ply", encoding="ascii")
    assert isinstance(written, bytes)
    return written.decode()


def written_by_meshio(kind: str, **options: object) -> Callable[[], str]:
    def text() -> str:
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"block{kind}"
            meshio.write_points_cells(path, BLOCK.nodes, [("tetra", BLOCK.cells)], **options)
            return path.read_text()

    return text


TEXTS = {
    ".obj": obj_text,
    ".stl": stl_text,
    ".off": off_text,
    ".ply": ply_text,
    ".inp": written_by_meshio(".inp"),
    ".bdf": written_by_meshio(".bdf"),
    ".msh": written_by_meshio(".msh", file_format="gmsh", binary=False),
    ".vtk": written_by_meshio(".vtk", file_format="vtk", binary=False),
}

ENCODED: dict[str, Callable[[str], bytes]] = {
    "UTF-8 mark": lambda text: codecs.BOM_UTF8 + text.encode(),
    "UTF-16 mark": lambda text: text.encode("utf-16"),
    "UTF-16 BE mark": lambda text: codecs.BOM_UTF16_BE + text.encode("utf-16-be"),
    "UTF-16 LE": lambda text: text.encode("utf-16-le"),
    "UTF-16 BE": lambda text: text.encode("utf-16-be"),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "CRLF": lambda text: text.replace("\n", "\r\n").encode(),
    "gzip": lambda text: gzip.compress(text.encode()),
    "gzip, mark, CR": lambda text: gzip.compress(codecs.BOM_UTF8 + text.replace("\n", "\r").encode()),
}


@pytest.mark.parametrize("encoded", ENCODED)
@pytest.mark.parametrize("kind", TEXTS)
def test_a_text_mesh_is_the_same_object_however_it_was_written(
    kind: str, encoded: str, tmp_path: Path
) -> None:
    path = tmp_path / f"block{kind}"
    path.write_bytes(ENCODED[encoded](TEXTS[kind]()))
    assert take_in(path, "mm").report.volume == pytest.approx(VOLUME, rel=1e-6)


@pytest.mark.parametrize("kind", TEXTS)
def test_a_compressed_mesh_may_say_so_in_its_name(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"block{kind}.gz"
    path.write_bytes(gzip.compress(TEXTS[kind]().encode()))
    assert take_in(path, "mm").report.volume == pytest.approx(VOLUME, rel=1e-6)
    volume = read_volume(path, "mm")
    assert (volume is None) == (kind in (".obj", ".stl", ".off", ".ply"))


def test_a_compressed_binary_stl_is_read(tmp_path: Path) -> None:
    mesh = trimesh.Trimesh(BLOCK.surface.vertices, BLOCK.surface.faces, process=False)
    mesh.export(tmp_path / "block.stl")
    (tmp_path / "block.stl.gz").write_bytes(gzip.compress((tmp_path / "block.stl").read_bytes()))
    assert take_in(tmp_path / "block.stl.gz", "mm").report.volume == pytest.approx(VOLUME, rel=1e-6)


COMMAS = {
    ".obj": "v 1,5 2,0 3,0\nv 1,5 2,0 3,0\nv 4,5 2,0 3,0\nf 1 2 3\n",
    ".stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 1,5 2,0 3,0\n"
    + "endloop\nendfacet\nendsolid a\n",
    ".off": "OFF\n4 0 0\n1.5 2.0 3.0\n1,5 2,0 3,0\n1 2 3\n1 2 3\n",
    ".ply": ply_text().replace("end_header\n", "end_header\n1,5 2,0 3,0\n"),
}


@pytest.mark.parametrize("kind", COMMAS)
def test_decimal_commas_are_named_and_drop_no_digits(kind: str, tmp_path: Path) -> None:
    (tmp_path / f"a{kind}").write_text(COMMAS[kind])
    with pytest.raises(MeshRefused, match=rf"a\{kind}, line \d+: '1,5 2,0 3,0' .*commas"):
        read_mesh(tmp_path / f"a{kind}")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("v 1.0 2.0", "line 9: .*3 coordinates.*'1.0 2.0'"),
        ("v 1.0 x 2.0", "line 9: .*3 coordinates.*'1.0 x 2.0'"),
        ("v 1 2 3 0.5", "line 9: .*weight 0.5"),
        ("f 1 2 a", "line 9: .*vertices.*'1 2 a'"),
        ("f 1,2,3", "line 9: .*(commas|vertices)"),
        ("v;1.0;2.0;3.0", "line 9: .*semicolons"),
        ("v 1.0;2.0;3.0", "line 9: .*semicolons"),
        ("f,1,2,3", "line 9: .*commas"),
        ("v\u00a01.0\u00a02.0\u00a03.0", "line 9: .*no-break spaces"),
        ("surf 0 1 0 1 1 2 3", "line 9: .*'surf'"),
        ("call other.obj", "line 9: .*'call'"),
    ],
)
def test_a_wrong_line_of_an_obj_is_named(line: str, said: str, tmp_path: Path) -> None:
    lines = obj_text().split("\n")
    (tmp_path / "a.obj").write_text("\n".join([*lines[:8], line, *lines[8:]]))
    with pytest.raises(MeshRefused, match=said):
        read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("after", ["", " 1.0", " 0.1 0.2 0.3", " 1.0 0.1 0.2 0.3"])
@pytest.mark.parametrize("face", ["{}//{}", "{}/{}/{}", "{}"])
def test_an_obj_has_weights_of_one_colours_normals_and_continued_lines(
    after: str, face: str, tmp_path: Path
) -> None:
    surface = BLOCK.surface
    lines = [f"v {x} {y} \\\n{z}{after}" for x, y, z in surface.vertices]
    for corners in surface.faces + 1:
        a, b, c = (face.format(k, k, k) for k in corners)
        lines.append(f"f {a} \\\n {b} {c}")
    (tmp_path / "a.obj").write_text("\n".join(lines))
    assert take_in(tmp_path / "a.obj", "mm").report.volume == pytest.approx(VOLUME)


def placed(mesh: trimesh.Trimesh, kind: str, offset: float, path: Path) -> Path:
    moved = trimesh.Trimesh(mesh.vertices + offset, mesh.faces, process=False)
    if kind == ".obj":
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in moved.vertices]
        lines += ["f {} {} {}".format(*(face + 1)) for face in moved.faces]
        path.write_text("\n".join(lines))
    else:
        moved.export(path)
    return path


TWO = trimesh.Trimesh(
    np.vstack([BLOCK.surface.vertices / 1e3, BLOCK.surface.vertices / 1e3 + 0.1]),
    np.vstack([BLOCK.surface.faces, BLOCK.surface.faces + len(BLOCK.surface.vertices)]),
    process=False,
)


@pytest.mark.parametrize("inside_out", [False, True])
@pytest.mark.parametrize("offset", [0.0, -1.0, 30.0, 500.0, 4e5, 5.6e6])
def test_where_a_mesh_is_changes_neither_its_volume_nor_its_pieces(
    offset: float, inside_out: bool, tmp_path: Path
) -> None:
    mesh = trimesh.Trimesh(TWO.vertices, TWO.faces[:, ::-1] if inside_out else TWO.faces, process=False)
    intake = take_in(placed(mesh, ".obj", offset, tmp_path / "a.obj"), "m")
    assert (intake.report.bodies, intake.report.watertight) == (2, True)
    assert intake.report.volume == pytest.approx(2 * VOLUME, rel=1e-4)  # the file has micrometres
    assert any("moved by" in note for note in intake.report.warnings) == (abs(offset) > 200.0)


@pytest.mark.parametrize("kind", [".stl", ".ply"])
def test_float32_coordinates_too_coarse_for_the_object_are_refused_with_their_step(
    kind: str, tmp_path: Path
) -> None:
    assert take_in(placed(TWO, kind, 10.0, tmp_path / f"a{kind}"), "m").report.bodies == 2
    with pytest.raises(MeshRefused, match=r"float32 .*5\.6e\+06 .* 0\.5"):
        take_in(placed(TWO, kind, 5.6e6, tmp_path / f"a{kind}"), "m")


def test_float64_coordinates_too_coarse_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshRefused, match=r"float64 .*1e\+15 .* 0\.12"):
        take_in(placed(TWO, ".obj", 1e15, tmp_path / "a.obj"), "m")


def test_a_far_vertex_that_no_face_uses_decides_nothing(tmp_path: Path) -> None:
    (tmp_path / "b.obj").write_text(obj_text() + "v 1e7 1e7 1e7\n")
    report = take_in(tmp_path / "b.obj", "mm").report
    assert report.volume == pytest.approx(VOLUME)
    assert not any("moved" in note for note in report.warnings)


def test_tetrahedra_far_from_the_origin_are_moved_and_it_is_stated(tmp_path: Path) -> None:
    meshio.write_points_cells(tmp_path / "far.vtu", BLOCK.nodes / 1e3 + 5e6, [("tetra", BLOCK.cells)])
    found = read_volume(tmp_path / "far.vtu", "m")
    assert found is not None
    assert np.abs(found.mesh.nodes).max() < 0.1
    assert any("moved by (-5000000" in sentence for sentence in found.said)
