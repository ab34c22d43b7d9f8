"""Hostile glTF, 3MF and COLLADA files, and a process of little memory and time that reads them.

Run it with a folder to make the files there, and with ``--read`` to read them too: each is read at intake and
for its colours, in a process of its own of 2 GiB of address space and 60 s of processor time.
"""

import json
import os
import resource
import struct
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.made_meshes import (
    CORNERS,
    add_accessor,
    box_tree,
    dae_xml,
    mesh_xml,
    model_xml,
    write_3mf,
    write_box_glb,
    write_glb,
)

MEMORY = 2 * 2**30
SECONDS = 60


def _changed(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], Any]:
    """Make a GLB of the box with something of its tree changed."""

    def make(path: Path) -> None:
        tree, data = box_tree()
        change(tree)
        write_glb(path, tree, data)

    return make


def _set(*keys: Any, value: Any) -> Callable[[Path], Any]:
    def change(tree: Any) -> None:
        for key in keys[:-1]:
            tree = tree[key]
        tree[keys[-1]] = value

    return _changed(change)


def _nodes(nodes: list[dict[str, Any]], roots: list[int] | None = None) -> Callable[[Path], Any]:
    return lambda path: write_box_glb(path, nodes=nodes, scenes=[{"nodes": roots or [0]}])


