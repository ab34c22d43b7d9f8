"""Files that no command may fall over: damaged, foreign, huge by their heads alone, or no files at all."""

import io
import json
import os
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

GIGABYTES = 4
"""That the archive of zeros unpacks to."""


def make_hostile_files(folder: Path) -> dict[str, Path]:
    """Every file under its name; the folder is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in _MADE.items():
        make(folder / name)
    return {name: folder / name for name in NAMES}


def _bytes(data: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(data)


def _text(text: str) -> Callable[[Path], object]:
    return _bytes(text.encode())


def _array(array: object, pickled: bool = False) -> Callable[[Path], object]:
    return lambda path: np.save(path, np.asarray(array), allow_pickle=pickled)


def _folder_with(name: str, text: str) -> Callable[[Path], object]:
    def make(path: Path) -> None:
        path.mkdir()
        (path / name).write_text(text)

    return make


def _zeros_chunk() -> bytes:
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(bytes(2**20)) + packer.flush(zlib.Z_FULL_FLUSH)


def _archive_of_zeros(path: Path) -> None:
    """An ``.npz`` of 4 MB whose one array unpacks to 4 GB, its sizes stated as they are."""
    size = GIGABYTES * 2**30
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "|u1", "fortran_order": False, "shape": (size - 128,)}
    )
    first = head.getvalue()
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = packer.compress(first + bytes(2**20 - len(first))) + packer.flush(zlib.Z_FULL_FLUSH)
    data += _zeros_chunk() * (GIGABYTES * 1024 - 1) + zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    name = b"vertices.npy"
    wide = struct.pack("<HHQQ", 1, 16, size, len(data))
    common = struct.pack("<HHHHHIIIHH", 45, 0, 8, 0, 33, 0, 2**32 - 1, 2**32 - 1, len(name), len(wide))
    local = b"PK\x03\x04" + common + name + wide
    central = (
        b"PK\x01\x02" + struct.pack("<H", 45) + common + struct.pack("<HHHII", 0, 0, 0, 0, 0) + name + wide
    )
    at = len(local) + len(data)
    end = b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, len(central), at, 0)
    path.write_bytes(local + data + central + end)


def _picture_of(side: int, filled: bool) -> bytes:
    """A PNG of one bit a pixel, its pixels there or only stated."""
    row = bytes(1 + (side + 7) // 8)
    packer = zlib.compressobj(9)
    pixels = b"".join(packer.compress(row) for _ in range(side if filled else 1)) + packer.flush()
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)),
        (b"IDAT", pixels),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _noise(ending: str, rows: int = 48, columns: int = 64) -> bytes:
    picture = np.random.default_rng(0).integers(0, 255, (rows, columns, 3), dtype=np.uint8)
    return bytes(cv2.imencode(ending, picture)[1])


def _wide_jpeg() -> bytes:
    """Stated to be of 60,000 rows and columns."""
    data = bytearray(_noise(".jpg"))
    at = data.index(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", 60_000, 60_000)
    return bytes(data)


def _zip_of(name: str, text: str) -> Callable[[Path], object]:
    def make(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(name, text)

    return make


class _Evil:
    def __reduce__(self) -> tuple[object, tuple[str, ...]]:
        return (os.mkdir, ("executed",))


_SHEET = "v 0 0 0\nv 40 0 0\nv 40 40 0\nv 0 40 0\nf 1 2 3\nf 1 3 4\n"
_GLTF = {"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}
_DEEP = 5000

_MADE: dict[str, Callable[[Path], object]] = {
    "empty.obj": _bytes(b""),
    "empty.png": _bytes(b""),
    "empty.toml": _bytes(b""),
    "zeros.stl": _bytes(bytes(4096)),
    "noise.ply": _bytes(np.random.default_rng(1).bytes(4096)),
    "latin.obj": _bytes("# café\nv 0 0 0\n".encode("latin-1") + b"\xff\xfe\x00f 1 1 1\n"),
    "numbers.obj": _text("v nan 0 0\nv inf 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n"),
    "index.obj": _text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999\n"),
    "sheet.obj": _text(_SHEET),
    "line.obj": _text("\n"),
    "many.stl": _bytes(bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)),
    "cut.stl": _text("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0"),
    "many.ply": _text(
        "ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
        "property float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    ),
    "cut.off": _text("OFF\n8 6 0\n0 0 0\n"),
    "cut.glb": _bytes(b"glTF" + struct.pack("<II", 2, 2**31) + bytes(20)),
    "null.gltf": _text("null"),
    "pointing.gltf": _text(json.dumps(_GLTF)),
    "broken.3mf": _bytes(b"PK\x03\x04" + bytes(100)),
    "wrong.3mf": _zip_of("3D/3dmodel.model", "<model unit='inch'><resources>"),
    "cut.dae": _text("<?xml version='1.0'?><COLLADA><asset>"),
    "laughs.dae": _text(
        "<?xml version='1.0'?><!DOCTYPE a [<!ENTITY a 'ha'>"
        + "".join(f"<!ENTITY {chr(98 + k)} '{10 * f'&{chr(97 + k)};'}'>" for k in range(9))
        + "]><COLLADA>&j;</COLLADA>"
    ),
    "cut.msh": _text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 0 0 0\n"),
    "blank.vtk": _text("\n\n"),
    "text.png": _text("this is not a picture"),
    "cut.png": _bytes(_noise(".png")[:400]),
    "small.png": _bytes(_noise(".png", 2, 2)),
    "tall.png": _bytes(_noise(".png", 1600, 8)),
    "stated.png": _bytes(_picture_of(60_000, filled=False)),
    "large.png": _bytes(_picture_of(7_000, filled=True)),
    "vast.png": _bytes(_picture_of(30_000, filled=True)),
    "stated.jpg": _bytes(_wide_jpeg()),
    "zeros.npz": _archive_of_zeros,
    "cut.npz": _bytes(b"PK\x03\x04" + bytes(40)),
    "text.npz": _zip_of("vertices.npy", "this is not an array"),
    "objects.npy": _array([_Evil()], pickled=True),
    "stated.npy": _bytes(
        b"\x93NUMPY\x01\x00v\x00"
        + b"{'descr': '<f8', 'fortran_order': False, 'shape': (100000000000,), }".ljust(117)
        + b"\n"
    ),
    "nested.npy": _bytes(b"\x93NUMPY\x01\x00\xf0\x20" + (b"(" * 8431) + b"\n"),
    "nothing.npy": _array(np.zeros((0, 3))),
    "words.npy": _array(["a", "b"]),
    "numbers.npy": _array([[float("nan")] * 6] * 2),
    "pickled.pth": _bytes(pickle.dumps(_Evil())),
    "archive.pth": _zip_of("archive/data.pkl", "cos\nmkdir\n(S'executed'\ntR."),
    "deep.toml": _text("a = " + "[" * _DEEP + "]" * _DEEP),
    "deep_tables.toml": _text("[" + ".".join("a" * _DEEP) + "]\nb = 1\n"),
    "many.toml": _text("".join(f"k{n} = 1\n" for n in range(10**6))),
    "many_small.toml": _text("".join(f"k{n} = 1\n" for n in range(9_000))),
    "latin.toml": _bytes("name = 'café'".encode("latin-1")),
    "cut.toml": _text("[object\nmesh ="),
    "kinds.toml": _text("schema = 1\nobject = 3\nsensors = []\nlocalization = 'x'\nstation = nan\n"),
    "null.json": _text("null"),
    "deep.json": _text('{"a":' * _DEEP + "1" + "}" * _DEEP),
    "numbers.json": _text('{"schema": NaN, "rows": 1e999}'),
    "[bold]name\n.toml": _text("[bold]\nx = 1\n"),
    "folder.obj": lambda path: path.mkdir(),
    "loop.toml": lambda path: path.symlink_to(path.name),
    "pipe.png": os.mkfifo,
    "zero.toml": lambda path: path.symlink_to("/dev/zero"),
    "run_null": _folder_with("run.json", "null"),
    "run_deep": _folder_with("run.json", '{"schema":' * _DEEP),
    "object_null": _folder_with("object.json", "null"),
    "object_deep": _folder_with("object.json", '{"name":' * _DEEP),
    "object_kind": _folder_with("object.json", '{"schema": 1, "name": 3, "material": []}'),
    "picture_folder": _folder_with("press.png", "no picture"),
    "pack_folder": _folder_with("dataPack.npz", "no archive"),
}

NAMES = (*_MADE, "absent.toml", "absent.obj")
"""Of the files; the last ones are not there."""
