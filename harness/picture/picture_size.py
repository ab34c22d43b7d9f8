"""How large a picture is, by its head alone: a file of kilobytes may unpack to gigabytes."""

from io import BytesIO

from PIL import Image

from harness.basics.errors import DataRefused, TouchstoneError
from harness.basics.foreign_file import refused_as

MOST_PIXELS = 2**25
"""Of a picture; the largest cameras of a bench have some 20 million."""

_FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "PPM")


def require_modest_picture(data: bytes, name: str, refused: type[TouchstoneError] = DataRefused) -> None:
    """Refuse the bytes of a picture that are none, or that unpack to more than ``MOST_PIXELS``.

    Args:
        data: of the file.
        name: of the picture, for people.
        refused: the class of what is raised.

    Raises:
        TouchstoneError: of the class ``refused``.
    """
    no_picture = refused_as(refused, f"{name} is no picture ({len(data)} bytes); give a PNG or a JPEG")
    with no_picture, Image.open(BytesIO(data), formats=_FORMATS) as head:
        columns, rows = head.size
    if rows * columns > MOST_PIXELS:
        raise refused(
            f"{name} states {rows:,} x {columns:,} pixels; a picture has at most {MOST_PIXELS:,}: shrink it"
        )
