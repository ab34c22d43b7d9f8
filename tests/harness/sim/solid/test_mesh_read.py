"""Mesh files of other programs: the unit that they declare is theirs, and what does not read is refused."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import MeshRefused
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import METRES, read_mesh
from harness.sim.solid.volume_mesh import read_volume

CORNERS = "0 0 0 40 0 0 0 40 0 0 0 40"
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))

COLLADA = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>
<unit name="theirs" meter="{metres}"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="pa" count="12">{corners}</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="4">
<input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""

MODEL = """<?xml version="1.0" encoding="UTF-8"?>
<model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
<object id="1" type="model">
<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh></object>
</resources><build><item objectid="1"/></build></model>"""


def collada(path: Path, metres: float) -> Path:
    faces = " ".join(str(corner) for face in FACES for corner in face)
    path.write_text(COLLADA.format(metres=metres, corners=CORNERS, faces=faces))
    return path


def three_mf(path: Path, unit: str) -> Path:
    corners = np.array(CORNERS.split()).reshape(-1, 3)
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in corners)
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", MODEL.format(unit=unit, vertices=vertices, triangles=triangles))
    return path


@pytest.mark.parametrize("metres", [1e-2, 1e-3, 0.0254])
def test_a_collada_file_says_how_long_its_unit_is(tmp_path: Path, metres: float) -> None:
    taken = take_in(collada(tmp_path / "some.dae", metres), None)
    assert np.ptp(taken.mesh.bounds, axis=0) == pytest.approx(3 * [40 * metres])


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        *(("micron", 1e-6), ("millimeter", 1e-3), ("centimeter", 1e-2)),
        *(("inch", 0.0254), ("foot", 0.3048), ("meter", 1.0)),
    ],
)
def test_a_3mf_file_names_its_unit(tmp_path: Path, unit: str, metres: float) -> None:
    raw = read_mesh(three_mf(tmp_path / "some.3mf", unit))
    assert raw.unit is not None
    assert METRES[raw.unit] == metres
    assert np.ptp(raw.vertices, axis=0) == pytest.approx([40.0, 40.0, 40.0])


@pytest.mark.parametrize("name", ["some.step", "some.toml", "some"])
def test_what_is_read_is_said_where_something_else_is_given(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("ISO-10303-21;")
    with pytest.raises(MeshRefused, match="OBJ, STL, PLY"):
        read_mesh(tmp_path / name)


def test_what_the_library_prints_is_not_on_standard_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "cut.msh"
    path.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 0 0 0\n")
    for read in (lambda: read_mesh(path), lambda: read_volume(path, "mm")):
        with pytest.raises(MeshRefused, match=r"cut\.msh"):
            read()
    assert capsys.readouterr().out == ""
