"""Pictures and textures on disk, RGB in memory: any format of OpenCV to read, and PNG to write."""

from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from harness.basics.arrays import ByteArray, read_only
from harness.basics.errors import DataRefused, MeshRefused, TouchstoneError
from harness.basics.files.foreign_file import read_bounded, refused_as
from harness.basics.whole_file import write_bytes_whole

MOST_PIXELS = 2**25
"""Of a picture; the largest cameras of a bench have some 20 million."""

FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "WEBP", "PPM")


def require_modest_picture(
    data: bytes,
    name: str,
    refused: type[TouchstoneError] = DataRefused,
    formats: tuple[str, ...] = FORMATS,
) -> None:
    """Refuse bytes that are no picture of Pillow's formats, or that unpack to more than ``MOST_PIXELS``.

    Raises:
        TouchstoneError: an error of the class ``refused``.
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


def decode_jpeg(data: bytes, refused: type[TouchstoneError] = DataRefused) -> ByteArray:
    """``(rows, columns, 3)`` uint8 RGB of a JPEG; an error of the class ``refused`` where it is none."""
    # EXIF's orientation is not applied to files that are read (``read_image``), so it is not here.
    kind = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(np.frombuffer(data, np.uint8), kind) if data else None
    if image is None:
        raise refused(f"an image of {len(data)} bytes is not a JPEG that decodes")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)


_MOST_BYTES = 2**28


def read_image(path: Path) -> ByteArray:
    """``(rows, columns, 3)`` RGB of a picture of 8 bits a channel.

    Raises:
        WrongUse: no such file, or none that may be read.
        DataRefused: it is no such picture.
    """
    data = read_bounded(path, "a picture", _MOST_BYTES)
    require_modest_picture(data, str(path))
    with refused_as(DataRefused, f"{path} is a damaged picture; write it again"):
        seen = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if seen is None:
        raise DataRefused(f"{path} is a picture cut short or damaged ({len(data)} bytes); write it again")
    if seen.dtype != np.uint8 or seen.ndim != 3 or seen.shape[2] != 3:
        raise DataRefused(
            f"{path} is {seen.dtype} {seen.shape}; a colour picture of 8 bits a channel is wanted"
        )
    return read_only(np.ascontiguousarray(seen[..., ::-1], dtype=np.uint8))


def write_png(path: Path, image: ByteArray) -> None:
    """Write ``(rows, columns, 3)`` RGB, pixel for pixel; the same picture gives the same bytes."""
    write_bytes_whole(path, png_bytes(image))


def png_bytes(image: ByteArray) -> bytes:
    """What ``write_png`` writes."""
    _, data = cv2.imencode(".png", np.ascontiguousarray(image[..., ::-1]))
    return data.tobytes()


_BY_PILLOW = ("TGA", "GIF")
"""Formats of textures that OpenCV does not read, or not with their palettes."""


def decode_texture(data: bytes, name: str) -> tuple[ByteArray, bool]:
    """Decode the picture of a texture, of 8 or 16 bits a channel, grey, with a palette or in colour.

    Returns:
        ``(rows, columns, 3)`` RGB; and whether the picture has transparent pixels, which is ignored.

    Raises:
        MeshRefused: the picture is of another kind, damaged or huge.
    """
    require_modest_picture(data, f"texture {name}", MeshRefused, (*FORMATS, *_BY_PILLOW))
    try:
        with Image.open(BytesIO(data), formats=(*FORMATS, *_BY_PILLOW)) as head:
            if head.format in _BY_PILLOW:
                pixels = np.array(head.convert("RGBA"))
            else:
                found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
                pixels = np.zeros((0, 0, 1), np.uint8) if found is None else found
                pixels = pixels[..., None] if pixels.ndim == 2 else pixels
                # OpenCV has blue first.
                order = {3: [2, 1, 0], 4: [2, 1, 0, 3]}.get(pixels.shape[2])
                pixels = pixels if order is None else pixels[..., order]
    # Decoders raise whatever their parsers meet: there is no common class to name.
    except Exception as error:
        raise MeshRefused(f"texture {name} is a damaged picture; export it again") from error
    if pixels.size == 0:
        raise MeshRefused(f"texture {name} is a damaged picture; export it again")
    if pixels.dtype == np.uint16:
        # 65535 / 255 = 257 exactly.
        pixels = ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)
    if pixels.dtype != np.uint8 or pixels.shape[2] > 4:
        raise MeshRefused(
            f"texture {name} has {pixels.shape[2]} channels of {pixels.dtype}; save it with 8 or 16 bits"
        )
    channels = pixels.shape[2]
    is_transparent = channels in (2, 4) and bool(pixels[..., -1].min() < np.iinfo(np.uint8).max)
    colours = pixels[..., :3] if channels >= 3 else np.repeat(pixels[..., :1], 3, axis=2)
    return read_only(np.ascontiguousarray(colours)), is_transparent
