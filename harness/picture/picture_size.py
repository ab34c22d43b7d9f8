"""How large a picture is, by its head alone: a file of kilobytes may unpack to gigabytes."""

from io import BytesIO

from PIL import Image

from harness.basics.errors import DataRefused, TouchstoneError

MOST_PIXELS = 2**25
"""Of a picture; the largest cameras of a bench have some 20 million."""

FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "PPM")


def require_modest_picture(
    data: bytes,
    name: str,
    refused: type[TouchstoneError] = DataRefused,
    formats: tuple[str, ...] = FORMATS,
) -> None:
    """Refuse the bytes of a picture that are none, or that unpack to more than ``MOST_PIXELS``.

    Args:
        data: of the file.
        name: of the picture, for people.
        refused: the class of what is raised.
        formats: that are pictures, by their names in Pillow.

    Raises:
        TouchstoneError: of the class ``refused``.
    """
    most = f"a picture has at most {MOST_PIXELS:,}: shrink it"
    try:
        with Image.open(BytesIO(data), formats=formats) as head:
            columns, rows = head.size
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise refused(f"{name} states far more pixels than a camera has; {most}") from error
    except Exception as error:
        raise refused(f"{name} is no picture ({len(data)} bytes); give a PNG or a JPEG") from error
    if rows * columns > MOST_PIXELS:
        raise refused(f"{name} states {rows:,} x {columns:,} pixels; {most}")
