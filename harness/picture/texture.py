"""Textures of mesh files: pictures of any depth and palette, as RGB of 8 bits in sRGB."""

from io import BytesIO

import cv2
import numpy as np
from PIL import Image

from harness.basics.arrays import ByteArray, read_only
from harness.basics.errors import MeshRefused
from harness.picture.image_file import FORMATS, require_modest_picture

_BY_PILLOW = ("TGA", "GIF")
"""Formats of textures that OpenCV does not read, or not with their palettes."""


def decode_texture(data: bytes, name: str) -> tuple[ByteArray, bool]:
    """Decode the picture of a texture.

    Args:
        data: bytes of a PNG, JPEG, BMP, TIFF, WebP, PPM, TGA or GIF, of 8 or 16 bits a channel, grey, with a
            palette or in colour.
        name: of the picture, for messages.

    Returns:
        ``(rows, columns, 3)`` RGB; and whether the picture is transparent somewhere, which is not followed.

    Raises:
        MeshRefused: no such picture, a damaged or huge one, or one of other numbers than 8 or 16 bits.
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
