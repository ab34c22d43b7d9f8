"""COLLADA: its unit, its axis, and the transformations of its nodes."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import MeshRefused
from harness.sim.light.appearance_source import read_appearance
from harness.sim.solid.formats.collada import read_collada
from harness.sim.solid.intake import take_in
from tests.support.made_meshes import CORNERS, FACES, SIDES, VOLUME, dae_xml

FILES = Path(__file__).parents[4] / "samples" / "mesh_files"


def write(folder: Path, text: str) -> Path:
    path = folder / "box.dae"
    path.write_text(text)
    return path


def test_a_decimetre_is_the_file_s_unit() -> None:
    report = take_in(FILES / "decimetre.dae", None).report
    assert report.longest_side == pytest.approx(0.04, abs=1e-9)
    assert "unit 0.1 m (declared" in report.summary


@pytest.mark.parametrize("metres", [1e-3, 0.0254, 0.3048, 0.07, 1.234, 3.0])
def test_any_factor_is_the_file_s_unit(tmp_path: Path, metres: float) -> None:
    asset = f'<unit name="theirs" meter="{metres}"/><up_axis>Z_UP</up_axis>'
    positions = " ".join(map(repr, (CORNERS / metres).ravel().tolist()))
    report = take_in(write(tmp_path, dae_xml(asset, positions=positions)), None).report
    assert report.longest_side == pytest.approx(SIDES[0], rel=1e-12)
    assert report.volume == pytest.approx(VOLUME, rel=1e-12)


@pytest.mark.parametrize("metres", ["0", "-1", "nan", "inf", "", "a metre", "1e999", "-0.0"])
def test_a_factor_that_is_no_length_is_refused(tmp_path: Path, metres: str) -> None:
    with pytest.raises(MeshRefused, match=r"unit .* m;"):
        take_in(write(tmp_path, dae_xml(f'<unit meter="{metres}"/>')), None)


@pytest.mark.parametrize(
    ("axis", "low", "high"),
    [
        ("<up_axis>Z_UP</up_axis>", (0.0, 0.0, 0.0), SIDES),
        ("<up_axis>Y_UP</up_axis>", (0.0, -SIDES[2], 0.0), (SIDES[0], 0.0, SIDES[1])),
        ("<up_axis> X_UP </up_axis>", (-SIDES[2], 0.0, 0.0), (0.0, SIDES[1], SIDES[0])),
        ("", (0.0, -SIDES[2], 0.0), (SIDES[0], 0.0, SIDES[1])),
    ],
)
def test_the_up_axis_of_the_file_becomes_z(
    tmp_path: Path, axis: str, low: tuple[float, ...], high: tuple[float, ...]
) -> None:
    bounds = take_in(write(tmp_path, dae_xml(f'<unit meter="1"/>{axis}')), None).mesh.bounds
    assert bounds == pytest.approx(np.array([low, high]), abs=1e-9)


def test_an_axis_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshRefused, match="W_UP"):
        take_in(write(tmp_path, dae_xml("<up_axis>W_UP</up_axis>")), None)


def test_transformations_apply_from_the_last_to_the_first(tmp_path: Path) -> None:
    inner = '<node id="i"><scale>2 1 1</scale><instance_geometry url="#g"/></node>'
    nodes = f'<node id="n"><translate>1 0 0</translate><rotate>0 0 1 90</rotate>{inner}</node>'
    part = read_collada(write(tmp_path, dae_xml(nodes=nodes))).parts[0]
    assert part.vertices.min(axis=0) == pytest.approx([1.0 - SIDES[1], 0.0, 0.0], abs=1e-12)
    assert part.vertices.max(axis=0) == pytest.approx([1.0, 2 * SIDES[0], SIDES[2]], abs=1e-12)


def test_nodes_of_a_library_are_placed_where_they_are_instanced(tmp_path: Path) -> None:
    library = '<library_nodes><node id="lib"><instance_geometry url="#g"/></node></library_nodes>'
    moved = '<node><matrix>1 0 0 0.1 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url="#lib"/></node>'
    nodes = f'<node><instance_node url="#lib"/></node>{moved}'
    report = take_in(write(tmp_path, dae_xml(nodes=nodes, more=library)), None).report
    assert report.bodies == 2
    assert report.longest_side == pytest.approx(0.14, abs=1e-9)


def test_geometry_that_the_scene_does_not_place_is_no_object(tmp_path: Path) -> None:
    with pytest.raises(MeshRefused, match="triangle"):
        take_in(write(tmp_path, dae_xml(nodes="<node/>")), None)


QUADS = ([0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3])


@pytest.mark.parametrize("kind", ["polylist", "polygons", "trifans", "tristrips"])
def test_all_primitives_are_read(tmp_path: Path, kind: str) -> None:
    vertex = '<input semantic="VERTEX" source="#v" offset="0"/>'
    order = [[a, b, d, c] for a, b, c, d in QUADS] if kind == "tristrips" else list(QUADS)
    lists = [" ".join(map(str, quad)) for quad in order]
    if kind == "polylist":
        body = f"<vcount>{'4 ' * 6}</vcount><p>{' '.join(lists)}</p>"
    else:
        body = "".join(f"<p>{each}</p>" for each in lists)
    path = write(tmp_path, dae_xml(primitive=f'<{kind} count="6">{vertex}{body}</{kind}>'))
    report = take_in(path, None).report
    assert report.watertight
    assert report.volume == pytest.approx(VOLUME, rel=1e-12)


def test_a_concave_polygon_is_filled_as_it_stands(tmp_path: Path) -> None:
    # An L: a fan from its first corner would cover what is outside it.
    outline = "0 0 0  2 0 0  2 1 0  1 1 0  1 2 0  0 2 0"
    text = dae_xml(
        primitive='<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>6</vcount>'
        "<p>3 4 5 0 1 2</p></polylist>",
        positions=f"{outline} 0 0 0 0 0 0",
    )
    part = read_collada(write(tmp_path, text)).parts[0]
    a, b, c = (part.vertices[part.faces[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2.0
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("0 1 3 0 3 2", "0 1 3 0 3 8"), "vertex 8"),
        (("0 1 3 0 3 2", "0 1 3 0 3 -1"), "vertex -1"),
        (("0 1 3 0 3 2", "0 1 3 0 3 x"), "no number"),
        (("0.04 0.03 0.02<", "0.04 0.03<"), "8 elements"),
        (("0.04 0.03 0.02<", "0.04 0.03 two<"), "no number"),
        (('url="#g"', 'url="#other"'), "geometry"),
        (('url="#g"', 'url="other.dae#g"'), "geometry"),
        (("<p>", "<ph><p>"), "XML"),
        (('count="8"', 'count="100000000000"'), "accessor|100"),
        (('count="8"', 'count="-1"'), "accessor"),
        (('offset="0"/><p>', 'offset="99999999999"/><p>'), "offset"),
        (("0.04 0.03 0.02<", "0.04 0.03 nan<"), "finite"),
    ],
)
def test_damage_is_refused_with_its_place(tmp_path: Path, change: tuple[str, str], reason: str) -> None:
    text = dae_xml()
    assert change[0] in text
    with pytest.raises(MeshRefused, match=reason):
        take_in(write(tmp_path, text.replace(*change)), None)


def test_a_colour_and_a_picture_are_those_of_the_bound_material(tmp_path: Path) -> None:
    import cv2

    picture = np.array([[[10, 20, 30], [200, 100, 50]]], np.uint8)
    (tmp_path / "a folder").mkdir()
    cv2.imwrite(str(tmp_path / "a folder" / "print.png"), picture[..., ::-1])
    diffuse = {
        "plain": "<color>1 0 0 1</color>",
        "print": '<texture texture="sampler" texcoord="UV"/>',
    }
    effects = "".join(
        f'<effect id="e-{name}"><profile_COMMON><newparam sid="surface"><surface type="2D"><init_from>image'
        '</init_from></surface></newparam><newparam sid="sampler"><sampler2D><source>surface</source>'
        f'</sampler2D></newparam><technique sid="c"><lambert><diffuse>{inner}</diffuse></lambert></technique>'
        "</profile_COMMON></effect>"
        for name, inner in diffuse.items()
    )
    materials = "".join(
        f'<material id="m-{name}"><instance_effect url="#e-{name}"/></material>' for name in diffuse
    )
    more = (
        '<library_images><image id="image"><init_from>./a%20folder/print.png</init_from></image>'
        "</library_images>"
        f"<library_effects>{effects}</library_effects><library_materials>{materials}</library_materials>"
    )
    faces = " ".join(f"{corner} {k % 3}" for k, corner in enumerate(FACES.ravel().tolist()))
    primitive = (
        '<triangles count="12" material="s"><input semantic="VERTEX" source="#v" offset="0"/>'
        f'<input semantic="TEXCOORD" source="#t" offset="1" set="0"/><p>{faces}</p></triangles>'
    )
    inputs = (
        '<source id="t"><float_array id="ta" count="6">0 0 1 0 0 1</float_array><technique_common>'
        '<accessor source="#ta" count="3" stride="2"><param name="S"/><param name="T"/></accessor>'
        "</technique_common></source>"
    )
    for name in diffuse:
        bound = (
            f'<bind_material><technique_common><instance_material symbol="s" target="#m-{name}"/>'
            "</technique_common></bind_material>"
        )
        nodes = f'<node id="n"><instance_geometry url="#g">{bound}</instance_geometry></node>'
        made = read_appearance(
            write(tmp_path, dae_xml(primitive=primitive, nodes=nodes, more=more, inputs=inputs)), "m"
        )
        if name == "plain":
            assert not made.textures
            assert np.allclose(made.tints, [1.0, 0.0, 0.0])
        else:
            np.testing.assert_array_equal(made.textures[0], picture)
            assert made.places[0] == pytest.approx(np.array([[0, 0], [1, 0], [0, 1]]))
