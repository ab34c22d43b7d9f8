"""Pictures on disk, RGB in memory: any file OpenCV reads, and PNG to write."""

from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, read_only
from harness.basics.errors import DataRefused
from harness.basics.files.foreign_file import read_bounded, refused_as
from harness.basics.whole_file import write_bytes_whole
from harness.picture.picture_size import require_modest_picture

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
