"""JPEG pictures of cameras, as rows and columns of the sensor: no camera's idea of what is up turns them."""

import cv2
import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.errors import DataRefused, TouchstoneError


def decode_jpeg(data: bytes, refused: type[TouchstoneError] = DataRefused) -> ByteArray:
    """``(rows, columns, 3)`` uint8 RGB of a JPEG; an error of the class ``refused`` where it is none."""
    # EXIF's orientation is not applied to files that are read (``read_image``), so it is not here.
    kind = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    image = cv2.imdecode(np.frombuffer(data, np.uint8), kind) if data else None
    if image is None:
        raise refused(f"an image of {len(data)} bytes is not a JPEG that decodes")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)
