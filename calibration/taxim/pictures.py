"""Pictures of ball presses as an operator has them: a folder, or somebody's data pack; no marks needed."""

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.basics.npz_file import read_arrays
from harness.picture.image_file import read_image
from harness.picture.square_pixels import made_square, square_places

Channels = Literal["rgb", "bgr"]

PACK = "dataPack.npz"
SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
REST_NAMES = ("background", "bg", "f0", "ref", "reference", "rest", "untouched", "no_contact")
"""Names of a file, without its ending, that say it shows the untouched gel."""

_KEYS = {"f0", "imgs", "touch_center", "touch_radius"}


@dataclass(frozen=True)
class Refused:
    """A press that is not used."""

    name: str  #: of its picture.
    kind: str  #: of the damage, one word for programs.
    reason: str  #: for people: what was found, the limit, what to do.


@dataclass(frozen=True, eq=False)
class Pictures:
    """One ball pressed into one gel at many places."""

    background: ByteArray  #: ``(rows, columns, 3)`` RGB of the untouched gel.
    background_from: str  #: where that comes from, in words.
    images: ByteArray  #: ``(presses, rows, columns, 3)`` RGB.
    names: tuple[str, ...]  #: of the presses.
    marks: FloatArray | None
    """``(presses, 3)`` centre (column, row) and radius in pixels that came with a data pack."""
    source: str  #: of the pixels, in words.
    sha256: str  #: of background and images, whatever the order of the presses.
    refused: tuple[Refused, ...] = ()  #: files that are no press of this set.
    aspect: float = 1.0
    """a pixel's height over its width in the files, where the pictures were made square by it."""


def squared(pictures: Pictures, aspect: float) -> Pictures:
    """The pictures made square; ``sha256`` stays that of the files.

    Args:
        pictures: as they were taken.
        aspect: a pixel's height over its width; 1 changes nothing.

    Raises:
        OutOfDomain: an aspect that is none of a camera.
    """
    if aspect == 1.0:
        return pictures
    marks, (rows, columns) = pictures.marks, pictures.background.shape[:2]
    if marks is not None:
        marks = read_only(np.column_stack([square_places(marks[:, :2], rows, columns, aspect), marks[:, 2]]))
    return replace(
        pictures,
        background=made_square(pictures.background, aspect),
        background_from=f"{pictures.background_from}, made square by {aspect:.4f}",
        images=made_square(pictures.images, aspect),
        marks=marks,
        aspect=aspect * pictures.aspect,
    )


def in_order_of_content(pictures: Pictures) -> Pictures:
    """The presses by the hash of their pixels, so that a folder's order changes nothing."""
    order = sorted(range(len(pictures.images)), key=lambda k: digest(pictures.images[k]))
    return replace(
        pictures,
        images=pictures.images[order],
        names=tuple(pictures.names[k] for k in order),
        marks=None if pictures.marks is None else pictures.marks[order],
    )


def read_pictures(path: Path, background: Path | None = None, channels: Channels | None = None) -> Pictures:
    """Read presses from a folder of pictures, a folder with ``dataPack.npz``, or such a file.

    Args:
        path: the folder or file.
        background: picture of the untouched gel; found by its name among the others where None, and
            made of the presses' median where there is none.
        channels: order in which the files hold the colours. Where None it is what the formats say: RGB for
            pictures, blue first for data packs.

    Raises:
        WrongUse: no such folder or file.
        CalibrationRefused: no pictures, or none that belong together.
        DataRefused: a file that is no picture.
    """
    packed = path if path.suffix == ".npz" else path / PACK
    if packed.is_file():
        return _from_pack(packed, background, channels or "bgr")
    if not path.is_dir():
        raise WrongUse(f"{path} is no folder and no {PACK}; name the folder of the press pictures")
    files = [file for file in sorted(path.iterdir()) if file.suffix.lower() in SUFFIXES]
    rest = background or next((file for file in files if file.stem.lower() in REST_NAMES), None)
    presses = [file for file in files if rest is None or not (rest.exists() and file.samefile(rest))]
    if not presses:
        raise CalibrationRefused(
            f"{path} holds no pictures ({', '.join(SUFFIXES)}) and no {PACK}; put one picture a press into it"
        )
    read = [_ordered(read_image(file), channels or "rgb") for file in presses]
    seen = None if rest is None else _ordered(read_image(rest), channels or "rgb")
    return _together(
        read,
        [file.name for file in presses],
        seen,
        f"picture {rest.name}" if rest is not None else "",
        str(path),
    )


