"""Give a library a text file without marks, compression or foreign line ends."""

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, read_bounded
from harness.basics.files.text_file import GZIP, plain_bytes, unpack

_COUNTS = re.compile(rb"\$(?:Nodes|Elements)[ \t\r]*\n[ \t]*(\d{1,20})(?:[ \t]+(\d{1,20}))?")
"""Numbers of blocks and of nodes or elements that a Gmsh file announces."""


def _check_counts(data: bytes, name: str) -> None:
    """Refuse a file of Gmsh that announces more than its bytes can hold: the library makes room for all."""
    for found in _COUNTS.finditer(data):
        announced = max(int(count) for count in found.groups(b"0"))
        if announced > len(data):
            raise MeshRefused(
                f"{name} is cut short: it announces {announced} nodes or elements in {len(data)} bytes; "
                "export it again"
            )


@contextmanager
def plain_file(path: Path) -> Iterator[Path]:
    """Yield the path of a file that holds the same text as UTF-8 with LF line ends; binary files stay.

    Raises:
        MeshRefused: damaged compression or encoding, or too large.
    """
    data = read_bounded(path, "a mesh", MOST_DATA, MeshRefused)
    packed = data.startswith(GZIP)
    plain = unpack(data, path, "a mesh", MOST_DATA, MeshRefused)
    text = plain_bytes(plain, path, MeshRefused)
    plain = plain if b"\0" in text else text
    _check_counts(plain, path.name)
    if not packed and plain == data:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="touchstone-text-") as folder:
        copy = Path(folder) / (path.name[: -len(".gz")] if path.name.lower().endswith(".gz") else path.name)
        copy.write_bytes(plain)
        yield copy
