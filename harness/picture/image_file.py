"""Pictures on disk, RGB in memory: any file OpenCV reads, and PNG to write."""

from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, read_only
from harness.basics.errors import DataRefused, WrongUse


def read_image(path: Path) -> ByteArray:
    """``(rows, columns, 3)`` RGB of a picture of 8 bits a channel.

    Raises:
        WrongUse: no such file, or none that may be read.
        DataRefused: it is no such picture.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise WrongUse(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from error
    # OpenCV fails on a buffer without bytes instead of answering that it is no picture.
    seen = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if seen is None:
        raise DataRefused(f"{path} is no picture ({len(data)} bytes); give a PNG or a JPEG")
    if seen.dtype != np.uint8 or seen.ndim != 3 or seen.shape[2] != 3:
        raise DataRefused(
            f"{path} is {seen.dtype} {seen.shape}; a colour picture of 8 bits a channel is wanted"
        )
    return read_only(np.ascontiguousarray(seen[..., ::-1], dtype=np.uint8))


def write_png(path: Path, image: ByteArray) -> None:
    """Write ``(rows, columns, 3)`` RGB, pixel for pixel; the same picture gives the same bytes."""
    path.write_bytes(png_bytes(image))


def png_bytes(image: ByteArray) -> bytes:
    """What ``write_png`` writes."""
    _, data = cv2.imencode(".png", np.ascontiguousarray(image[..., ::-1]))
    return data.tobytes()
