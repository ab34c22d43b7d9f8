"""Sets of ball presses as Taxim and ObjectFolder publish them."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.basics.npz_file import read_arrays

_KEYS = {"f0", "imgs", "touch_center", "touch_radius"}


@dataclass(frozen=True, eq=False)
class PressPack:
    """Pictures of one ball pressed into one gel at many places.

    Attributes:
        background: ``(rows, columns, 3)`` RGB, of the untouched gel.
        images: ``(presses, rows, columns, 3)`` RGB.
        centres: ``(presses, 2)`` pixels (column, row), marked by hand.
        radii: ``(presses,)`` pixels, of the marked circles.
        number: ``(presses,)`` of each press in the file it came from, from 0.
        sha256: of that file.
    """

    background: ByteArray
    images: ByteArray
    centres: FloatArray
    radii: FloatArray
    number: IntArray
    sha256: str

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the pictures."""
        return self.background.shape[0], self.background.shape[1]

    def of(self, chosen: IntArray) -> "PressPack":
        """Only the presses at these places of the pack."""
        return PressPack(
            self.background,
            read_only(self.images[chosen]),
            read_only(self.centres[chosen]),
            read_only(self.radii[chosen]),
            read_only(self.number[chosen]),
            self.sha256,
        )


def read_pack(path: Path) -> PressPack:
    """Read a ``dataPack.npz``.

    The files hold what ``cv2.imread`` gave, blue first; it is turned to RGB here and nowhere else.

    Raises:
        CalibrationRefused: missing, incomplete, or shapes that disagree.
    """
    found = read_arrays(path, "a pack of presses", _KEYS)
    images, presses = found["imgs"], len(found["imgs"])
    shapes_agree = (
        images.shape[1:] == found["f0"].shape
        and found["touch_center"].shape == (presses, 2)
        and found["touch_radius"].shape == (presses,)
    )
    if not shapes_agree or images.dtype != np.uint8 or images.ndim != 4 or images.shape[3] != 3:
        raise CalibrationRefused(
            f"{path}: images {images.dtype} {images.shape} and marks do not belong together"
        )
    return PressPack(
        read_only(np.ascontiguousarray(found["f0"][..., ::-1])),
        read_only(np.ascontiguousarray(images[..., ::-1])),
        read_only(found["touch_center"].astype(np.float64)),
        read_only(found["touch_radius"].astype(np.float64)),
        read_only(np.arange(presses)),
        hashlib.sha256(path.read_bytes()).hexdigest(),
    )
