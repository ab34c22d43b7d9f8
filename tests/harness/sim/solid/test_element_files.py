"""Abaqus and Nastran files: what they require is read, or refused by its name."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import MeshRefused
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import read_cells, read_mesh
from harness.sim.solid.volume_mesh import read_volume
from tests.oracles.volume_meshes import box

BLOCK = box((40.0, 30.0, 20.0), (1, 1, 1))
VOLUME = 2.4e-5


def rows(values: AnyArray, first: int = 1) -> str:
    return "\n".join(f"{first + k}, {', '.join(map(str, row))}" for k, row in enumerate(values.tolist()))


NODES, CELLS = rows(BLOCK.nodes), rows(BLOCK.cells + 1)
PART = f"*Part, name=A\n*Node\n{NODES}\n*Element, type=C3D4\n{CELLS}\n*Nset, nset=FOOT\n1, 2\n*End Part\n"
FLAT = f"*Node\n{NODES}\n*Element, type=C3D4\n{CELLS}\n"
ASSEMBLY = "*Assembly, name=X\n{}*End Assembly\n"


def inp(folder: Path, text: str) -> Path:
    (folder / "some.inp").write_text(text)
    return folder / "some.inp"


def instance(name: str, placement: str = "") -> str:
    return f"*Instance, name={name}, part=A\n{placement}*End Instance\n"


def test_an_instance_is_moved_and_then_rotated(tmp_path: Path) -> None:
    turned = instance("one", "100., 0., 0.\n0., 0., 0., 0., 0., 1., 90.\n")
    path = inp(tmp_path, PART + ASSEMBLY.format(turned + instance("two")))
    found = read_cells(path)
    x, y, z = (BLOCK.nodes + np.array([100.0, 0.0, 0.0])).T
    assert found.points == pytest.approx(np.vstack([np.column_stack([-y, x, z]), BLOCK.nodes]))
    assert take_in(path, "mm").report.volume == pytest.approx(2 * VOLUME)
    assert [len(found.point_sets[name]) for name in ("FOOT", "one.FOOT")] == [4, 2]
    assert "2 instances are read as one object" in found.notes


def test_parts_with_the_same_node_numbers_keep_their_own_nodes(tmp_path: Path) -> None:
    other = PART.replace("name=A", "name=B").replace(NODES, rows(BLOCK.nodes * 0.5))
    both = instance("one") + instance("two", "100., 0., 0.\n").replace("part=A", "part=B")
    assert take_in(inp(tmp_path, PART + other + ASSEMBLY.format(both)), "mm").report.volume == pytest.approx(
        VOLUME * 1.125
    )
    alone = take_in(inp(tmp_path, PART + other + ASSEMBLY.format(instance("one"))), "mm").report
    assert alone.volume == pytest.approx(VOLUME)
    assert "1 parts without an instance are left out" in alone.warnings


def test_a_mesh_of_its_own_belongs_to_its_instance(tmp_path: Path) -> None:
    own = f"*Instance, name=one, part=A\n5., 0., 0.\n{FLAT}*End Instance\n"
    path = inp(tmp_path, "*Part, name=A\n*End Part\n" + ASSEMBLY.format(own))
    assert read_cells(path).points == pytest.approx(BLOCK.nodes + np.array([5.0, 0.0, 0.0]))


def test_sets_of_the_assembly_and_generated_sets_have_their_nodes(tmp_path: Path) -> None:
    sets = "*Nset, nset=TOP, instance=two, generate\n3, 7, 2\n*Nset, nset=BOTH, instance=one\nFOOT\n"
    found = read_cells(inp(tmp_path, PART + ASSEMBLY.format(instance("one") + instance("two") + sets)))
    assert found.point_sets["TOP"].tolist() == [10, 12, 14]
    assert found.point_sets["BOTH"].tolist() == [0, 1]


def test_cylindrical_nodes_and_keywords_over_two_lines_are_read(tmp_path: Path) -> None:
    x, y, z = BLOCK.nodes.T
    polar = np.column_stack([np.hypot(x, y), np.degrees(np.arctan2(y, x)), z])
    text = f"** c\n*NODE,\n SYSTEM=C\n{rows(polar)}\n*element , TYPE = C3D4H\n{CELLS}\n"
    found = read_cells(inp(tmp_path, text))
    assert found.points == pytest.approx(BLOCK.nodes)
    assert [block.type for block in found.cells] == ["tetra"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (FLAT + "*Include, input=other.inp\n", r"\*INCLUDE "),
        (FLAT + "*Ngen\n1, 5, 1\n", r"\*NGEN "),
        (FLAT + "*Elcopy, element shift=5\n", r"\*ELCOPY "),
        ("*System\n1., 0., 0.\n" + FLAT, r"line 1: \*SYSTEM "),
        (FLAT.replace("*Node", "*Node, system=S", 1), r"\*NODE, SYSTEM=S "),
        ("*Node, input=nodes.txt\n", r"\*NODE, INPUT=nodes.txt "),
        (PART + ASSEMBLY.format("*Instance, library=old, instance=I\n*End Instance\n"), "another file"),
        (PART + ASSEMBLY.format("*Instance, name=I, part=B\n*End Instance\n"), "'B'"),
        (PART + ASSEMBLY.format(instance("I", "1., 2.\n")), "3 numbers.* 7"),
        (PART + PART, "two .*'A'"),
        (FLAT.replace("1, 0.0, 0.0, 0.0", "1, 0,0, 0,0, 0,0"), "decimal commas"),
        (FLAT.replace("*Element", "1, 7., 7., 7.\n*Element"), "node 1 .*two"),
        (FLAT + "*Element, type=C3D4\n99, 1, 2, 3, 99\n", "node 99"),
        (FLAT + "*Element, type=C3D4\n99, 1, 2, 3\n", "4 numbers .* 4 nodes"),
        (FLAT + "*Nset, nset=A, generate\n1, 999999999999\n", "nodes"),
        (PART + ASSEMBLY.format(instance("I") * 10_001), "10,000 instances"),
    ],
)
def test_what_an_abaqus_file_requires_and_is_not_read_is_refused(
    text: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(MeshRefused, match=said):
        read_volume(inp(tmp_path, text), "mm")
    with pytest.raises(MeshRefused, match=said):
        read_mesh(inp(tmp_path, text))


def field(value: object, width: int) -> str:
    return f"{value:<{width}}"


def small(*values: object) -> str:
    return "".join(field(value, 8) for value in values).rstrip()


def large(name: str, *values: object) -> str:
    lines = [values[at : at + 4] for at in range(0, len(values), 4)]
    heads = [f"{name}*", *("*" for _ in lines[1:])]
    return "\n".join(
        field(head, 8) + "".join(field(v, 16) for v in line) for head, line in zip(heads, lines, strict=True)
    )


def grids(places: FloatArray, system: object = "", write: str = "free") -> str:
    lines = []
    for number, (x, y, z) in enumerate(places.tolist(), 1):
        values = (number, system, f"{x:.12g}", f"{y:.12g}", f"{z:.12g}")
        if write == "free":
            lines.append(",".join(map(str, ("GRID", *values))))
        elif write == "small":
            lines.append(small("GRID", number, system, f"{x:.4f}", f"{y:.4f}", f"{z:.4f}"))
        else:
            lines.append(large("GRID", *values))
    return "\n".join(lines) + "\n"


def tets(write: str = "free") -> str:
    lines = []
    for number, cell in enumerate((BLOCK.cells + 1).tolist(), 1):
        values = (number, 1, *cell)
        lines.append(
            ",".join(map(str, ("CTETRA", *values)))
            if write == "free"
            else small("CTETRA", *values)
            if write == "small"
            else large("CTETRA", *values)
        )
    return "\n".join(lines) + "\n"


def bdf(folder: Path, text: str, begin: str = "SOL 103\nCEND\nBEGIN BULK\n") -> Path:
    (folder / "some.bdf").write_text(f"{begin}{text}ENDDATA\n")
    return folder / "some.bdf"


@pytest.mark.parametrize("begin", ["SOL 103\nCEND\nBEGIN BULK\n", "begin bulk\n", ""])
@pytest.mark.parametrize("write", ["free", "small", "large"])
def test_all_kinds_of_fields_are_read(write: str, begin: str, tmp_path: Path) -> None:
    path = bdf(tmp_path, "$ c\n" + grids(BLOCK.nodes, "", write) + "PARAM,POST,-1\n" + tets(write), begin)
    assert read_cells(path).points == pytest.approx(BLOCK.nodes)
    assert take_in(path, "mm").report.volume == pytest.approx(VOLUME)


def test_ten_nodes_continue_on_a_second_line_and_exponents_need_no_letter(tmp_path: Path) -> None:
    ends = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
    nodes = np.vstack([ends, *[0.5 * (ends[a] + ends[b])[None] for a, b in pairs]]) * 1e3
    written = grids(nodes).replace(",1000,", ",1.+3,")
    for cell in (
        small("CTETRA", 1, 1, 1, 2, 3, 4, 5, 6, "+A") + "\n" + small("+A", 7, 8, 9, 10),
        small("CTETRA", 1, 1, 1, 2, 3, 4, 5, 6) + "\n" + small("", 7, 8, 9, 10),
        "CTETRA,1,1,1,2,3,4,5,6,+\n+,7,8,9,10",
        "CTETRA,1,1,1,2,3,4,5,6\n,7,8,9,10",
        large("CTETRA", 1, 1, *range(1, 11)),
    ):
        found = read_cells(bdf(tmp_path, f"{written}{cell}\n"))
        assert [block.type for block in found.cells] == ["tetra10"]
        assert found.cells[0].data.tolist() == [list(range(10))]
        assert found.points == pytest.approx(nodes)


ORIGIN, TURN = np.array([10.0, -20.0, 30.0]), np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""The rows of TURN are the axes of the system."""


