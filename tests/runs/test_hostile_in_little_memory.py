"""Small files that describe huge ones: each is refused in one sentence within 2 GB and 60 s of CPU time."""

import io
import json
import os
import resource
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from onnx import ModelProto, NodeProto, TensorProto, helper, numpy_helper

from harness.basics.arrays import AnyArray
from tests.samples.object_bench import MODES, egg_file, exchange

MEMORY = 2 * 10**9
"""Bytes that a command may have resident."""

SECONDS = 60
"""Seconds of processor time that a command may take; the system kills it then."""


def graph(nodes: list[NodeProto], **constants: AnyArray) -> bytes:
    """A graph from ``points`` to ``gains``, as an object's sound has it; the nodes compute ``scalar``."""
    model = helper.make_graph(
        [
            *nodes,
            helper.make_node("ReduceSum", ["points", "axis"], ["sum"], keepdims=1),
            helper.make_node("Cast", ["sum"], ["single"], to=TensorProto.FLOAT),
            helper.make_node("Mul", ["single", "scalar"], ["scaled"]),
            helper.make_node("MatMul", ["scaled", "row"], ["flat"]),
            helper.make_node("Reshape", ["flat", "shape"], ["gains"]),
        ],
        "hostile",
        [helper.make_tensor_value_info("points", TensorProto.DOUBLE, ["n", 3])],
        [helper.make_tensor_value_info("gains", TensorProto.FLOAT, ["n", MODES, 3])],
        [
            numpy_helper.from_array(np.asarray(array), name)
            for name, array in {
                "axis": np.array([1]),
                "row": np.ones((1, 3 * MODES), np.float32),
                "shape": np.array([-1, MODES, 3]),
                "one": np.ones((1, 1), np.float32),
                "side": np.array([2**12, 2**12]),
                **constants,
            }.items()
        ],
    )
    made = helper.make_model(model, ir_version=8, opset_imports=[helper.make_opsetid("", 17)])
    return bytes(made.SerializeToString())


def _big(*after: NodeProto) -> list[NodeProto]:
    return [helper.make_node("Expand", ["one", "side"], ["v0"]), *after]


def _chain(operation: str, count: int, *more: str) -> list[NodeProto]:
    """A value of 2^24 numbers, and as many operations on it one after the other."""
    nodes = [helper.make_node(operation, [f"v{k}", *more], [f"v{k + 1}"]) for k in range(count)]
    return _big(*nodes, helper.make_node("ReduceMax", [f"v{count}"], ["scalar"], keepdims=0))


def kept_constants() -> bytes:
    """100 values of 64 MB that are all needed at the end: 6.4 GB."""
    kept = [helper.make_node("Sin", ["v0"], [f"s{k}"]) for k in range(100)]
    peaks = [helper.make_node("ReduceMax", [f"s{k}"], [f"m{k}"], keepdims=0) for k in range(100)]
    return graph(_big(*kept, *peaks, helper.make_node("Max", [f"m{k}" for k in range(100)], ["scalar"])))


def outside() -> bytes:
    model = ModelProto.FromString(kept_constants())
    tensor = model.graph.initializer[1]
    tensor.ClearField("raw_data")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/dev/zero")
    return bytes(model.SerializeToString())


def repeated() -> bytes:
    body = helper.make_graph([helper.make_node("Identity", ["a"], ["b"])], "body", [], [])
    return graph([helper.make_node("Loop", ["", "", "one"], ["scalar"], body=body)])


def stated() -> bytes:
    """A weight of 4 TB by its head alone."""
    model = ModelProto.FromString(graph([helper.make_node("Identity", ["one"], ["scalar"])]))
    model.graph.initializer[3].dims[:] = [2**20, 2**20]
    return bytes(model.SerializeToString())


def squared() -> bytes:
    """A value of the square of the queries."""
    nodes = [
        helper.make_node("Transpose", ["points"], ["turned"], perm=[1, 0]),
        helper.make_node("MatMul", ["points", "turned"], ["square"]),
        helper.make_node("ReduceMax", ["square"], ["most"], keepdims=0),
        helper.make_node("Cast", ["most"], ["scalar"], to=TensorProto.FLOAT),
    ]
    return graph(nodes)


GRAPHS: dict[str, Callable[[], bytes]] = {
    "kept constants": kept_constants,
    "minutes of folding": lambda: graph(_chain("Sin", 1000)),
    "products of constants": lambda: graph(_chain("MatMul", 20, "v0")),
    "a tile": lambda: graph([helper.make_node("Tile", ["one", "side"], ["scalar"])]),
    "a range": lambda: graph([helper.make_node("Range", ["one", "one", "one"], ["scalar"])]),
    "an expansion": lambda: graph(
        [
            helper.make_node("Expand", ["one", "huge"], ["v0"]),
            helper.make_node("ReduceMax", ["v0"], ["scalar"]),
        ],
        huge=np.array([2**20, 2**20]),
    ),
    "outside": outside,
    "repeated": repeated,
    "stated": stated,
    "squared": squared,
    "of others": lambda: graph([helper.make_node("Evil", ["one"], ["scalar"], domain="com.evil")]),
}


