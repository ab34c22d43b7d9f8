"""Colours and normals of surfaces: exact where they can be, and the same whatever the file is like."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from harness.basics.arrays import ByteArray
from harness.basics.errors import DataRefused, MeshRefused, OutOfDomain, WrongUse
from harness.objects.builtin import MATERIALS, build
from harness.picture.srgb import LINEAR_OF_BYTE
from harness.sim.light.appearance import Appearance, plain, smooth_normals
from harness.sim.light.appearance_source import COLOURS, appearance_of, builtin_appearance, read_appearance
from tests.oracles.seen_shapes import ball, cuboid, square

FACES = np.array([0, 1, 0, 1])
WEIGHTS = np.array([[0.0, 0.0], [0.3, 0.4], [1.0, 0.0], [0.0, 1.0]])


def textured_square(texture: ByteArray, stretch: float = 1.0, shift: float = 0.0) -> Appearance:
    """(u, v) is 0 to 1 over the square of 1 m, times ``stretch``, plus ``shift``."""
    mesh = square(1.0)
    places = stretch * (mesh.corners[..., :2] + 0.5) + shift
    return Appearance(
        mesh, smooth_normals(mesh), np.ones((2, 3, 3)), places, np.zeros(2, np.int64), (texture,)
    )


def at(x: float, y: float) -> tuple[np.ndarray, np.ndarray]:
    """Face and weights of a place of the square's first face."""
    # Corners (0, 0), (1, 0), (1, 1): the place is u - v of the second corner and v of the third.
    return np.array([0]), np.array([[x - y, y]])


def test_texel_centres_have_their_own_colour_v_up() -> None:
    texture = np.arange(4 * 4 * 3, dtype=np.uint8).reshape(4, 4, 3) * 5
    seen = textured_square(texture).albedo(*at(0.625, 0.125))
    np.testing.assert_allclose(seen[0], LINEAR_OF_BYTE[texture[3, 2]], rtol=1e-12)


def test_between_texels_light_is_linear_not_grey_levels() -> None:
    texture = np.zeros((1, 2, 3), np.uint8)
    texture[0, 1] = 255
    np.testing.assert_allclose(textured_square(texture).albedo(*at(0.5, 0.1)), 0.5, rtol=1e-12)


@pytest.mark.parametrize("shift", [-3.0, 1.0, 7.0])
def test_textures_repeat(shift: float) -> None:
    texture = np.random.default_rng(1).integers(0, 255, (5, 7, 3), dtype=np.uint8)
    one, other = textured_square(texture), textured_square(texture, shift=shift)
    for place in ((0.0, 0.0), (0.3, 0.2), (1.0, 1.0), (0.999, 0.001)):
        np.testing.assert_allclose(one.albedo(*at(*place)), other.albedo(*at(*place)), rtol=1e-9)


def test_tints_are_interpolated_and_multiply_the_texture() -> None:
    mesh = square(1.0)
    tints = np.zeros((2, 3, 3))
    tints[0] = np.eye(3)
    texture = np.full((1, 1, 3), 128, np.uint8)
    made = Appearance(mesh, smooth_normals(mesh), tints, np.zeros((2, 3, 2)), np.array([0, -1]), (texture,))
    found = made.albedo(np.array([0]), np.array([[0.3, 0.5]]))
    np.testing.assert_allclose(found[0], np.array([0.2, 0.3, 0.5]) * LINEAR_OF_BYTE[128], rtol=1e-12)


def test_normals_of_a_ball_point_away_from_its_middle() -> None:
    def lean(subdivisions: int) -> tuple[float, float]:
        mesh = ball(0.05, subdivisions)
        radial = mesh.corners / np.linalg.norm(mesh.corners, axis=2, keepdims=True)
        smooth = np.einsum("mcx,mcx->mc", smooth_normals(mesh), radial).min()
        flat = np.einsum("mx,mcx->mc", mesh.face_normals, radial).min()
        return float(np.arccos(smooth)), float(np.arccos(flat))

    coarse, fine = lean(2), lean(4)
    # Facets of uneven shape pull a little: first order in their size, as flat ones are, and far less.
    assert fine[0] < fine[1] / 6.0
    assert fine[0] < coarse[0] / 3.5


