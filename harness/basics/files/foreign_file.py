"""Files that somebody else wrote: read within bounds, and refused in a sentence where they do not read."""

import hashlib
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.basics.errors import DataRefused, TouchstoneError, WrongUse

MOST_TEXT = 2**20
"""Bytes of a file that a person writes: a scene, a station, a sensor."""

MOST_JSON = 2**26
"""Bytes of a file that a program writes as text."""

MOST_DATA = 2**29
"""Bytes of a picture, of an array, or of all that an archive unpacks to."""

_MOST_LISTED = 2**23
"""Bytes of the list of an archive's members: some 100,000 of them."""

_ZIP_TAIL = 2**16 + 22 + 20 + 56
"""Bytes at the end of an archive that hold where its list is."""


def require_readable(path: Path, what: str, most: int, refused: type[TouchstoneError] = DataRefused) -> None:
    """Refuse what is no file, or a longer one than any of its kind, before it is read.

    Args:
        path: of the file.
        what: it is, for people, as "a picture".
        most: bytes.
        refused: the class of a longer file's error.

    Raises:
        WrongUse: no file, or none that may be read.
        TouchstoneError: of the class ``refused``.
    """
    try:
        size = path.stat().st_size
    except OSError as error:
        raise unreadable(path, error) from error
    if path.is_dir():
        raise WrongUse(f"{path} cannot be read: is a directory")
    if not path.is_file():
        raise WrongUse(f"{path} cannot be read: it is a device or a pipe, and no file")
    if size > most:
        raise refused(f"{path} has {size / 2**20:,.1f} MiB; {what} has at most {most / 2**20:,.0f} MiB")


def read_bounded(
    path: Path, what: str, most: int = MOST_DATA, refused: type[TouchstoneError] = DataRefused
) -> bytes:
    """The bytes of a file; as ``require_readable`` otherwise."""
    require_readable(path, what, most, refused)
    try:
        return path.read_bytes()
    except OSError as error:
        raise unreadable(path, error) from error


def sha256_of(path: Path) -> str:
    """Return the hash of a file's bytes, hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def unreadable(path: Path, error: OSError) -> WrongUse:
    """What the system says of a file that it does not give."""
    return WrongUse(f"{path} cannot be read: {(error.strerror or str(error)).lower()}")


def require_unpackable(path: Path, what: str, refused: type[TouchstoneError] = DataRefused) -> None:
    """Refuse a ZIP archive whose members together unpack to more than ``MOST_DATA``, before it is unpacked.

    The sizes that it states are those that the library unpacks to: it reads no byte more. The list of members
    is bounded before it is read, since the library holds all of it in memory.
    """
    require_readable(path, what, MOST_DATA, refused)
    with path.open("rb") as stream:
        begin = stream.seek(max(0, path.stat().st_size - _ZIP_TAIL))
        tail = stream.read()
    end = tail.rfind(b"PK\x05\x06")
    listed = int.from_bytes(tail[end + 12 : end + 16], "little") if end >= 0 else 0
    if end >= 20 and tail[end - 20 : end - 16] == b"PK\x06\x07":
        # A ZIP64 archive, which torch always writes, states the size in a record before the locator of it.
        record, place = tail[max(0, end - 76) : end - 20], int.from_bytes(tail[end - 12 : end - 4], "little")
        known = len(record) == 56 and record[:4] == b"PK\x06\x06" and place == begin + end - 76
        listed = int.from_bytes(record[40:48], "little") if known else _MOST_LISTED + 1
    if listed > _MOST_LISTED:
        raise refused(f"{path} lists far more members than {what} has; pack it again")
    with zipfile.ZipFile(path) as archive:
        size = sum(member.file_size for member in archive.infolist())
    if size > MOST_DATA:
        raise refused(
            f"{path} unpacks to {size / 2**20:,.0f} MiB; {what} has at most {MOST_DATA / 2**20:,.0f} MiB"
        )


@contextmanager
def refused_as(refused: type[TouchstoneError], sentence: str) -> Iterator[None]:
    """Refuse in one sentence whatever a library raises on bytes that it does not understand.

    A parser of a foreign format fails on damage in any way: there is no common class to name, and its own
    message is about its code.
    """
    try:
        yield
    except TouchstoneError:
        raise
    except Exception as error:
        raise refused(sentence) from error
