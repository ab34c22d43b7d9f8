"""Write text files that announce, nest or unpack to more than they should, and read each within limits."""

import gzip
import json
import resource
import struct
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from unittest import mock

MEMORY = 2 * 2**30
"""Bytes that reading all of them may take."""

CPU_SECONDS = 60.0
"""Seconds that reading any one of them may take."""

TETRAHEDRON = "*Node\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*Element, type=C3D4\n1, 1, 2, 3, 4\n"
PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
PLY += "element face {}\nproperty list uint int vertex_indices\nend_header\n"
GMSH = "$MeshFormat\n{} 0 8\n$EndMeshFormat\n"


def _packed(line: bytes, size: int) -> bytes:
    """Compress a line that is repeated up to a size: one block is compressed, and its bytes are repeated."""
    packer = zlib.compressobj(9, wbits=-15)
    block = line * (2**20 // len(line))
    packed, count, checksum = packer.compress(block) + packer.flush(zlib.Z_FULL_FLUSH), size // len(block), 0
    for _ in range(count):
        checksum = zlib.crc32(block, checksum)
    head, tail = gzip.compress(b"")[:10], struct.pack("<II", checksum, count * len(block) % 2**32)
    return head + packed * count + packer.flush() + tail


def _instances() -> str:
    nodes = "".join(f"{k}, {k}, {k % 7}, {k % 5}\n" for k in range(1, 2001))
    part = f"*Part, name=A\n*Node\n{nodes}*Element, type=C3D4\n1, 1, 2, 3, 4\n*End Part\n*Assembly, name=X\n"
    return part + "*Instance, name=I, part=A\n*End Instance\n" * 9_000 + "*End Assembly\n"


FILES: dict[str, Callable[[], str | bytes]] = {
    "counts.off": lambda: "OFF\n4000000000 4000000000 0\n0 0 0\n",
    "short.off": lambda: "OFF\n3000000 3000000 0\n0 0 0\n",
    "corners.off": lambda: "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n",
    "header.stl": lambda: b"\0" * 80 + (2**32 - 1).to_bytes(4, "little") + b"\0" * 500,
    "line.stl": lambda: "solid a\n" + "vertex 0 0 0 " * 1_000_000,
    "line.obj": lambda: "v " + "0 " * 30_000_000,
    "continued.obj": lambda: "v \\\n" * 2_000_000,
    "bomb.obj": lambda: _packed(b"v 0 0 0\n", 2**29),
    "bomb.stl": lambda: _packed(b"\0", 2**30),
    "bomb.toml": lambda: _packed(b"a = 1\n", 2**30),
    "text.ply": lambda: PLY.format("ascii", 10**9, 10**9),
    "binary.ply": lambda: PLY.format("binary_little_endian", 10**9, 1) + "\0" * 64,
    "list.ply": lambda: PLY.format("binary_little_endian", 1, 1) + "\0" * 12 + "\x7f" * 64,
    "set.inp": lambda: f"{TETRAHEDRON}*Nset, nset=A, generate\n1, 4000000000\n",
    "instances.inp": _instances,
    "line.inp": lambda: "*Node\n" + "1, " * 20_000_000,
    "keyword.inp": lambda: "*Node,\n" + "a=1,\n" * 3_000_000,
    "continued.bdf": lambda: "BEGIN BULK\nGRID,1,,0.,0.,0.\n" + "+,1.\n" * 2_000_000,
    "systems.bdf": lambda: (
        "BEGIN BULK\nGRID,1,1,0.,0.,0.\nCTETRA,1,1,1,1,1,1\n"
        + "".join(f"CORD2R,{k},{k + 1},0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n" for k in range(1, 5000))
    ),
    "counts.msh": lambda: GMSH.format("2.2") + "$Nodes\n1000000000000\n1 0 0 0\n",
    "blocks.msh": lambda: GMSH.format("4.1") + "$Nodes\n1 1000000000 1 1000000000\n3 1 0 1000000000\n1\n",
    "many.msh": lambda: GMSH.format("4.1") + "$Nodes\n1000000000000 1 1 1\n",
    "open.msh": lambda: "$Comments\n" + "x\n" * 1_000_000,
    "counts.vtk": lambda: (
        "# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9000000000 float\n0\n"
    ),
    "deep.toml": lambda: "a = " + "[" * 500_000,
    "dotted.toml": lambda: "a." * 400_000 + "a = 1",
    "digits.toml": lambda: "a = 0x" + "1" * 900_000,
    "columns.csv": lambda: "name" + ",x" * 1_000_000,
    "rows.csv": lambda: "name,material\n" + "a,steel\n" * 5_000_000,
    "cell.csv": lambda: 'name,material\n"' + "x\n" * 5_000_000,
}
"""Files by their names: each is to be refused in one sentence."""


def write_files(folder: Path) -> None:
    """Write all files to a folder."""
    for name, content in FILES.items():
        data = content()
        (folder / name).write_bytes(data.encode("latin-1") if isinstance(data, str) else data)
    (folder / "damaged.obj").write_bytes(gzip.compress(b"v 0 0 0\n" * 1000)[:-9])


def _read(path: Path) -> object:
    from harness.authoring.catalogue.rows import read_catalogue
    from harness.basics.toml_file import read_toml
    from harness.sim.solid import plain_formats
    from harness.sim.solid.intake import take_in
    from harness.sim.solid.volume_mesh import read_volume

    if path.suffix == ".toml":
        return read_toml(path)
    if path.suffix == ".csv":
        return read_catalogue(path)
    if path.name == "bomb.obj":
        # It is unpacked as a whole; of its 67,000,000 lines as many are read as are allowed, 2 us each.
        with mock.patch.object(plain_formats, "MAX_ELEMENTS", plain_formats.MAX_ELEMENTS // 10):
            return take_in(path, "mm")
    return read_volume(path, "mm") or take_in(path, "mm")


def main(folder: Path) -> None:
    """Read all files of a folder under the limits, and print the message and the seconds of each as JSON."""
    from harness.basics.errors import TouchstoneError

    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    found = {}
    for path in sorted(folder.iterdir()):
        begun = time.process_time()
        try:
            said = f"not refused: {_read(path)}"
        except TouchstoneError as refused:
            said = f"refused: {refused}"
        except BaseException as error:  # noqa: BLE001 - it is what is looked for
            said = f"bare {type(error).__name__}: {error}"
        found[path.name] = (said, time.process_time() - begun)
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