def system(name: str, number: int, reference: int, points: Sequence[FloatArray]) -> str:
    numbers = [f"{value:.6g}" for point in points for value in point]
    return f"{name},{number},{reference},{','.join(numbers[:6])}\n,{','.join(numbers[6:])}\n"


def defined(kind: str, number: int = 7, reference: int = 0) -> str:
    return system(f"CORD2{kind}", number, reference, (ORIGIN, ORIGIN + TURN[2], ORIGIN + TURN[0] + TURN[2]))


LOCAL = (BLOCK.nodes - ORIGIN) @ TURN.T


def in_system(kind: str) -> FloatArray:
    x, y, z = LOCAL.T
    across = np.hypot(x, y)
    about = np.degrees(np.arctan2(y, x))
    if kind == "C":
        return np.column_stack([across, about, z])
    return (
        np.column_stack([np.hypot(across, z), np.degrees(np.arctan2(across, z)), about])
        if kind == "S"
        else LOCAL
    )


@pytest.mark.parametrize("kind", ["R", "C", "S"])
def test_grid_points_of_a_coordinate_system_are_where_it_places_them(kind: str, tmp_path: Path) -> None:
    path = bdf(tmp_path, defined(kind) + grids(in_system(kind), 7) + tets())
    assert read_cells(path).points == pytest.approx(BLOCK.nodes, abs=1e-4)
    assert take_in(path, "mm").report.volume == pytest.approx(VOLUME, rel=1e-6)