def _instances(count: int) -> Callable[[Path], Any]:
    def make(path: Path) -> None:
        tree, data = box_tree()
        data = add_accessor(tree, data, np.zeros((count, 3), "<f4"), "VEC3", 5126)
        tree["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}
        write_glb(path, tree, data)

    return make


def _sparse(index: int) -> Callable[[Path], Any]:
    def make(path: Path) -> None:
        tree, data = box_tree()
        data = add_accessor(tree, data, np.array([index], "<u4"), "SCALAR", 5125)
        data = add_accessor(tree, data, CORNERS[:1].astype("<f4"), "VEC3", 5126)
        of = {"bufferView": 2, "componentType": 5125}
        tree["accessors"][0]["sparse"] = {"count": 1, "indices": of, "values": {"bufferView": 3}}
        write_glb(path, tree, data)

    return make


def _positions(value: float) -> Callable[[Path], Any]:
    def make(path: Path) -> None:
        tree, data = box_tree()
        with np.errstate(over="ignore"):
            corners = (CORNERS * value).astype("<f4")
        write_glb(path, tree, corners.tobytes() + data[corners.nbytes :])

    return make


def _cut(path: Path) -> None:
    write_box_glb(path)
    path.write_bytes(path.read_bytes()[:-200])


def _chunk(path: Path) -> None:
    write_box_glb(path)
    data = bytearray(path.read_bytes())
    data[12:16] = struct.pack("<I", 2**32 - 16)
    path.write_bytes(data)


def _deep_json(path: Path) -> None:
    path.write_bytes(b'{"asset":' + b"[" * 200_000)


def _wide_json(path: Path) -> None:
    path.write_bytes(b'{"asset":{"version":"2.0"},"nodes":[' + b"[]," * (20 * 2**20) + b"[]]}")


def _uri(uri: str) -> Callable[[Path], Any]:
    def make(path: Path) -> None:
        tree, _ = box_tree()
        tree["buffers"][0]["uri"] = uri
        path.write_text(json.dumps(tree))
        if uri == "pipe.bin":
            (path.parent / uri).unlink(missing_ok=True)
            os.mkfifo(path.parent / uri)

    return make


def _many_members(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for number in range(35_000):
            archive.writestr(f"part-number-{number:0200d}", "")


def _zip_bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for number in range(6):
            with archive.open(f"3D/part{number}.model", "w", force_zip64=True) as stream:
                for _ in range(100):
                    stream.write(bytes(2**20))
        archive.writestr("3D/3dmodel.model", model_xml("", ""))


def _text_bomb(start: str, repeated: str, count: int) -> Callable[[Path], Any]:
    """Write a 3MF whose model repeats an element: kilobytes that unpack to megabytes."""

    def make(path: Path) -> None:
        begun, ended = model_xml("CUT", "").split("CUT")
        with (
            zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive,
            archive.open("3D/3dmodel.model", "w", force_zip64=True) as stream,
        ):
            stream.write((begun + start).encode())
            for _ in range(count // 10_000):
                stream.write((repeated * 10_000).encode())
            stream.write(ended.encode())

    return make


def _components(levels: int, width: int, cycle: bool = False) -> Callable[[Path], Any]:
    def make(path: Path) -> None:
        objects = [f'<object id="0">{mesh_xml()}</object>']
        for level in range(1, levels + 1):
            of = levels if cycle and level == 1 else level - 1
            each = f'<component objectid="{of}"/>'
            objects.append(f'<object id="{level}"><components>{each * width}</components></object>')
        write_3mf(path, model_xml("".join(objects), f'<item objectid="{levels}"/>'))

    return make


_ENTITIES = "".join(f'<!ENTITY e{k + 1} "{f"&e{k};" * 10}">' for k in range(12))
_LAUGHS = f'<!DOCTYPE a [<!ENTITY e0 "ha">{_ENTITIES}]>'
_FILE_ENTITY = '<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/hostname">]>'


def _with_doctype(doctype: str, text: str) -> str:
    head, tail = text.split("?>", 1)
    return f"{head}?>{doctype}{tail}"


def _dae(text: str) -> Callable[[Path], Any]:
    return lambda path: path.write_text(text)


def _model(text: str) -> Callable[[Path], Any]:
    return lambda path: write_3mf(path, text)


def _doubled(levels: int) -> str:
    """COLLADA nodes that place the next one twice: 2 to the power of ``levels`` of the last."""
    inner = "".join(
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>'
        for k in range(levels)
    )
    last = f'<node id="n{levels}"/>'
    library = f"<library_nodes>{inner}{last}</library_nodes>"
    return dae_xml(nodes='<node id="n"><instance_node url="#n0"/></node>', more=library)


def _box_model(attributes: str = 'unit="millimeter"', mesh: str = "") -> str:
    return model_xml(f'<object id="1">{mesh or mesh_xml()}</object>', '<item objectid="1"/>', attributes)


FILES: dict[str, Callable[[Path], Any]] = {
    "huge_count.glb": _set("accessors", 0, "count", value=2**40),
    "huge_count_no_view.glb": _changed(
        lambda tree: tree.update(accessors=[{"componentType": 5126, "count": 2**40, "type": "VEC3"}] * 2)
    ),
    "large_count_no_view.glb": _changed(
        lambda tree: tree.update(
            accessors=[
                {"componentType": 5126, "count": 5_999_999, "type": "VEC3"},
                {"componentType": 5125, "count": 5_999_997, "type": "SCALAR"},
            ]
        )
    ),
    "negative_offset.glb": _set("bufferViews", 0, "byteOffset", value=-8),
    "negative_accessor_offset.glb": _set("accessors", 1, "byteOffset", value=-2),
    "buffer_beyond.glb": _set("buffers", 0, "byteLength", value=10**9),
    "view_beyond.glb": _set("bufferViews", 0, "byteLength", value=10**6),
    "float_offset.glb": _set("bufferViews", 0, "byteOffset", value=0.5),
    "text_count.glb": _set("accessors", 0, "count", value="8"),
    "strange_type.glb": _set("accessors", 0, "type", value="MAT9"),
    "narrow_stride.glb": _set("bufferViews", 0, "byteStride", value=4),
    "wide_stride.glb": _set("bufferViews", 0, "byteStride", value=2**31),
    "index_beyond.glb": _set("meshes", 0, "primitives", 0, "indices", value=0),
    "vertex_beyond.glb": _set("accessors", 0, "count", value=5),
    "no_such_mesh.glb": _set("nodes", 0, "mesh", value=-1),
    "no_such_accessor.glb": _set("meshes", 0, "primitives", 0, "attributes", "POSITION", value=10**30),
    "sparse_beyond.glb": _sparse(8),
    "cycle.glb": _nodes([{"children": [1]}, {"children": [0], "mesh": 0}]),
    "own_child.glb": _nodes([{"children": [0], "mesh": 0}]),
    "shared_child.glb": _nodes([{"children": [1, 1]}, {"mesh": 0}]),
    "deep_chain.glb": _nodes(
        [*({"children": [k + 1], "scale": [1.2] * 3} for k in range(5_000)), {"mesh": 0}]
    ),
    "wide_scene.glb": _nodes([{"mesh": 0}] * 50_000, list(range(50_000))),
    "million_instances.glb": _instances(1_000_000),
    "nan_matrix.glb": _set("nodes", 0, "matrix", value=[float("nan")] * 16),
    "huge_matrix.glb": _set("nodes", 0, "scale", value=[10**400, 1, 1]),
    "zero_rotation.glb": _set("nodes", 0, "rotation", value=[0, 0, 0, 0]),
    "nan_positions.glb": _positions(float("nan")),
    "infinite_positions.glb": _positions(1e300),
    "tiny_positions.glb": _positions(1e-40),
    "cut.glb": _cut,
    "long_chunk.glb": _chunk,
    "deep_json.gltf": _deep_json,
    "wide_json.gltf": _wide_json,
    "garbage_uri.gltf": _uri("data:application/octet-stream;base64,!!!not base64!!!"),
    "plain_uri.gltf": _uri("data:,hello"),
    "outside_uri.gltf": _uri("../../etc/passwd"),
    "absolute_uri.gltf": _uri("/dev/zero"),
    "encoded_uri.gltf": _uri("%2e%2e/secret.bin"),
    "network_uri.gltf": _uri("http://example.org/a.bin"),
    "pipe_uri.gltf": _uri("pipe.bin"),
    "bomb.3mf": _zip_bomb,
    "many_members.3mf": _many_members,
    "vertices.3mf": _text_bomb('<object id="1"><mesh><vertices>', '<vertex x="0" y="0" z="0"/>', 400_000),
    "triangles.3mf": _text_bomb(
        '<object id="1"><mesh><triangles>', '<triangle v1="0" v2="1" v3="2"/>', 300_000
    ),
    "attribute.3mf": _text_bomb('<object id="1" name="', "aaaaaaaaaaaaaaaa", 200_000),
    "nested.3mf": _text_bomb("", "<a>", 10_000),
    "doubling.3mf": _components(40, 2),
    "own_component.3mf": _components(3, 1, cycle=True),
    "laughs.3mf": _model(_with_doctype(_LAUGHS, _box_model())),
    "file_entity.3mf": _model(_with_doctype(_FILE_ENTITY, _box_model())),
    "vertex_beyond.3mf": _model(_box_model().replace('v1="0"', 'v1="99"', 1)),
    "negative_vertex.3mf": _model(_box_model().replace('v1="0"', 'v1="-1"', 1)),
    "nan.3mf": _model(_box_model().replace('x="0.0"', 'x="nan"', 1)),
    "huge.3mf": _model(_box_model().replace('x="40.0"', 'x="1e300"')),
    "no_such_object.3mf": _model(_box_model().replace('objectid="1"', 'objectid="7"')),
    "flat_transform.3mf": _model(
        _box_model().replace('objectid="1"', 'objectid="1" transform="1 0 0 1 0 0 0 0 1 0 0 0"')
    ),
    "laughs.dae": _dae(_with_doctype(_LAUGHS, dae_xml())),
    "file_entity.dae": _dae(_with_doctype(_FILE_ENTITY, dae_xml())),
    "doubling.dae": _dae(_doubled(60)),
    "cycle.dae": _dae(dae_xml(nodes='<node id="n"><node id="m"><instance_node url="#m"/></node></node>')),
    "many_elements.dae": lambda path: path.write_text(dae_xml(more="<a/>" * 2_100_000)),
    "deep_elements.dae": lambda path: path.write_text(dae_xml(more="<a>" * 300_000 + "</a>" * 300_000)),
    "count_beyond.dae": _dae(dae_xml().replace('count="8"', 'count="99999999999"')),
    "huge.dae": _dae(dae_xml().replace("0.04 ", "1e300 ")),
    "tiny.dae": _dae(dae_xml(positions="1e-300 " * 23 + "0")),
    "cut.dae": _dae(dae_xml()[:-100]),
}


READ_ONCE = ("vertices.3mf", "triangles.3mf")
"""Files that the parser of both readings refuses: they are read at intake alone, under limits of a tenth."""


def make_all(folder: Path) -> list[Path]:
    """Write every file; gives their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in FILES.items():
        make(folder / name)
    return [folder / name for name in FILES]


def read_bounded_in_child(path: Path) -> dict[str, Any]:
    """Read a file at intake and for its colours in a child process of bounded memory and time.

    Returns:
        ``errors``, kind and text of each reading's, ``seconds`` of processor time, and ``peak`` bytes; or the
        child's ``status`` alone if it died.
    """
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        os.write(write, json.dumps(_read_both(path)).encode())
        os._exit(0)
    os.close(write)
    with os.fdopen(read, "rb") as stream:
        said = stream.read()
    _, status = os.waitpid(child, 0)
    return dict(json.loads(said)) if status == 0 else {"status": status}


def _read_both(path: Path) -> dict[str, Any]:
    from harness.basics.errors import TouchstoneError
    from harness.sim.light.appearance_source import read_appearance
    from harness.sim.solid.formats import parts, three_mf
    from harness.sim.solid.intake import take_in

    if path.name in READ_ONCE:
        parts.MAX_TRIANGLES = 200_000
        three_mf._MAX_VERTICES = 300_000
    errors = []
    readings = (lambda: take_in(path, "m"), lambda: read_appearance(path, "m"))
    for read in readings[:1] if path.name in READ_ONCE else readings:
        try:
            read()
            errors.append(("none", ""))
        except TouchstoneError as error:
            errors.append(("refused", str(error)))
        except BaseException as error:  # noqa: BLE001 - whatever it is, the test shows it
            errors.append((type(error).__name__, str(error)))
    used = resource.getrusage(resource.RUSAGE_SELF)
    return {"errors": errors, "seconds": used.ru_utime + used.ru_stime, "peak": 1024 * used.ru_maxrss}


def main(arguments: list[str]) -> None:
    """Make the files in a folder; with ``--read``, print what reading each gives, a line of JSON each."""
    paths = make_all(Path(arguments[0]))
    if "--read" in arguments:
        import harness.sim.light.appearance_source
        import harness.sim.solid.intake  # noqa: F401 - before the limits

        for path in paths:
            sys.stdout.write(json.dumps({"name": path.name, **read_bounded_in_child(path)}) + "\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:])
