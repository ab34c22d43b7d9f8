from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objects.household import build
from harness.sim.solid.intake import take_in

REAL = {
    "ycb_isaac/025_mug/textured.obj": ("cm", 0.1167),
    "ycb_ocrtoc/bowl/textured.obj": ("m", 0.1615),
    "contactdb_objects/wineglass.stl": ("m", 0.1720),
    "contactdb_objects/teapot.stl": ("m", 0.2349),
    "contactdb_objects/fryingpan.stl": ("m", 0.2360),
}


def write(mesh: Mesh, path: Path, factor: float = 1.0) -> Path:
    if path.suffix in {".msh", ".vtk"}:
        meshio.Mesh(mesh.vertices * factor, [("triangle", mesh.faces)]).write(path)
    else:
        trimesh.Trimesh(mesh.vertices * factor, mesh.faces, process=False).export(path)
    return path


@pytest.fixture(scope="module")
def mug() -> Mesh:
    return build("mug")


def volume(mesh: Mesh) -> float:
    return float(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "off", "msh", "vtk", "glb"])
def test_every_format_gives_the_same_object(mug: Mesh, tmp_path: Path, suffix: str) -> None:
    # The writer keeps z up where glTF has y up by definition.
    taken = take_in(write(mug, tmp_path / f"mug.{suffix}"), "m", up_axis="z")
    assert taken.report.watertight
    # Formats keep 32 bits or eight decimals of a metre.
    assert volume(taken.mesh) == pytest.approx(volume(mug), rel=2e-5)
    assert taken.mesh.bounds == pytest.approx(mug.bounds, abs=1e-7)
    assert taken.report.warnings == ()


@pytest.mark.parametrize(("name", "expected"), REAL.items())
def test_real_meshes_are_taken_in_unprepared(
    shared_data: Path, name: str, expected: tuple[str, float]
) -> None:
    units, longest = expected
    taken = take_in(shared_data / "meshes" / name, units)
    assert taken.report.longest_side == pytest.approx(longest, abs=1e-4)
    assert taken.report.watertight
    assert taken.report.bodies == 1
    assert taken.report.volume is not None
    assert taken.report.volume > 0.0
    assert not taken.report.warnings


def test_a_file_in_centimetres_is_asked_about_naming_both_readings(shared_data: Path) -> None:
    with pytest.raises(WrongUse) as refused:
        take_in(shared_data / "meshes/ycb_isaac/025_mug/textured.obj", None)
    text = str(refused.value)
    for part in ("11.67 cm (0.117 m)", "11.67 mm (0.0117 m)", "--units cm", "--units mm"):
        assert part in text


def test_a_solid_scan_of_a_pitcher_is_warned_about_unless_its_wall_is_said(shared_data: Path) -> None:
    path = shared_data / "meshes/ycb_ocrtoc/pitcher/textured.obj"
    assert any("--wall" in warning for warning in take_in(path, "m").report.warnings)
    said = take_in(path, "m", wall=2e-3).report
    assert not any("--wall" in warning for warning in said.warnings)
    assert said.mass(1200.0) == pytest.approx(1200.0 * 2e-3 * said.area)


@pytest.mark.parametrize(
    ("factor", "readings"),
    [(1e3, "94.79|114.6 mm"), (1.0, None), (1e2, "cm .* or .*mm"), (10.0, "1.146 m .* or 1.146 cm")],
)
def test_units_are_asked_for_only_when_two_readings_are_possible(
    mug: Mesh, tmp_path: Path, factor: float, readings: str | None
) -> None:
    path = write(mug, tmp_path / "mug.stl", factor)
    if readings is None:
        assert take_in(path, None).report.units_from == "the only reading of its size"
    else:
        with pytest.raises(WrongUse, match=readings):
            take_in(path, None)


@pytest.mark.parametrize(("units", "factor"), [("m", 1.0), ("cm", 1e2), ("mm", 1e3), ("in", 1 / 0.0254)])
def test_the_unit_changes_the_numbers_and_not_the_object(
    mug: Mesh, tmp_path: Path, units: str, factor: float
) -> None:
    taken = take_in(write(mug, tmp_path / "mug.ply", factor), units)
    assert taken.mesh.bounds == pytest.approx(mug.bounds, abs=1e-7)


def test_a_format_that_defines_its_unit_is_not_asked_about(mug: Mesh, tmp_path: Path) -> None:
    report = take_in(write(mug, tmp_path / "mug.glb", 10.0), None).report
    assert report.units == "m"
    assert report.units_from == "declared by the file"


def test_scale_multiplies_lengths(mug: Mesh, tmp_path: Path) -> None:
    path = write(mug, tmp_path / "mug.stl")
    once, twice = take_in(path, "m"), take_in(path, "m", scale=2.0)
    assert twice.report.longest_side == pytest.approx(2.0 * once.report.longest_side, rel=1e-12)
    assert twice.report.sha256 == once.report.sha256


def test_taking_in_what_was_taken_in_changes_nothing(mug: Mesh, tmp_path: Path) -> None:
    once = take_in(write(mug, tmp_path / "mug.ply"), "m")
    again = take_in(write(once.mesh, tmp_path / "again.ply"), "m")
    assert len(again.mesh.faces) == len(once.mesh.faces)
    assert again.report.repairs == ()


def test_a_volume_mesh_gives_its_outside(tmp_path: Path) -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 0.1
    cells = np.array([[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 6, 4, 7], [0, 2, 6, 7]])
    meshio.Mesh(corners, [("tetra", cells)]).write(tmp_path / "cube.msh")
    report = take_in(tmp_path / "cube.msh", None).report
    assert report.watertight
    assert report.faces == 12
    assert report.volume == pytest.approx(1e-3)
    assert report.mass(2500.0) == pytest.approx(2.5)


@pytest.mark.parametrize("units", ["meters", "MM", ""])
def test_an_unknown_unit_is_refused_with_those_there_are(mug: Mesh, tmp_path: Path, units: str) -> None:
    with pytest.raises(WrongUse, match="m, cm, mm, um, in, ft"):
        take_in(write(mug, tmp_path / "mug.stl"), units)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_a_scale_that_makes_no_object_is_refused(mug: Mesh, tmp_path: Path, scale: float) -> None:
    with pytest.raises(WrongUse, match="scale of "):
        take_in(write(mug, tmp_path / "mug.stl"), "m", scale=scale)


@pytest.mark.parametrize(("units", "factor"), [("m", 100.0), ("mm", 1.0), ("m", 0.01)])
def test_an_absurd_size_is_refused_with_the_limits(
    mug: Mesh, tmp_path: Path, units: str, factor: float
) -> None:
    with pytest.raises(MeshRefused, match="5 mm to 2 m"):
        take_in(write(mug, tmp_path / "mug.stl", factor), units)


@pytest.mark.parametrize("wall", [0.0, -1e-3, float("nan")])
def test_a_wall_without_thickness_is_refused(mug: Mesh, tmp_path: Path, wall: float) -> None:
    with pytest.raises(WrongUse, match="wall"):
        take_in(write(mug, tmp_path / "mug.stl"), "m", wall=wall)


def test_a_wall_thicker_than_the_object_is_refused(mug: Mesh, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"60 mm.* mm"):
        take_in(write(mug, tmp_path / "mug.stl"), "m", wall=0.06)