def test_edges_stay_sharp_and_flat_faces_flat() -> None:
    box = cuboid(0.1, 0.2, 0.3)
    np.testing.assert_allclose(
        smooth_normals(box), np.repeat(box.face_normals[:, None], 3, axis=1), atol=1e-15
    )


def test_a_seam_of_the_texture_is_none_of_the_shape() -> None:
    mesh = ball(0.05, 2)
    split = type(mesh)(mesh.corners.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3))
    np.testing.assert_allclose(smooth_normals(split), smooth_normals(mesh), atol=1e-14)


def test_without_a_crease_every_face_is_flat() -> None:
    mesh = ball(0.05, 1)
    np.testing.assert_array_equal(smooth_normals(mesh, 0.0), np.repeat(mesh.face_normals[:, None], 3, axis=1))


@pytest.mark.parametrize("crease", [-0.1, 4.0, np.nan])
def test_a_crease_that_is_none_is_refused(crease: float) -> None:
    with pytest.raises(OutOfDomain, match="crease"):
        smooth_normals(ball(0.05, 1), crease)


def test_a_face_without_area_has_normals_without_nan() -> None:
    mesh = ball(0.05, 1)
    flat = type(mesh)(mesh.vertices, np.vstack([mesh.faces, [[0, 0, 1], [0, 1, 1]]]))
    assert np.isfinite(smooth_normals(flat)).all()


@pytest.mark.parametrize("name", list(MATERIALS))
def test_built_in_objects_have_both_colours_and_stay_between_them(name: str) -> None:
    made = builtin_appearance(name, edge=8e-3)
    random = np.random.default_rng(2)
    faces = random.integers(0, len(made.mesh.faces), 4000)
    weights = random.dirichlet(np.ones(3), 4000)[:, 1:]
    seen = made.albedo(faces, weights)
    base, printed = (np.array(colour) for colour in COLOURS[MATERIALS[name]])
    grey_level = 0.006
    assert (seen > np.minimum(base, printed) - grey_level).all()
    assert (seen < np.maximum(base, printed) + grey_level).all()
    if name != "ball":  # its box is nearly all stem: the print may pass it by
        for colour in (base, printed):
            assert (np.abs(seen - colour).max(axis=1) < grey_level).sum() > 40


def test_a_print_does_not_depend_on_the_tessellation() -> None:
    # A box's faces have the same places however they are cut: the tray's plane top, at two edges.
    coarse, fine = builtin_appearance("tray", edge=8e-3), builtin_appearance("tray", edge=4e-3)
    for made in (coarse, fine):
        low, high = made.mesh.bounds
        expected = ((made.mesh.corners - low) / (high - low))[..., :2]
        np.testing.assert_allclose(made.places, expected, atol=1e-12)


def write_square_obj(folder: Path, texture: ByteArray | None, kd: str = "1 1 1") -> Path:
    named = "" if texture is None else "map_Kd print.png\n"
    (folder / "square.mtl").write_text(f"newmtl one\nKd {kd}\n{named}")
    if texture is not None:
        cv2.imwrite(str(folder / "print.png"), texture[..., ::-1])
    corners = "v -50 -50 0\nv 50 -50 0\nv 50 50 0\nv -50 50 0\n"
    places = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    path = folder / "square.obj"
    path.write_text(f"mtllib square.mtl\n{corners}{places}usemtl one\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")
    return path


