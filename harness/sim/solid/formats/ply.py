"""Read the triangles of a PLY, text or binary."""

import io
from pathlib import Path

import numpy as np

from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, read_bounded
from harness.basics.files.text_file import plain_bytes, unpack
from harness.sim.solid.plain_formats import PlainMesh
from harness.sim.solid.text_numbers import refuse_number, require_few

_HEADER = 2**16
"""Bytes in which the header ends."""

_SINGLE = (b"float", b"float32")


def read_ply(path: Path) -> PlainMesh:
    """Read the faces of a PLY; polygons are split, colours and normals are left out.

    Raises:
        MeshRefused: cut short, too large, or with a word that is not a number.
    """
    import trimesh

    data = unpack(read_bounded(path, "a PLY", MOST_DATA, MeshRefused), path, "a PLY", MOST_DATA, MeshRefused)
    plain = plain_bytes(data[:_HEADER], path)
    header = [line.split() for line in plain.partition(b"end_header")[0].split(b"\n")]
    is_text = [b"format", b"ascii"] in [words[:2] for words in header]
    if is_text:
        data = plain_bytes(data, path, MeshRefused)
        _check_text(data, path.name)
    counts = [int(words[2]) for words in header if words[:1] == [b"element"] and len(words) == 3]
    require_few(max(counts, default=0), "vertices or faces", path.name)
    lines = data.count(b"\n") + 1
    if is_text and sum(counts) > lines:
        raise MeshRefused(
            f"{path.name} is cut short: it announces {sum(counts)} vertices and faces, and has {lines} lines;"
            " export it again"
        )
    loaded = trimesh.load_scene(
        io.BytesIO(data), file_type="ply", process=False, skip_materials=True, maintain_order=True
    )
    if not loaded.geometry:
        raise MeshRefused(f"{path.name} holds no triangle; export a surface")
    mesh = loaded.to_mesh()
    single = any(
        words[:1] == [b"property"] and words[1] in _SINGLE and words[2:] == [b"x"] for words in header
    )
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    return PlainMesh(vertices, faces, single=single and not is_text)


def _check_text(data: bytes, name: str) -> None:
    """Refuse lines that the library would read in part: it stops at the first word that is not a number."""
    require_few(data.count(b"\n") // 2, "vertices or faces", name)
    start = data.find(b"end_header")
    comma = data.find(b",", max(start, 0))
    if comma >= 0:
        line = data.count(b"\n", 0, comma) + 1
        words = data[data.rfind(b"\n", 0, comma) + 1 : data.find(b"\n", comma)].split()
        raise refuse_number(words, name, line, "numbers")