def test_a_system_in_a_system_and_a_default_system_are_followed(tmp_path: Path) -> None:
    identity = system("CORD2R", 8, 7, (np.zeros(3), np.eye(3)[2], np.eye(3)[0]))
    path = bdf(tmp_path, identity + defined("R") + "GRDSET,,8\n" + grids(LOCAL) + tets())
    assert read_cells(path).points == pytest.approx(BLOCK.nodes, abs=1e-6)


def test_a_system_by_grid_points_is_followed(tmp_path: Path) -> None:
    three = [ORIGIN, ORIGIN + TURN[2], ORIGIN + TURN[0]]
    by = "".join(f"GRID,{101 + k},,{','.join(map(str, point))}\n" for k, point in enumerate(three))
    path = bdf(tmp_path, "CORD1R,7,101,102,103\n" + by + grids(LOCAL, 7) + tets())
    assert read_cells(path).points[3:] == pytest.approx(BLOCK.nodes, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (grids(BLOCK.nodes, 7) + tets(), "coordinate system 7 .*not"),
        (defined("R", 7, 7) + grids(LOCAL, 7) + tets(), "coordinate system 7 .*itself"),
        ("CORD1R,7,1,2,3\n" + grids(LOCAL, 7) + tets(), "coordinate system 7 .*itself"),
        (system("CORD2R", 7, 0, [ORIGIN] * 3) + grids(LOCAL, 7), "three points"),
        ("CORD3G,7\n" + grids(LOCAL) + tets(), "CORD3G "),
        ("INCLUDE 'other.bdf'\n" + grids(LOCAL) + tets(), "INCLUDE "),
        (grids(BLOCK.nodes) + "CTETRA,1,1,1,2,3\n", "CTETRA .*3 nodes .*4 or 10"),
        (grids(BLOCK.nodes) + "CTETRA,1,1,1,2,3,99\n", "grid point 99"),
        (grids(BLOCK.nodes) + "GRID,1,,0.,0.,0.\n", "two grid points 1"),
        ("GRID           1        1,5     2,0     3,0\n", "line 4: .*decimal commas"),
        ("GRID ID 5\n", "line 4: .*name"),
        ("GRID,1,,x,2.,3.\n", "line 4: .*GRID.*'x'"),
        (
            small("CTETRA", 1, 1, 1, 2, 3, 4, 5, 6, "+A") + "\n" + small("+B", 7, 8, 9, 10) + "\n",
            "sort",
        ),
    ],
)
def test_what_a_nastran_file_requires_and_is_not_read_is_refused(
    text: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(MeshRefused, match=said):
        read_volume(bdf(tmp_path, text), "mm")


def test_superelements_and_files_named_before_the_bulk_data_are_refused(tmp_path: Path) -> None:
    text = grids(BLOCK.nodes) + tets()
    for begin, said in (
        ("BEGIN SUPER=1\n", "superelements"),
        ("INCLUDE 'a.bdf'\nBEGIN BULK\n", "INCLUDE 'a.bdf'"),
    ):
        with pytest.raises(MeshRefused, match=said):
            read_mesh(bdf(tmp_path, text, begin))
