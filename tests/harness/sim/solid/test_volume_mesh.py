"""Files of tetrahedra: solved on their own nodes, or refused by the number of the element."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.sim.modal.file import modes_of_file
from harness.sim.solid.tetrahedra import QuadraticMesh, quadratic_mesh
from harness.sim.solid.volume_mesh import VolumeMesh, read_volume
from tests.oracles.volume_meshes import box

STEEL = MATERIALS["steel"]
SIDES = (0.1, 0.03, 0.02)


def bar() -> QuadraticMesh:
    """Cells that are none of them symmetric."""
    plain = box(SIDES, (4, 1, 1))
    return quadratic_mesh(plain.nodes, plain.cells)


def written(
    path: Path,
    nodes: FloatArray,
    cells: IntArray,
    sets: Mapping[str, Any] | None = None,
    file_format: str | None = None,
) -> Path:
    kind = "tetra10" if cells.shape[1] == 10 else "tetra"
    meshio.write_points_cells(path, nodes, [(kind, cells)], point_sets=sets, file_format=file_format)
    return path


def read(path: Path, units: str | None = "m") -> VolumeMesh:
    found = read_volume(path, units)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> FloatArray:
    mesh = bar()
    file = written(tmp_path_factory.mktemp("bar") / "bar.vtu", mesh.nodes, mesh.cells)
    return modes_of_file(file, STEEL, "m", count=6).solution.modes.frequencies


@pytest.mark.parametrize("name", ["bar.inp", "bar.vtu", "bar.vtk", "bar.msh"])
def test_ten_node_cells_of_any_format_are_solved_as_they_are(
    name: str, tmp_path: Path, reference: FloatArray
) -> None:
    mesh = bar()
    kind = "gmsh" if name.endswith("msh") else None
    file = written(tmp_path / name, mesh.nodes * 1e3, mesh.cells, file_format=kind)
    found = modes_of_file(file, STEEL, "mm", count=6)
    assert found.volume_mesh
    assert len(found.notes) == 1, "nothing but what was read"
    assert found.solution.certified
    assert found.solution.unknowns == 3 * len(mesh.nodes)
    assert found.solution.modes.frequencies == pytest.approx(reference, rel=1e-8)


def test_abaqus_input_as_its_manual_writes_it(tmp_path: Path) -> None:
    """One C3D10: corners 1 to 4, then the middles of 12, 23, 13, 14, 24, 34; numbers with gaps."""
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    nodes = np.concatenate([corners, [(corners[a] + corners[b]) / 2 for a, b in pairs]])
    lines = [f"{10 * k + 5}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(nodes.tolist())]
    cell = "7, " + ", ".join(str(10 * k + 5) for k in range(10))
    text = "\n".join(["*NODE", *lines, "*ELEMENT, TYPE=C3D10, ELSET=ALL", cell, ""])
    file = tmp_path / "one.inp"
    file.write_text(text)
    found = read(file)
    assert len(found.said) == 1, "nothing but what was read"
    assert found.mesh.nodes == pytest.approx(nodes)
    assert found.quality == pytest.approx(0.77, abs=0.01)


def test_four_node_cells_gain_middle_nodes_and_say_so(tmp_path: Path, reference: FloatArray) -> None:
    plain = box(SIDES, (4, 1, 1))
    found = modes_of_file(written(tmp_path / "bar.vtu", plain.nodes, plain.cells), STEEL, "m", count=6)
    assert any("middle nodes" in sentence for sentence in found.notes)
    assert found.solution.modes.frequencies == pytest.approx(reference, rel=1e-9)


def test_middle_nodes_in_another_order_are_put_in_order(tmp_path: Path, reference: FloatArray) -> None:
    """As a program that exchanges the last two writes them."""
    mesh = bar()
    other = mesh.cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]]
    found = modes_of_file(written(tmp_path / "bar.vtu", mesh.nodes, other), STEEL, "m", count=6)
    assert any("5 6 7 8 10 9" in sentence for sentence in found.notes)
    assert found.solution.modes.frequencies == pytest.approx(reference, rel=1e-9)


def test_middle_nodes_of_one_cell_in_another_order_are_named(tmp_path: Path) -> None:
    mesh = bar()
    cells = mesh.cells.copy()
    cells[5] = cells[5][[0, 1, 2, 3, 5, 4, 6, 7, 8, 9]]
    with pytest.raises(MeshRefused, match=r"element 6 of 24 .*corners 1 to 4"):
        read_volume(written(tmp_path / "bar.vtu", mesh.nodes, cells), "m")


@pytest.mark.parametrize("corners", [4, 10])
def test_cells_numbered_the_other_way_round_are_turned(
    corners: int, tmp_path: Path, reference: FloatArray
) -> None:
    mesh = bar()
    mirrored = np.array([1, 0, 2, 3, 4, 6, 5, 8, 7, 9])[:corners]
    cells = mesh.cells[:, :corners].copy()
    cells[::3] = cells[::3][:, mirrored]
    nodes = mesh.nodes[: cells.max() + 1]
    found = modes_of_file(written(tmp_path / "bar.vtu", nodes, cells), STEEL, "m", count=6)
    assert any("8 elements " in sentence for sentence in found.notes)
    assert found.solution.modes.frequencies == pytest.approx(reference, rel=1e-9)
    everywhere = read(written(tmp_path / "all.vtu", nodes, mesh.cells[:, :corners][:, mirrored]))
    assert not any("other way round" in sentence for sentence in everywhere.said)


def test_nodes_that_no_element_holds_are_left_out_and_said(tmp_path: Path, reference: FloatArray) -> None:
    mesh = bar()
    nodes = np.concatenate([[[9.0, 9.0, 9.0]], mesh.nodes, [[np.nan] * 3]])
    found = modes_of_file(written(tmp_path / "bar.vtu", nodes, mesh.cells + 1), STEEL, "m", count=6)
    assert "2 nodes that no element holds are left out" in found.notes
    assert found.solution.modes.frequencies == pytest.approx(reference, rel=1e-9)


def test_a_node_on_the_wrong_side_of_a_face_is_named(tmp_path: Path) -> None:
    plain = box((0.04, 0.04, 0.04), (2, 2, 2))
    middle = np.argmin(np.linalg.norm(plain.nodes - 0.02, axis=1))
    nodes = plain.nodes.copy()
    nodes[middle] += [0.03, 0.0, 0.0]
    with pytest.raises(MeshRefused, match=r"element.* of 48 .*inverted"):
        read_volume(written(tmp_path / "tangled.vtu", nodes, plain.cells), "m")


def test_a_cell_that_its_middle_nodes_turn_inside_out_is_named(tmp_path: Path) -> None:
    mesh = bar()
    nodes = mesh.nodes.copy()
    ends = nodes[mesh.cells[3, [0, 1]]]
    nodes[mesh.cells[3, 4]] = ends[0] + 0.15 * (ends[1] - ends[0])
    with pytest.raises(MeshRefused, match=r"element.* 4.*volume"):
        read_volume(written(tmp_path / "bent.vtu", nodes, mesh.cells), "m")


@pytest.mark.parametrize("height", [0.0, 1e-13])
def test_a_sliver_is_named_with_its_quality(height: float, tmp_path: Path) -> None:
    plain = box(SIDES, (4, 1, 1))
    top = plain.nodes[plain.cells[0]][:3].mean(axis=0) + np.array([0.0, 0.0, height])
    nodes = np.concatenate([plain.nodes, [top]])
    cells = np.concatenate([plain.cells, [[*plain.cells[0][:3], len(plain.nodes)]]])
    with pytest.raises(MeshRefused, match=r"element 25 of 25 .*quality is \d"):
        read_volume(written(tmp_path / "sliver.vtu", nodes, cells), "m")


def test_a_poor_cell_is_said_with_its_number(tmp_path: Path) -> None:
    nodes = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.03, 0.03, 2e-6]])
    found = read(written(tmp_path / "poor.vtu", nodes, np.array([[0, 1, 2, 3]])))
    assert found.quality < 1e-3
    assert any("element 1 of 1 " in sentence for sentence in found.said)


def test_two_bodies_have_twelve_rigid_motions(tmp_path: Path, reference: FloatArray) -> None:
    mesh = bar()
    nodes = np.concatenate([mesh.nodes, mesh.nodes + np.array([0.0, 0.0, 0.02])])
    cells = np.concatenate([mesh.cells, mesh.cells + len(mesh.nodes)])
    found = modes_of_file(written(tmp_path / "two.vtu", nodes, cells), STEEL, "m", count=12)
    assert found.bodies == 2
    assert found.solution.modes.rigid == 12
    assert found.solution.modes.frequencies[:12] == pytest.approx(np.repeat(reference[:6], 2), rel=1e-8)
    assert any("coincide" in sentence for sentence in found.notes)


def test_parts_that_meet_at_an_edge_are_said_to_turn(tmp_path: Path) -> None:
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]]) * 0.1
    found = read(written(tmp_path / "hinge.vtu", nodes, np.array([[0, 1, 2, 3], [0, 1, 4, 5]])))
    assert found.bodies == 1
    assert any("turn about it" in sentence for sentence in found.said)


def test_a_crack_and_a_hanging_node_are_named(tmp_path: Path) -> None:
    mesh = bar()
    nodes, cells = np.concatenate([mesh.nodes, mesh.nodes[mesh.cells[0, 4:5]]]), mesh.cells.copy()
    cells[0, 4] = len(mesh.nodes)
    with pytest.raises(MeshRefused, match="cracked"):
        read_volume(written(tmp_path / "crack.vtu", nodes, cells), "m")
    hanging = mesh.cells.copy()
    hanging[0, 0] = hanging[1, 6]
    with pytest.raises(MeshRefused, match=r"\d+ nodes .*node \d"):
        read_volume(written(tmp_path / "hang.vtu", mesh.nodes, hanging), "m")


def test_other_cells_and_damage_are_refused(tmp_path: Path) -> None:
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    file = tmp_path / "hex.vtu"
    meshio.write_points_cells(file, cube, [("hexahedron", np.array([[0, 4, 6, 2, 1, 5, 7, 3]]))])
    with pytest.raises(MeshRefused, match="hexahedron"):
        read_volume(file, "m")
    broken = tmp_path / "broken.inp"
    broken.write_text("*NODE\n1, 0, 0\n*ELEMENT, TYPE=C3D10\n")
    with pytest.raises(MeshRefused, match="broken"):
        read_volume(broken, "m")


def test_metres_and_millimetres(tmp_path: Path, reference: FloatArray) -> None:
    mesh = bar()
    file = written(tmp_path / "mm.vtu", mesh.nodes * 1e3, mesh.cells)
    assert read(file, "mm").mesh.nodes == pytest.approx(
        read(written(tmp_path / "m.vtu", mesh.nodes, mesh.cells)).mesh.nodes
    )
    assert read(written(tmp_path / "m.vtu", mesh.nodes, mesh.cells), None).units == "m"
    with pytest.raises(WrongUse, match="--units m, cm, mm"):
        read_volume(file, None)
    with pytest.raises(WrongUse, match="'furlong'"):
        read_volume(file, "furlong")
    huge = read(written(tmp_path / "huge.vtu", mesh.nodes * 1e3, mesh.cells), "m")
    assert np.ptp(huge.mesh.nodes, axis=0) == pytest.approx(np.array(SIDES) * 1e3)


def test_a_surface_is_left_to_the_intake_of_surfaces(tmp_path: Path) -> None:
    file = tmp_path / "triangle.vtu"
    meshio.write_points_cells(file, np.eye(3), [("triangle", np.array([[0, 1, 2]]))])
    assert read_volume(file) is None
    assert read_volume(tmp_path / "absent.vtu") is None


def test_a_set_of_nodes_or_a_side_can_be_held(tmp_path: Path) -> None:
    mesh = bar()
    root = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    file = written(tmp_path / "held.inp", mesh.nodes, mesh.cells, {"ROOT": root})
    by_set = modes_of_file(file, STEEL, "m", count=3, fixed=["ROOT"])
    by_side = modes_of_file(file, STEEL, "m", count=3, fixed=["x-min"])
    assert by_set.held_nodes == by_side.held_nodes == len(root)
    assert by_set.solution.modes.rigid == 0
    assert by_set.solution.modes.frequencies == pytest.approx(by_side.solution.modes.frequencies)
    rolling = modes_of_file(file, STEEL, "m", count=3, fixed=["z-min:z"])
    assert rolling.solution.modes.rigid == 3
    for wrong in ("RODT", "x-min:w"):
        with pytest.raises(WrongUse, match=r"ROOT|x, y and z"):
            modes_of_file(file, STEEL, "m", fixed=[wrong])


def test_what_belongs_to_surfaces_is_refused_of_tetrahedra(tmp_path: Path) -> None:
    mesh = bar()
    file = written(tmp_path / "bar.vtu", mesh.nodes, mesh.cells)
    with pytest.raises(WrongUse, match="--wall"):
        modes_of_file(file, STEEL, "m", wall=1e-3)
    with pytest.raises(WrongUse, match="--edge"):
        modes_of_file(file, STEEL, "m", edge=1e-3)
    with pytest.raises(WrongUse, match="--envelope"):
        modes_of_file(file, STEEL, "m", envelope=1e-5)
    plain = box(SIDES, (8, 2, 2))
    with pytest.raises(WrongUse, match=r"\d+ modes.*\d+ unknowns"):
        modes_of_file(written(tmp_path / "fine.vtu", plain.nodes, plain.cells), STEEL, "m", count=500)
