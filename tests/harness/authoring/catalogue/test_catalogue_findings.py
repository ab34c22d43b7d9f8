"""What intake says of an object before it is built."""

from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from harness.authoring.catalogue.findings import intake_finding
from harness.authoring.catalogue.rows import CatalogueRow, read_catalogue

ROW = CatalogueRow("block", "steel")


def block(folder: Path, sides: tuple[float, float, float], name: str = "block.stl") -> str:
    path = folder / name
    trimesh.creation.box(sides).export(path)
    return str(path)


@pytest.mark.parametrize(("unit", "scale"), [("m", 1.0), ("cm", 1e2), ("mm", 1e3)])
def test_a_label_decides_the_unit_of_a_mesh_that_does_not_state_one(
    tmp_path: Path, unit: str, scale: float
) -> None:
    mesh = block(tmp_path, (0.3 * scale, 0.1 * scale, 0.1 * scale))
    found = intake_finding(replace(ROW, scale=0.3), mesh)
    assert (found.units, found.reason) == (unit, None)
    assert found.longest_side_m == pytest.approx(0.3)
    assert found.mass_kg == pytest.approx(3e-3 * 7850.0, rel=0.02)


def test_without_a_label_two_readings_exclude_and_say_what_to_do(tmp_path: Path) -> None:
    found = intake_finding(ROW, block(tmp_path, (150.0, 50.0, 50.0)))
    assert found.reason is not None
    assert "units" in found.reason


def test_a_label_of_another_side_is_found(tmp_path: Path) -> None:
    mesh = block(tmp_path, (0.2, 0.1, 0.08))
    (remark,) = [s for s in intake_finding(replace(ROW, scale=0.081), mesh).remarks if "label" in s]
    assert "0.081 m " in remark
    assert " z" in remark
    assert not any("label" in s for s in intake_finding(replace(ROW, scale=0.204), mesh).remarks)


def test_an_impossible_mass_is_found_by_size_and_by_weight(tmp_path: Path) -> None:
    mesh = block(tmp_path, (0.2, 0.2, 0.2))
    assert any("0.2 m " in remark for remark in intake_finding(ROW, mesh).remarks)
    wooden = replace(ROW, material="wood", mass=6.0)
    assert not any("kg" in remark for remark in intake_finding(wooden, mesh).remarks)
    (remark,) = [s for s in intake_finding(replace(wooden, mass=1.0), mesh).remarks if "weighs" in s]
    assert "(6 times)" in remark


def test_a_wall_thinner_than_its_limit_is_found(tmp_path: Path) -> None:
    assert any(
        "1/250" in remark for remark in intake_finding(ROW, block(tmp_path, (0.25, 0.2, 0.001))).remarks
    )
    assert not any(
        "wall of" in remark for remark in intake_finding(ROW, block(tmp_path, (0.1, 0.1, 0.004))).remarks
    )


def test_an_open_surface_has_no_sound_and_may_have_a_touch(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide().subdivide()
    box.update_faces(box.triangles_center[:, 2] < 0.049)
    box.export(tmp_path / "open.stl")
    row = replace(ROW, units="m")
    found = intake_finding(row, str(tmp_path / "open.stl"))
    assert found.reason is not None
    assert "open" in found.reason
    assert found.watertight is False
    assert intake_finding(row, str(tmp_path / "open.stl"), sound=False).reason is None
    walled = intake_finding(replace(row, wall=2e-3), str(tmp_path / "open.stl"))
    assert walled.reason is None
    # Vertices of edges move along the diagonal between two faces, so walls are thinner beside them.
    assert 0.8 < (walled.mass_kg or 0.0) / (5 * 0.01 * 2e-3 * 7850.0) < 1.0


def test_a_file_that_is_no_mesh_is_excluded_with_its_reason(tmp_path: Path) -> None:
    (tmp_path / "a.stl").write_bytes(b"solid\n")
    assert "a.stl" in (intake_finding(ROW, str(tmp_path / "a.stl")).reason or "")
    assert "'teapot'" in (intake_finding(ROW, "builtin:teapot").reason or "")


def test_the_published_label_of_the_mug_is_its_height(shared_data: Path) -> None:
    folder = shared_data / "meshes" / "objectfolder"
    mug = next(row for row in read_catalogue(folder / "objects.csv").rows if row.name == "025_mug")
    found = intake_finding(replace(mug, mass=0.118), str(folder / "demo_model.obj"))
    assert found.longest_side_m == pytest.approx(0.117, rel=1e-3)
    assert any("0.082 m " in s and "along z" in s for s in found.remarks)
    assert any("weighs 0.118 kg (9.2 times)" in remark for remark in found.remarks)


def test_a_scan_of_an_outside_is_found(shared_data: Path) -> None:
    pitcher = CatalogueRow("019_pitcher_base", "plastic", scale=0.235, mass=0.178)
    found = intake_finding(pitcher, str(shared_data / "meshes" / "ycb_ocrtoc" / "pitcher" / "textured.obj"))
    assert any("--wall" in remark for remark in found.remarks)
    assert any("weighs 0.178 kg" in remark for remark in found.remarks)