def _zeros(path: Path, name: str, gigabytes: float, head: bytes = b"") -> None:
    """An archive of few megabytes with one member of zeros."""
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open(name, "w", force_zip64=True) as member,
    ):
        member.write(head)
        for _ in range(int(64 * gigabytes)):
            member.write(bytes(2**24))


def npy_head(shape: tuple[int, ...]) -> bytes:
    stream = io.BytesIO()
    described = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, described)
    return stream.getvalue()


def large_json(path: Path) -> None:
    """64 MiB of numbers where a calibration has a few."""
    path.write_text('{"schema": 1, "rows": [' + "1," * (2**25 - 20) + "1]}")


def large_picture(path: Path) -> None:
    """A PNG of 100 KB that unpacks to 30,000 x 30,000 pixels."""
    side, packer = 30_000, zlib.compressobj(9)
    pixels = b"".join(packer.compress(bytes(1 + side // 8)) for _ in range(side)) + packer.flush()
    parts = ((b"IHDR", struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)), (b"IDAT", pixels), (b"IEND", b""))
    chunks = (struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in parts)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


DEPTH = ("depth", "GREY.png", "--calibration", "FILE", "--out", "OUT.npz")
PICTURE = ("depth", "FILE", "--calibration", "gelsight_r15_bench", "--out", "OUT.npz")
IMPORT = ("object", "import", "FILE", "--out", "OUT")
QUERIES = ("--audio-vertices", "FILE", "--audio-forces", "FILE", "--out", "OUT")

Make = Callable[[Path], object]
FILES: dict[str, tuple[str, Make, tuple[str, ...]]] = {
    "an archive of 3 GB": ("a.npz", lambda p: _zeros(p, "table.npy", 3.0), DEPTH),
    "an array of 16 TB in an archive": (
        "b.npz",
        lambda p: _zeros(p, "table.npy", 0.1, npy_head((2**41,))),
        DEPTH,
    ),
    "half a GB of zeros": ("c.npz", lambda p: _zeros(p, "table.npy", 0.45, npy_head((60_000_000,))), DEPTH),
    "a large calibration": ("d.json", large_json, DEPTH),
    "an array of 16 TB": (
        "e.npy",
        lambda p: p.write_bytes(npy_head((2**41,)) + bytes(64)),
        ("object", "render", "queries", "OBJECT", *QUERIES),
    ),
    "a published file of 3 GB": ("f.pth", lambda p: _zeros(p, "a/data.pkl", 3.0), IMPORT),
    "a published pickle of 0.4 GB": ("g.pth", lambda p: _zeros(p, "a/data.pkl", 0.4), IMPORT),
    "a large picture": ("h.png", large_picture, PICTURE),
}


def sampled(names: Iterable[str]) -> list[Any]:
    """The first runs with every change, all of them with ``make slow``: each is a program of its own."""
    first, *others = names
    return [first, *(pytest.param(name, marks=pytest.mark.slow) for name in others)]


def refusal(folder: Path, *words: str) -> str:
    """Run a command within the limits; its one sentence."""
    sees = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "TOUCHSTONE_CACHE": str(folder / "cache")}
    with (folder / "out.json").open("wb") as out, (folder / "err.txt").open("wb") as err:
        command = subprocess.Popen(
            [sys.executable, "-c", "from harness.cli import main; main()", *words, "--json"],
            stdout=out,
            stderr=err,
            cwd=folder,
            env=sees,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS)),
        )
        _, status, used = os.wait4(command.pid, 0)
    command.returncode = os.waitstatus_to_exitcode(status)
    said = (folder / "err.txt").read_text()
    assert command.returncode in (1, 2), (command.returncode, said)
    assert 1024 * used.ru_maxrss < MEMORY, f"{1024 * used.ru_maxrss / 1e9:.2f} GB"
    answer = json.loads((folder / "out.json").read_text())
    assert "Traceback" not in said
    assert answer["kind"] not in ("unforeseen", "system")
    assert "\n" not in answer["error"]
    return str(answer["error"])


@pytest.mark.parametrize("name", sampled(GRAPHS))
def test_a_network_of_little_that_takes_much_is_refused(tmp_path: Path, name: str) -> None:
    folder = egg_file(tmp_path / "object").folder
    exchange(folder, "audio.onnx", GRAPHS[name]())
    assert "audio.onnx" in refusal(tmp_path, "object", "render", "audio", str(folder), "--out", "x.wav")


@pytest.mark.parametrize("name", sampled(FILES))
def test_a_file_of_little_that_unpacks_to_much_is_refused(tmp_path: Path, name: str) -> None:
    file, make, words = FILES[name]
    make(tmp_path / file)
    egg_file(tmp_path / "OBJECT")
    cv2.imwrite(str(tmp_path / "GREY.png"), np.full((240, 320, 3), 128, np.uint8))
    said = refusal(tmp_path, *(str(tmp_path / file) if word == "FILE" else word for word in words))
    assert file in said
