"""The up axis of a mesh file: declared by it or stated in a scene, and z of the object's frame everywhere."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.geometry import UPRIGHT
from harness.bench.scene import SceneFile, scene_from_json, scene_from_options
from harness.effects.scene_object import known_object
from harness.sim.light.appearance_source import read_appearance
from harness.sim.solid.intake import surface_of
from harness.sim.solid.volume_mesh import read_volume
from tests.support.made_meshes import CORNERS, FACES, SIDES

FILES = Path(__file__).parents[2] / "samples" / "mesh_files"
BOTTLE = FILES / "bottle_y_up.glb"


def in_base(scene: SceneFile) -> list[float]:
    """Extents of the scene's object in the robot's base, m."""
    mesh = known_object(scene).mesh
    points = mesh.vertices @ scene.base_from_object(mesh)[:3, :3].T
    return [float(extent) for extent in np.ptp(points, axis=0)]


def test_a_bottle_stands_in_a_scene() -> None:
    scene = scene_from_options(str(BOTTLE), "plastic")
    assert in_base(scene) == pytest.approx([0.04, 0.04, 0.12], abs=1e-6)
    assert "y is up (declared" in known_object(scene).read[0]


def test_an_axis_of_the_scene_replaces_the_declared_one() -> None:
    scene = scene_from_options(str(BOTTLE), "plastic", up_axis="z")
    assert in_base(scene) == pytest.approx([0.04, 0.12, 0.04], abs=1e-6)


@pytest.mark.parametrize(
    ("axis", "height"), [(None, SIDES[2]), ("x", SIDES[0]), ("y", SIDES[1]), ("z", SIDES[2])]
)
def test_a_file_that_declares_none_stands_as_stated(tmp_path: Path, axis: str | None, height: float) -> None:
    path = tmp_path / "box.obj"
    lines = [*(f"v {x} {y} {z}" for x, y, z in CORNERS), *(f"f {a} {b} {c}" for a, b, c in FACES + 1)]
    path.write_text("\n".join(lines))
    assert in_base(scene_from_options(str(path), "steel", "m", up_axis=axis))[2] == pytest.approx(height)
    # The same frame for modes, touch and colours.
    surface, look = surface_of(str(path), "m", None, axis).mesh, read_appearance(path, "m", up_axis=axis).mesh
    own = np.sort(CORNERS @ UPRIGHT[axis or "z"].T, axis=0)
    for mesh in (surface, look):
        assert mesh.bounds == pytest.approx(own[[0, -1]], abs=1e-12)


def test_tetrahedra_are_rotated_alike() -> None:
    as_stated, upright = (read_volume(FILES / "block_clamp.msh", "mm", axis) for axis in (None, "y"))
    assert as_stated is not None
    assert upright is not None
    assert upright.mesh.nodes == pytest.approx(as_stated.mesh.nodes @ UPRIGHT["y"].T, abs=1e-12)
    assert "y is up (requested)" in upright.said[0]


def test_a_pose_that_rotates_a_declaring_file_again_is_refused() -> None:
    tree = {"mesh": str(BOTTLE), "material": "plastic", "pose": {"up": "y"}}
    with pytest.raises(WrongUse, match=r"up_axis = \"z\""):
        known_object(scene_from_json({"schema": 1, "object": tree}, "the test"))
    scene = scene_from_json({"schema": 1, "object": {**tree, "up_axis": "z"}}, "the test")
    assert in_base(scene) == pytest.approx([0.04, 0.04, 0.12], abs=1e-6)


@pytest.mark.parametrize(("mesh", "axis"), [("builtin:mug", "y"), (str(BOTTLE), "w"), (str(BOTTLE), "-y")])
def test_an_axis_that_cannot_be_is_refused(mesh: str, axis: str) -> None:
    with pytest.raises(WrongUse, match="up_axis"):
        scene_from_options(mesh, "plastic", up_axis=axis)
    with pytest.raises(WrongUse, match="up"):
        surface_of(mesh, None, None, axis)
