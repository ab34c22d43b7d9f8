"""3MF: its unit, the types of its objects, and where its build places them."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import MeshRefused
from harness.sim.light.appearance_source import read_appearance
from harness.sim.solid.formats.three_mf import read_3mf
from harness.sim.solid.intake import take_in
from tests.support.made_meshes import VOLUME, mesh_xml, model_xml, write_3mf

PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
MATERIALS = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"


@pytest.mark.parametrize("kind", ["support", "solidsupport", "surface", "other"])
def test_only_objects_of_type_model_are_the_object(tmp_path: Path, kind: str) -> None:
    resources = (
        f'<object id="1">{mesh_xml()}</object><object id="2" type="{kind}">{mesh_xml()}</object>'
        '<object id="3" type="model"><components><component objectid="1"/>'
        '<component objectid="2" transform="1 0 0 0 1 0 0 0 1 60 0 0"/></components></object>'
    )
    items = '<item objectid="3"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 60 0"/>'
    report = take_in(write_3mf(tmp_path / "box.3mf", model_xml(resources, items)), None).report
    assert report.bodies == 1
    assert report.volume == pytest.approx(VOLUME, rel=1e-9)
    assert any(f"type '{kind}'" in warning for warning in report.warnings)


def test_a_file_of_supports_alone_is_refused_by_their_type(tmp_path: Path) -> None:
    model = model_xml(f'<object id="1" type="support">{mesh_xml()}</object>', '<item objectid="1"/>')
    with pytest.raises(MeshRefused, match="'support'"):
        take_in(write_3mf(tmp_path / "box.3mf", model), None)


def test_components_are_placed_by_their_own_transform_and_then_by_the_item_s(tmp_path: Path) -> None:
    resources = (
        f'<object id="1">{mesh_xml()}</object><object id="2"><components>'
        '<component objectid="1" transform="1 0 0 0 1 0 0 0 1 10 0 0"/></components></object>'
    )
    # Rows are the images of x, y and z: x becomes y.
    items = '<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 5"/>'
    part = read_3mf(write_3mf(tmp_path / "box.3mf", model_xml(resources, items))).parts[0]
    assert part.vertices.min(axis=0) == pytest.approx([-30.0, 10.0, 5.0])
    assert part.vertices.max(axis=0) == pytest.approx([0.0, 50.0, 25.0])


def test_an_item_that_is_not_to_be_printed_is_left_out_and_named(tmp_path: Path) -> None:
    items = '<item objectid="1"/><item objectid="1" printable="0" transform="1 0 0 0 1 0 0 0 1 60 0 0"/>'
    path = write_3mf(tmp_path / "box.3mf", model_xml(f'<object id="1">{mesh_xml()}</object>', items))
    report = take_in(path, None).report
    assert report.volume == pytest.approx(VOLUME, rel=1e-9)
    assert any("not to be printed" in warning for warning in report.warnings)


def test_what_the_build_does_not_place_is_no_object(tmp_path: Path) -> None:
    resources = f'<object id="1">{mesh_xml()}</object><object id="2">{mesh_xml()}</object>'
    path = write_3mf(tmp_path / "box.3mf", model_xml(resources, '<item objectid="2"/>'))
    assert take_in(path, None).report.bodies == 1
    with pytest.raises(MeshRefused, match="<build>"):
        take_in(write_3mf(tmp_path / "none.3mf", model_xml(resources, "")), None)


def test_an_object_of_another_part_is_read(tmp_path: Path) -> None:
    attributes = f'unit="millimeter" xmlns:p="{PRODUCTION}" requiredextensions="p"'
    root = model_xml(
        '<object id="1"><components><component objectid="7" p:path="/3D/Objects/Box.model"/></components>'
        "</object>",
        '<item objectid="1"/>',
        attributes,
    )
    inner = model_xml(f'<object id="7">{mesh_xml()}</object>', "")
    path = write_3mf(tmp_path / "box.3mf", root, {"3D/Objects/box.model": inner})
    assert take_in(path, None).report.volume == pytest.approx(VOLUME, rel=1e-9)


def test_the_model_is_the_one_that_the_package_names(tmp_path: Path) -> None:
    relations = (
        '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships"><Relationship '
        'Target="/3D/other.model" Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>'
        "</Relationships>"
    )
    model = model_xml(f'<object id="1">{mesh_xml()}</object>', '<item objectid="1"/>', 'unit="inch"')
    empty = model_xml("", "")
    path = write_3mf(tmp_path / "box.3mf", empty, {"_rels/.rels": relations, "3D/other.model": model})
    assert read_3mf(path).metres == 0.0254


def test_a_required_extension_is_refused_by_its_name(tmp_path: Path) -> None:
    space = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
    attributes = f'unit="millimeter" xmlns:b="{space}" requiredextensions="b"'
    model = model_xml(f'<object id="1">{mesh_xml()}</object>', '<item objectid="1"/>', attributes)
    with pytest.raises(MeshRefused, match="beamlattice"):
        take_in(write_3mf(tmp_path / "box.3mf", model), None)


def test_an_unknown_unit_is_refused(tmp_path: Path) -> None:
    model = model_xml(f'<object id="1">{mesh_xml()}</object>', '<item objectid="1"/>', 'unit="furlong"')
    with pytest.raises(MeshRefused, match="furlong"):
        take_in(write_3mf(tmp_path / "box.3mf", model), None)


def test_colours_of_objects_and_corners_are_read(tmp_path: Path) -> None:
    corners = mesh_xml(properties=' p1="0" p2="1" p3="0"')
    resources = (
        '<basematerials id="5"><base name="a" displaycolor="#FF0000"/>'
        '<base name="b" displaycolor="#00FF00FF"/></basematerials>'
        f'<m:colorgroup xmlns:m="{MATERIALS}" id="6"><m:color color="#0000FF"/><m:color color="#808080"/>'
        "</m:colorgroup>"
        f'<object id="1" pid="5" pindex="1">{mesh_xml()}</object>'
        f'<object id="2" pid="6" pindex="0">{corners}</object>'
    )
    items = '<item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 60 0 0"/>'
    made = read_appearance(write_3mf(tmp_path / "box.3mf", model_xml(resources, items)), "mm")
    grey = ((128 / 255 + 0.055) / 1.055) ** 2.4
    assert np.allclose(made.tints[:12], [0.0, 1.0, 0.0])
    assert made.tints[12:, 0] == pytest.approx(np.tile([0.0, 0.0, 1.0], (12, 1)))
    assert made.tints[12:, 1] == pytest.approx(np.full((12, 3), grey))
