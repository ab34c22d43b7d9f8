"""Colours of mesh files: textures of every kind where the file names them, materials and vertices."""

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import MeshRefused
from harness.picture.image_file import decode_texture
from harness.picture.srgb import LINEAR_OF_BYTE, linear_from_srgb
from harness.sim.light.appearance import Appearance
from harness.sim.light.appearance_source import read_appearance
from tests.support.made_meshes import CORNERS, FACES, add_accessor, box_tree, write_glb

FILES = Path(__file__).parents[3] / "samples" / "mesh_files"
RED, BLUE = LINEAR_OF_BYTE[[200, 30, 30]], LINEAR_OF_BYTE[[30, 30, 200]]


def albedos(made: Appearance) -> FloatArray:
    """Albedos at points of all faces, away from their edges."""
    random = np.random.default_rng(1)
    faces = random.integers(0, len(made.mesh.faces), 500)
    weights = 0.1 + 0.7 * random.dirichlet(np.ones(3), 500)
    return made.albedo(faces, weights[:, 1:])


def test_a_texture_transform_of_the_file_is_followed() -> None:
    made = read_appearance(FILES / "tex_transform.glb", "m")
    places = made.places.reshape(-1, 2)
    assert (places.min(axis=0), places.max(axis=0)) == (
        pytest.approx([0.0, 0.0], abs=1e-6),
        pytest.approx([0.5, 1.0], abs=1e-6),
    )
    inside = (made.places.mean(axis=1)[:, 0] > 0.1) & (made.places.mean(axis=1)[:, 0] < 0.4)
    middles = made.albedo(np.flatnonzero(inside), np.full((int(inside.sum()), 2), 1.0 / 3.0))
    assert len(middles) == 12
    assert middles == pytest.approx(np.tile(RED, (12, 1)), abs=0.01)


@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        ({"offset": [0.25, 0.5]}, [(0.25, 0.5), (1.25, 0.5), (0.25, 1.5)]),
        ({"scale": [0.5, 2.0]}, [(0.0, 0.0), (0.5, 0.0), (0.0, 2.0)]),
        # Counter-clockwise as the picture is seen, where v points down.
        ({"rotation": np.pi / 2}, [(0.0, 0.0), (0.0, -1.0), (1.0, 0.0)]),
        (
            {"rotation": np.pi / 2, "scale": [2.0, 3.0], "offset": [0.5, 0.0]},
            [(0.5, 0.0), (0.5, -2.0), (3.5, 0.0)],
        ),
    ],
)
def test_each_part_of_a_texture_transform(
    tmp_path: Path, transform: dict[str, Any], expected: list[tuple[float, float]]
) -> None:
    made = read_appearance(textured_triangle(tmp_path, transform), "m")
    u, v = np.array(expected).T
    assert made.places[0] == pytest.approx(np.column_stack([u, 1.0 - v]), abs=1e-6)


def textured_triangle(
    folder: Path,
    transform: dict[str, Any] | None = None,
    factor: list[float] | None = None,
    colours: Any = None,
    uri: str | None = None,
    **material: Any,
) -> Path:
    """Write a GLB whose first triangle has texture places (0, 0), (1, 0), (0, 1), v downwards."""
    tree, data = box_tree()
    picture = png(np.full((4, 4, 3), 128, np.uint8))
    data = add_accessor(tree, data, CORNERS[FACES].reshape(-1, 3).astype("<f4"), "VEC3", 5126)
    data = add_accessor(tree, data, np.tile(np.array([[0, 0], [1, 0], [0, 1]], "<f4"), (12, 1)), "VEC2", 5126)
    attributes = {"POSITION": 2, "TEXCOORD_0": 3}
    if colours is not None:
        values, component, more = colours
        data = add_accessor(tree, data, values, f"VEC{values.shape[1]}", component, **more)
        attributes["COLOR_0"] = 4
    start = len(data) + -len(data) % 4
    data += bytes(start - len(data)) + picture
    tree["bufferViews"].append({"buffer": 0, "byteOffset": start, "byteLength": len(picture)})
    tree["buffers"][0]["byteLength"] = len(data)
    info: dict[str, Any] = {"index": 0}
    if transform is not None:
        info["extensions"] = {"KHR_texture_transform": transform}
    rough: dict[str, Any] = {"baseColorTexture": info}
    if factor is not None:
        rough["baseColorFactor"] = factor
    image = {"bufferView": len(tree["bufferViews"]) - 1} if uri is None else {"uri": uri}
    tree |= {
        "images": [{**image, "mimeType": "image/png"}],
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": rough, **material}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
    }
    return write_glb(folder / "box.glb", tree, data)


def png(image: Any) -> bytes:
    return bytes(cv2.imencode(".png", image)[1].tobytes())


def test_factor_vertex_colour_and_texture_are_linear_and_multiply(tmp_path: Path) -> None:
    tints = np.tile(np.array([[0.5, 1.0, 0.25]], "<f4"), (36, 1))
    path = textured_triangle(tmp_path, factor=[0.5, 0.25, 1.0, 1.0], colours=(tints, 5126, {}))
    expected = LINEAR_OF_BYTE[128] * np.array([0.25, 0.25, 0.25])
    assert albedos(read_appearance(path, "m")) == pytest.approx(np.tile(expected, (500, 1)), abs=1e-6)