def _from_pack(path: Path, background: Path | None, channels: Channels) -> Pictures:
    pack = read_pack(path)
    flip = slice(None) if channels == "bgr" else slice(None, None, -1)
    rest = pack.background if background is None else read_image(background)
    whence = f"f0 of {path.name}" if background is None else f"picture {background.name}"
    found = _together(
        [np.ascontiguousarray(image[..., flip]) for image in pack.images],
        [f"press {number}" for number in pack.number],
        np.ascontiguousarray(rest[..., flip]) if background is None else rest,
        whence,
        str(path),
    )
    if found.refused:
        raise CalibrationRefused(f"{path}: {found.refused[0].reason}")
    return Pictures(**{**vars(found), "marks": read_only(np.column_stack([pack.centres, pack.radii]))})


def _together(
    read: Sequence[ByteArray], names: Sequence[str], rest: ByteArray | None, whence: str, source: str
) -> Pictures:
    """The presses that share one shape, the background's where there is one."""
    shape = rest.shape if rest is not None else Counter(image.shape for image in read).most_common(1)[0][0]
    fits = [image.shape == shape for image in read]
    refused = tuple(
        Refused(
            name,
            "size",
            f"{image.shape[1]} x {image.shape[0]} pixels where the set has {shape[1]} x {shape[0]}: "
            "of another camera or resolution; take it out",
        )
        for name, image, fit in zip(names, read, fits, strict=True)
        if not fit
    )
    kept = [image for image, fit in zip(read, fits, strict=True) if fit]
    if not kept:
        raise CalibrationRefused(
            f"{source}: the background is {shape[1]} x {shape[0]} pixels and no press is; give the one "
            "that was taken with them"
        )
    images = np.stack(kept)
    if rest is None:
        rest, whence = (
            np.asarray(np.round(np.median(images, axis=0)), dtype=np.uint8),
            "the presses' own median, for no picture of the untouched gel was given",
        )
    return Pictures(
        read_only(np.ascontiguousarray(rest)),
        whence,
        read_only(images),
        tuple(name for name, fit in zip(names, fits, strict=True) if fit),
        None,
        source,
        set_digest(rest, images),
        refused,
    )


def _ordered(image: ByteArray, channels: Channels) -> ByteArray:
    return image if channels == "rgb" else np.ascontiguousarray(image[..., ::-1])


def digest(image: ByteArray) -> str:
    """Hash of one picture's pixels; presses are ordered by it, so that a folder's order changes nothing."""
    return hashlib.sha256(np.ascontiguousarray(image).tobytes()).hexdigest()


def set_digest(rest: ByteArray, images: ByteArray) -> str:
    """Hash of a background and its presses, whatever their order."""
    every = "".join([digest(rest), *sorted(digest(image) for image in images)])
    return hashlib.sha256(every.encode()).hexdigest()


@dataclass(frozen=True, eq=False)
class PressPack:
    """Pictures of one ball pressed into one gel at many places."""

    background: ByteArray  #: ``(rows, columns, 3)`` RGB, of the untouched gel.
    images: ByteArray  #: ``(presses, rows, columns, 3)`` RGB.
    centres: FloatArray  #: ``(presses, 2)`` pixels (column, row), marked by hand.
    radii: FloatArray  #: ``(presses,)`` pixels, of the marked circles.
    number: IntArray  #: ``(presses,)`` of each press in the file it came from, from 0.
    sha256: str  #: of that file.

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