def test_a_file_is_read_with_its_texture_in_metres(tmp_path: Path) -> None:
    texture = np.random.default_rng(3).integers(0, 255, (4, 4, 3), dtype=np.uint8)
    made = read_appearance(write_square_obj(tmp_path, texture), "mm")
    np.testing.assert_allclose(made.mesh.bounds, [[-0.05, -0.05, 0], [0.05, 0.05, 0]])
    np.testing.assert_array_equal(made.textures[0], texture)
    # Lower left corner of the picture is (u, v) = (0, 0).
    centre_of_first = np.array([[0.0, 0.125]])
    np.testing.assert_allclose(
        made.albedo(np.array([0]), centre_of_first), LINEAR_OF_BYTE[texture[3, 0]][None], rtol=1e-6
    )


def test_a_file_without_texture_has_its_materials_colour(tmp_path: Path) -> None:
    made = read_appearance(write_square_obj(tmp_path, None, "0.5 0.25 1"), "cm")
    np.testing.assert_allclose(made.tints[0, 0], LINEAR_OF_BYTE[[128, 64, 255]], rtol=1e-9)
    assert not made.textures


def test_a_file_that_says_no_colour_is_grey_and_says_so(tmp_path: Path) -> None:
    import trimesh

    path = tmp_path / "box.stl"
    trimesh.creation.box((20, 20, 20)).export(path)
    made = read_appearance(path, "mm")
    assert made.tints.min() == made.tints.max()
    np.testing.assert_allclose(made.mesh.bounds, [[-0.01] * 3, [0.01] * 3])


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("meshes/ycb_ocrtoc/scissors/textured.obj", "m"),
        ("meshes/ycb_isaac/025_mug/textured.obj", "cm"),
    ],
)
def test_scans_have_their_texture(shared_data: Path, name: str, units: str) -> None:
    made = read_appearance(shared_data / name, units)
    assert len(made.textures) == 1
    assert 0.05 < made.mesh.diagonal < 0.5
    random = np.random.default_rng(4)
    faces = random.integers(0, len(made.mesh.faces), 5000)
    seen = made.albedo(faces, random.dirichlet(np.ones(3), 5000)[:, 1:])
    assert np.isfinite(seen).all()
    # A constant colour would have none: the places are of the texture (the mug is nearly pure red).
    assert seen.std(axis=0).max() > 0.04


def test_a_scan_whose_texture_is_missing_says_so(shared_data: Path) -> None:
    made = read_appearance(shared_data / "meshes/ycb_ocrtoc/bowl/textured.obj", "m")
    assert not made.textures
    assert any("texture" in remark for remark in made.remarks)


def test_what_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"none\.obj"):
        read_appearance(tmp_path / "none.obj", "m")
    path = tmp_path / "empty.obj"
    path.write_text("v 0 0 0\n")
    with pytest.raises(MeshRefused):
        read_appearance(path, "m")
    with pytest.raises(WrongUse, match="furlong"):
        read_appearance(path, "furlong")
    with pytest.raises(WrongUse, match="scale"):
        read_appearance(path, "m", 0.0)
    with pytest.raises(WrongUse, match="unit"):
        appearance_of(str(path), None)
    with pytest.raises(WrongUse, match="spoon"):
        appearance_of("builtin:spoon", None)


def test_an_appearance_that_is_none_is_refused() -> None:
    mesh = square(1.0)
    normals, zeros, none = smooth_normals(mesh), np.zeros((2, 3, 2)), np.full(2, -1)
    with pytest.raises(DataRefused, match="2 faces"):
        Appearance(mesh, normals[:1], np.ones((2, 3, 3)), zeros, none)
    with pytest.raises(DataRefused, match=r"1\.5"):
        Appearance(mesh, normals, np.full((2, 3, 3), 1.5), zeros, none)
    with pytest.raises(DataRefused, match="textures"):
        Appearance(mesh, normals, np.ones((2, 3, 3)), zeros, np.zeros(2, np.int64))
    with pytest.raises(OutOfDomain, match="-1 to -1"):
        plain(mesh, (0.5, 0.5, 0.5)).albedo(np.array([-1]), np.zeros((1, 2)))


def test_faces_stay_those_of_the_mesh() -> None:
    np.testing.assert_array_equal(builtin_appearance("mug", edge=6e-3).mesh.faces, build("mug", 6e-3).faces)
