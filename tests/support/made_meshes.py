"""glTF, 3MF and COLLADA files of a box, written byte by byte, with whatever a test changes in them."""

import json
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray

SIDES = (0.04, 0.03, 0.02)
VOLUME = 2.4e-5
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * np.array(SIDES)
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"


def box_tree() -> tuple[dict[str, Any], bytes]:
    """The JSON tree of a box in one mesh, accessors 0 (positions) and 1 (indices), and its bytes."""
    positions, indices = CORNERS.astype("<f4").tobytes(), FACES.astype("<u2").tobytes()
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(positions) + len(indices)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions)},
            {"buffer": 0, "byteOffset": len(positions), "byteLength": len(indices)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    return tree, positions + indices


def add_accessor(
    tree: dict[str, Any], data: bytes, values: Any, kind: str, component: int, **more: Any
) -> bytes:
    """Append an accessor of ``values``, an array of the right type; gives the longer bytes."""
    own = np.ascontiguousarray(values).tobytes()
    data += bytes(-len(data) % 4)
    tree["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": len(own)})
    view = len(tree["bufferViews"]) - 1
    entry = {"bufferView": view, "componentType": component, "count": len(values), "type": kind, **more}
    tree["accessors"].append(entry)
    tree["buffers"][0]["byteLength"] = len(data) + len(own)
    return data + own


def write_glb(path: Path, tree: dict[str, Any], data: bytes) -> Path:
    """Write a GLB of a tree and its bytes."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    length = 12 + 8 + len(text) + 8 + len(data)
    head = b"glTF" + struct.pack("<II", 2, length) + struct.pack("<I", len(text)) + b"JSON"
    path.write_bytes(head + text + struct.pack("<I", len(data)) + b"BIN\0" + data)
    return path


def write_box_glb(path: Path, **changes: Any) -> Path:
    """Write the box with top-level entries of its tree replaced."""
    tree, data = box_tree()
    return write_glb(path, {**tree, **changes}, data)


def mesh_xml(corners: FloatArray = CORNERS, properties: str = "") -> str:
    """The ``<mesh>`` of a 3MF object, in millimetres."""
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in (1e3 * corners).tolist())
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"{properties}/>' for a, b, c in FACES.tolist())
    return f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh>"


def model_xml(resources: str, build: str, attributes: str = 'unit="millimeter"') -> str:
    """A 3MF model."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><model {attributes} xmlns="{CORE}">'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def write_3mf(path: Path, model: str, more: dict[str, str | bytes] | None = None) -> Path:
    """Write a 3MF of one model and other members."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", model)
        for name, text in (more or {}).items():
            archive.writestr(name, text)
    return path


def dae_xml(
    asset: str = '<unit meter="1"/><up_axis>Z_UP</up_axis>',
    primitive: str | None = None,
    nodes: str = '<node id="n"><instance_geometry url="#g"/></node>',
    more: str = "",
    positions: str | None = None,
    inputs: str = "",
) -> str:
    """A COLLADA document of the box."""
    own = " ".join(f"{value!r}" for value in CORNERS.ravel().tolist()) if positions is None else positions
    faces = " ".join(map(str, FACES.ravel().tolist()))
    primitive = primitive or (
        f'<triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{faces}</p></triangles>'
    )
    return f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>{asset}</asset>{more}
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="pa" count="24">{own}</float_array>
<technique_common><accessor source="#pa" count="8" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>{inputs}
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>{primitive}</mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s">{nodes}</visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