@pytest.mark.parametrize(
    ("dtype", "component", "more"),
    [("u1", 5121, {"normalized": True}), ("<u2", 5123, {"normalized": True}), ("u1", 5121, {})],
)
def test_vertex_colours_of_whole_numbers_are_shares(
    tmp_path: Path, dtype: str, component: int, more: dict[str, Any]
) -> None:
    peak = np.iinfo(np.dtype(dtype)).max
    tints = np.tile(np.array([[peak, 0, peak // 2 + 1, peak]], dtype), (36, 1))
    made = read_appearance(textured_triangle(tmp_path, colours=(tints, component, more)), "m")
    assert made.tints[:, :, [0, 1, 2]] == pytest.approx(np.tile([1.0, 0.0, 0.5], (12, 3, 1)), abs=0.002)


def test_a_factor_without_a_texture_is_linear(tmp_path: Path) -> None:
    tree, data = box_tree()
    tree["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1.0, 0.5]}, "alphaMode": "BLEND"}
    ]
    tree["meshes"][0]["primitives"][0]["material"] = 0
    made = read_appearance(write_glb(tmp_path / "box.glb", tree, data), "m")
    assert made.tints == pytest.approx(np.tile([0.5, 0.25, 1.0], (12, 3, 1)))
    assert any("BLEND" in remark for remark in made.remarks)


def test_what_a_material_has_besides_is_named(tmp_path: Path) -> None:
    path = textured_triangle(tmp_path, normalTexture={"index": 0}, emissiveFactor=[1, 0, 0])
    said = " ".join(read_appearance(path, "m").remarks)
    assert "normalTexture" in said
    assert "emissiveFactor" in said


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    made = read_appearance(textured_triangle(tmp_path, uri="gone.png"), "m")
    assert any("gone.png" in remark for remark in made.remarks)
    assert not made.textures


def write_obj(folder: Path, mtl: str, faces: str = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n") -> Path:
    corners = "v -50 -50 0\nv 50 -50 0\nv 50 50 0\nv -50 50 0\n"
    (folder / "square.mtl").write_text(f"newmtl one\nKd 0.1 0.2 0.3\n{mtl}\n")
    path = folder / "square.obj"
    path.write_text(f"mtllib square.mtl\n{corners}vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl one\n{faces}")
    return path


def test_backslashes_of_windows_separate_folders() -> None:
    made = read_appearance(FILES / "windows.obj", "mm")
    assert len(made.textures) == 1
    colours = albedos(made)
    for colour in (RED, BLUE):
        assert (np.abs(colours - colour).max(axis=1) < 0.01).sum() > 50


PRINT = np.random.default_rng(3).integers(0, 255, (4, 4, 3), dtype=np.uint8)


@pytest.mark.parametrize(
    "options",
    [
        *("", "-s 1 1 1 -o 0 0 0", "-bm 1", "-blendu on -blendv off -clamp off", "-s 1 -o 0 0"),
        *("-mm 0 1 -texres 256", "-S 1 1 1", "-imfchan l"),
    ],
)
@pytest.mark.parametrize("name", ["print.png", "a print of mine.png", "sub/print.png", "7.png", "tüte.png"])
def test_options_of_a_texture_are_not_its_name(tmp_path: Path, options: str, name: str) -> None:
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_bytes(png(PRINT[..., ::-1]))
    made = read_appearance(write_obj(tmp_path, f"map_Kd {options} {name}"), "mm")
    np.testing.assert_array_equal(made.textures[0], PRINT)
    assert made.places.reshape(-1, 2).max() == 1.0


def test_scale_and_offset_of_a_texture_are_followed(tmp_path: Path) -> None:
    (tmp_path / "print.png").write_bytes(png(PRINT))
    made = read_appearance(write_obj(tmp_path, "map_Kd -s 2 3 1 -o 0.5 0.25 print.png"), "mm")
    assert made.places[0] == pytest.approx(np.array([[0.5, 0.25], [2.5, 0.25], [2.5, 3.25]]))


@pytest.mark.parametrize("mtl", ["map_Kd gone.png", "map_Kd -s 1 1 1 sub\\gone.png"])
def test_a_missing_texture_is_named_and_the_colour_is_used(tmp_path: Path, mtl: str) -> None:
    made = read_appearance(write_obj(tmp_path, mtl), "mm")
    assert any("gone.png" in remark for remark in made.remarks)
    expected = linear_from_srgb(np.rint(np.array([0.1, 0.2, 0.3]) * 255) / 255)
    assert made.tints == pytest.approx(np.tile(expected, (2, 3, 1)))


def test_a_missing_library_is_named(tmp_path: Path) -> None:
    path = write_obj(tmp_path, "")
    (tmp_path / "square.mtl").unlink()
    assert any("square.mtl" in remark for remark in read_appearance(path, "mm").remarks)


def test_each_material_has_its_own_faces(tmp_path: Path) -> None:
    path = write_obj(tmp_path, "newmtl two\nKd 1 1 1", "f 1 2 3\nusemtl two\nf -4 -2 -1\n")
    made = read_appearance(path, "mm")
    assert made.tints[1] == pytest.approx(np.ones((3, 3)))
    assert made.tints[0, 0, 0] < 0.02
    assert made.mesh.face_areas == pytest.approx([0.005, 0.005])


def test_colours_of_vertices_of_an_obj_are_read(tmp_path: Path) -> None:
    path = tmp_path / "some.obj"
    path.write_text("v 0 0 0 1 0 0\nv 50 0 0 0 1 0\nv 0 50 0 0 0 1\nf 1 2 3\n")
    assert read_appearance(path, "mm").tints[0] == pytest.approx(np.eye(3))


@pytest.mark.parametrize(
    ("name", "picture", "expected"),
    [
        ("16 bits", np.full((2, 2, 3), 0x8080, np.uint16), [128, 128, 128]),
        # Rounded: the high byte alone would be 0.
        ("16 bits, grey", np.full((2, 2), 0x00FF, np.uint16), [1, 1, 1]),
        ("16 bits, alpha", np.full((2, 2, 4), 0x4040, np.uint16), [64, 64, 64]),
        ("grey", np.full((2, 2), 77, np.uint8), [77, 77, 77]),
        ("colour", np.full((2, 2, 3), [3, 2, 1], np.uint8), [1, 2, 3]),
        ("alpha", np.full((2, 2, 4), [3, 2, 1, 9], np.uint8), [1, 2, 3]),
        ("one pixel", np.full((1, 1, 3), [3, 2, 1], np.uint8), [1, 2, 3]),
    ],
)
def test_textures_of_any_depth(name: str, picture: Any, expected: list[int]) -> None:
    pixels, is_transparent = decode_texture(png(picture), name)
    assert pixels.shape == (*picture.shape[:2], 3)
    assert np.all(pixels == expected)
    assert is_transparent == (picture.ndim == 3 and picture.shape[2] == 4)


@pytest.mark.parametrize("kind", ["PNG", "GIF", "TGA", "BMP"])
def test_textures_with_a_palette_or_of_other_formats(tmp_path: Path, kind: str) -> None:
    image = Image.fromarray(np.full((8, 8, 3), [250, 20, 60], np.uint8))
    image = image.convert("P", palette=Image.Palette.ADAPTIVE) if kind in ("PNG", "GIF") else image
    image.save(tmp_path / "some", format=kind)
    pixels, _ = decode_texture((tmp_path / "some").read_bytes(), kind)
    assert np.abs(pixels.astype(int) - [250, 20, 60]).max() <= 3


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (4, 4)])
def test_a_texture_of_few_pixels_is_one(tmp_path: Path, shape: tuple[int, int]) -> None:
    picture: ByteArray = np.full((*shape, 3), [9, 8, 7], np.uint8)
    (tmp_path / "print.png").write_bytes(png(picture[..., ::-1]))
    made = read_appearance(write_obj(tmp_path, "map_Kd print.png"), "mm")
    np.testing.assert_array_equal(made.textures[0], picture)


def _bomb() -> bytes:
    """A PNG that states 60,000 x 60,000 pixels."""
    head = struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0)
    chunks = b"IHDR" + head, b"IDAT" + zlib.compress(bytes(1000))
    packed = (
        struct.pack(">I", len(each) - 4) + each + struct.pack(">I", zlib.crc32(each)) for each in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "bytes"),
        (b"not a picture", "bytes"),
        (png(PRINT)[:40], "damaged|bytes"),
        (_bomb(), "pixels"),
    ],
)
def test_a_texture_that_is_none_is_refused(data: bytes, reason: str) -> None:
    with pytest.raises(MeshRefused, match=reason):
        decode_texture(data, "print.png")


