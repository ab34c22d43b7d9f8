"""Files that were read as another object: each gives its right value, in one line that every command says."""

from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from harness.basics.errors import MeshRefused
from harness.bench.scene import scene_from_json
from harness.effects.scene_object import known_object
from harness.sim.solid.intake import surface_of, take_in
from harness.sim.solid.mesh_read import read_mesh
from harness.sim.solid.volume_mesh import read_volume
from tests.oracles.volume_meshes import box

FILES = Path(__file__).parents[3] / "samples" / "mesh_files"
RIGHT = {
    "two_rel.obj": ("mm", 2, 6.7e-5, 0.1),
    "block_clamp.msh": ("mm", 1, 1.44e-4, 0.12),
    "four_inch.3mf": (None, 1, 24 * 0.0254**3, 0.1016),
    "count_too_small.stl": ("mm", 1, 2.7e-5, 0.03),
    "tail.stl": ("mm", 1, 2.7e-5, 0.03),
    "channel.off": ("mm", 1, 1.248e-4, 0.08),
    "two_instances.inp": ("mm", 2, 4.8e-5, 0.14),
    "node_blocks.inp": ("mm", 1, 2.4e-5, 0.06),
    "bom_pivot.obj": ("mm", 1, 2.4e-5, 0.04),
    "bom.stl": ("mm", 1, 2.4e-5, 0.04),
    "utm.obj": ("m", 1, 2.4e-5, 0.04),
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_file_is_the_object_that_its_maker_meant(name: str) -> None:
    units, pieces, volume, longest = RIGHT[name]
    report = take_in(FILES / name, units).report
    assert (report.bodies, report.watertight) == (pieces, True)
    assert report.volume == pytest.approx(volume)
    assert report.longest_side == pytest.approx(longest)


def test_a_flat_sheet_is_open_and_has_a_mass_only_with_a_wall() -> None:
    assert take_in(FILES / "sheet.obj", "mm").report.mass(7800.0) is None
    assert take_in(FILES / "sheet.obj", "mm", wall=1e-3).report.mass(7800.0) is not None


@pytest.mark.parametrize("name", ["two_rel.obj", "block_clamp.msh", "two_instances.inp", "node_blocks.inp"])
def test_every_command_says_the_same_of_a_file(name: str) -> None:
    path = FILES / name
    summary = take_in(path, "mm").report.summary
    assert summary in surface_of(str(path), "mm", None).said
    tree = {"schema": 1, "object": {"mesh": str(path), "units": "mm", "material": "steel"}}
    assert known_object(scene_from_json(tree, "the test")).read == (summary,)
    volume = read_volume(path, "mm")
    if volume is not None:
        assert volume.said[0] == summary


def test_the_line_has_pieces_triangles_volume_unit_and_where_the_unit_came_from() -> None:
    said = take_in(FILES / "four_inch.3mf", None).report.summary
    for part in ("four_inch.3mf", "1 piece,", "12 triangles", "393.3 cm^3", "unit in (declared by the file)"):
        assert part in said


def test_solids_of_other_kinds_are_refused_in_every_command_alike(tmp_path: Path) -> None:
    cube = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], dtype=float)
    cells = [("hexahedron", [list(range(8))]), ("triangle", [[0, 1, 2]])]
    meshio.write_points_cells(tmp_path / "cube.vtu", cube, cells)
    with pytest.raises(MeshRefused, match="hexahedron") as by_touch:
        read_mesh(tmp_path / "cube.vtu")
    with pytest.raises(MeshRefused, match="hexahedron") as by_modes:
        read_volume(tmp_path / "cube.vtu", "m")
    assert str(by_touch.value) == str(by_modes.value)


def test_a_unit_that_is_said_against_the_file_s_own_is_named(tmp_path: Path) -> None:
    surface = box((0.1, 0.1, 0.1), (1, 1, 1)).surface
    trimesh.Trimesh(surface.vertices, surface.faces, process=False).export(tmp_path / "some.glb")
    assert take_in(tmp_path / "some.glb", None).report.units_from == "declared by the file"
    assert "the m that the file declares" in take_in(tmp_path / "some.glb", "ft").report.units_from
