"""Where the object is in a camera's picture: by a picture of the bench without it, or by colours alone."""

import cv2
import numpy as np
from scipy import ndimage

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, read_only
from harness.basics.errors import DataRefused

SILHOUETTE = 0.5
"""Share of a pixel that the object must cover to count among its own."""

_DIFFERS = 8.0
"""Grey levels of any channel by which the object differs from the bench behind it, at least."""

_DIFFERS_NOISES = 4.0
"""The same in medians of what pixels of the bench differ by, where its camera is noisier."""

_MARGIN = 0.5
"""Of the silhouette's box, added on each side, within which colours are told apart."""

_ROUNDS = 5
_SMALL = 3
"""Pixels along a side of what is taken for noise."""


def mask_by_background(
    live: ByteArray, background: ByteArray, silhouette: BoolArray | None = None
) -> BoolArray:
    """The object's pixels: those that differ from the bench without it, and those that these enclose.

    A shadow that the object throws on the bench differs too, where it is deep; a hole through which the bench
    is seen counts as the object.

    Args:
        live: ``(rows, columns, 3)`` RGB.
        background: the same by the same camera, the object taken away.
        silhouette: ``(rows, columns)`` where the object should be; what does not meet it, as an arm that
            moved, is not the object. None where nobody knows: it then covers less than half of the picture.

    Raises:
        DataRefused: pictures of two sizes.
    """
    anywhere = silhouette is None
    silhouette = np.ones(live.shape[:2], bool) if silhouette is None else silhouette
    if live.shape != background.shape or live.shape[:2] != silhouette.shape:
        raise DataRefused(
            f"the picture is {_pixels(live)} pixels, that of the bench {_pixels(background)} and the "
            f"simulated one {_pixels(silhouette)}; take all by one camera"
        )
    apart = np.abs(live.astype(np.int16) - background).max(axis=2)
    bench = apart.ravel() if anywhere else apart[~silhouette]
    noise = float(np.median(bench)) if bench.size else 0.0
    return ndimage.binary_fill_holes(_meeting(apart > max(_DIFFERS, _DIFFERS_NOISES * noise), silhouette))


def mask_by_colours(live: ByteArray, silhouette: BoolArray) -> BoolArray:
    """The object's pixels as far as colours tell: GrabCut (Rother, Kolmogorov and Blake, 2004) in OpenCV.

    It begins with the silhouette as a guess that any pixel may leave or join, so it leans towards it, and an
    object of its bench's own colours is not told from it.

    Args:
        live: ``(rows, columns, 3)`` RGB.
        silhouette: ``(rows, columns)`` where the object should be.

    Raises:
        DataRefused: pictures of two sizes, or a silhouette of nothing or of everything.
    """
    if live.shape[:2] != silhouette.shape:
        raise DataRefused(
            f"the picture is {_pixels(live)} pixels and the simulated one {_pixels(silhouette)}; take one"
        )
    if not silhouette.any() or silhouette.all():
        raise DataRefused(
            f"the object covers {'none' if not silhouette.any() else 'all'} of the simulated picture; check "
            "the camera's pose, it must show the object and some of what is behind it"
        )
    spans = []
    for axis in (1, 0):
        places = np.flatnonzero(silhouette.any(axis=axis))
        first, last = int(places[0]), int(places[-1]) + 1
        margin = int(np.ceil(_MARGIN * (last - first))) + _SMALL
        spans.append(slice(max(0, first - margin), min(silhouette.shape[1 - axis], last + margin)))
    near = spans[0], spans[1]
    cut = np.where(silhouette[near], cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    if not (cut == cv2.GC_PR_BGD).any():
        raise DataRefused(
            "the object fills the picture; go farther away, or give a picture of the bench alone"
        )
    cv2.setRNGSeed(0)  # it draws the first guess of each colour; the same picture has the same mask
    bench, thing = np.zeros((1, 65)), np.zeros((1, 65))
    seen = np.ascontiguousarray(live[near][..., ::-1])
    # The rectangle counts for nothing where a mask begins.
    cv2.grabCut(seen, cut, (0, 0, 1, 1), bench, thing, _ROUNDS, cv2.GC_INIT_WITH_MASK)
    mask = np.zeros(silhouette.shape, bool)
    mask[near] = (cut == cv2.GC_PR_FGD) | (cut == cv2.GC_FGD)
    return _meeting(mask, silhouette)


def overlap(one: BoolArray, other: BoolArray) -> float:
    """Pixels in both masks over those in either (IoU); 1 where both are empty."""
    either = int((one | other).sum())
    return float((one & other).sum()) / either if either else 1.0


def _meeting(mask: BoolArray, silhouette: BoolArray) -> BoolArray:
    """Keep the connected parts of a mask that are larger than noise and meet the silhouette.

    A part is kept whole (opening by reconstruction): an opening alone also cuts off every tip and every thin
    part of the object, so that it looks smaller than it is.
    """
    square = np.ones((_SMALL, _SMALL), bool)
    parts, _ = ndimage.label(mask, square)
    large = np.unique(parts[ndimage.binary_opening(mask, square)])
    met = np.intersect1d(np.unique(parts[silhouette]), large)
    return read_only(np.isin(parts, met[met > 0]))


def _pixels(picture: AnyArray) -> str:
    return f"{picture.shape[1]} x {picture.shape[0]}"
