"""Read text files of any encoding, line end and gzip compression within a limit of bytes.

Spreadsheets, CAD programs and editors write the same text with a byte-order mark, as UTF-16, with CR or CRLF
line ends, or compressed. Every reader of a text format gets the same bytes from here: UTF-8 without a mark
and with LF line ends.
"""

import codecs
import gzip
import io
import zlib
from pathlib import Path

from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.files.foreign_file import MOST_DATA, read_bounded

GZIP = b"\x1f\x8b"
"""First bytes of a gzip file."""

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    # UTF-32 before UTF-16: the little-endian marks begin alike.
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)

_SAMPLE = 256
"""Bytes from the start of a file in which UTF-16 without a mark is looked for."""


def read_text(
    path: Path, what: str, most: int = MOST_DATA, refused: type[TouchstoneError] = DataRefused
) -> str:
    """Read a text file as a string with LF line ends.

    Args:
        path: path of the file.
        what: the kind of file with its article, for messages, e.g. "a TOML file".
        most: largest number of bytes, also after unpacking.
        refused: class of the error for a file that is too large, damaged or not text.

    Raises:
        WrongUse: no file, or one that may not be read.
        TouchstoneError: of class ``refused``; names the line and the byte that is not UTF-8.
    """
    data = read_text_bytes(path, what, most, refused)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise refused(
            f"{path}, line {line}: the byte 0x{data[error.start]:02x} is not UTF-8 text; save it as UTF-8"
        ) from error


def read_text_bytes(
    path: Path, what: str, most: int = MOST_DATA, refused: type[TouchstoneError] = DataRefused
) -> bytes:
    """Read a text file as UTF-8 bytes with LF line ends; as ``read_text``, but bytes are not checked."""
    return plain_bytes(
        unpack(read_bounded(path, what, most, refused), path, what, most, refused), path, refused
    )


def unpack(
    data: bytes,
    path: Path,
    what: str,
    most: int = MOST_DATA,
    refused: type[TouchstoneError] = DataRefused,
) -> bytes:
    """Unpack the bytes of a gzip file; return other bytes as they are.

    Raises:
        TouchstoneError: of class ``refused``: damaged, or longer than ``most`` bytes when unpacked.
    """
    if not data.startswith(GZIP):
        return data
    try:
        unpacked = gzip.GzipFile(fileobj=io.BytesIO(data)).read(most + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise refused(
            f"{path} is a damaged or incomplete gzip file; compress or download it again"
        ) from error
    if len(unpacked) > most:
        raise refused(f"{path} unpacks to more than {most / 2**20:,.0f} MiB; {what} has at most that")
    return unpacked


def plain_bytes(data: bytes, path: Path, refused: type[TouchstoneError] = DataRefused) -> bytes:
    """Convert text of any Unicode encoding and line end to UTF-8 bytes with LF line ends.

    Raises:
        TouchstoneError: of class ``refused``: marked as UTF-16 or UTF-32, and damaged.
    """
    mark, encoding = next(((mark, name) for mark, name in _MARKS if data.startswith(mark)), (b"", None))
    data = data[len(mark) :] if mark else data
    encoding = encoding or _unmarked_utf16(data)
    if encoding not in (None, "utf-8"):
        try:
            data = data.decode(encoding).encode("utf-8")
        except UnicodeError as error:
            raise refused(f"{path} is damaged {encoding.upper()} text; save it again as UTF-8") from error
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return data


def _unmarked_utf16(data: bytes) -> str | None:
    """Return the encoding of UTF-16 text without a mark, whose every second byte is zero; else None."""
    first, second = data[0:_SAMPLE:2], data[1:_SAMPLE:2]
    if not second:
        return None
    if 0 not in first and second.count(0) > 0.9 * len(second):
        return "utf-16-le"
    if 0 not in second and first.count(0) > 0.9 * len(first):
        return "utf-16-be"
    return None