@pytest.mark.parametrize(
    "name",
    [
        "../print.png",
        "/etc/hostname",
        "C:\\print.png",
        "\\\\host\\share\\x.png",
        "http://x.org/a.png",
        "link.png",
    ],
)
def test_a_picture_outside_the_folder_is_refused_by_its_name(tmp_path: Path, name: str) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "print.png").write_bytes(png(PRINT))
    (inner / "link.png").symlink_to(tmp_path / "print.png")
    with pytest.raises(MeshRefused) as refused:
        read_appearance(write_obj(inner, f"map_Kd {name}"), "mm")
    assert repr(name) in str(refused.value)


def test_a_pipe_is_no_picture(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "print.png")
    with pytest.raises(MeshRefused, match=r"print\.png.*pipe"):
        read_appearance(write_obj(tmp_path, "map_Kd print.png"), "mm")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(MeshRefused, match=r"folder\.png.*folder"):
        read_appearance(write_obj(tmp_path, "map_Kd folder.png"), "mm")


def test_a_link_within_the_folder_is_read(tmp_path: Path) -> None:
    (tmp_path / "print.png").write_bytes(png(PRINT))
    (tmp_path / "link.png").symlink_to("print.png")
    assert len(read_appearance(write_obj(tmp_path, "map_Kd link.png"), "mm").textures) == 1
