"""Give a library a text file without marks, compression or foreign line ends."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.basics.errors import MeshRefused
from harness.basics.files.foreign_file import MOST_DATA, read_bounded
from harness.basics.files.text_file import GZIP, plain_bytes, unpack


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
    if not packed and plain == data:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="touchstone-text-") as folder:
        copy = Path(folder) / (path.name[: -len(".gz")] if path.name.lower().endswith(".gz") else path.name)
        copy.write_bytes(plain)
        yield copy
