"""The outline of an object in a picture: how far it reaches in each direction, and where it may be hidden."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import ndimage

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.basics.mesh import hull_of

DIRECTIONS = 72
"""In which the outline is read: one every five degrees."""

OUTSIDE = 0.3
"""Pixels from the outermost pixel's centre to the outline, on average over where it crosses the pixel;
left out, small objects come out smaller than they are."""

_MOST_CUT = 0.8
"""Of the directions in which a picture's border may cut an object off: two of its sides."""

_LEAST = 12
"""Pixels that an object must cover to have an outline."""


@dataclass(frozen=True, eq=False)
class SeenOutline:
    """How far an object reaches in a picture."""

    extents: FloatArray
    """``(DIRECTIONS,)`` pixels from the picture's upper left corner, along each direction."""
    hidden: BoolArray
    """``(DIRECTIONS,)`` bool: where the object may reach farther, behind what stands in front of it or beyond
    the picture's border."""


@cache
def directions() -> FloatArray:
    """``(DIRECTIONS, 2)`` unit vectors in the picture, x right and y down."""
    angles = np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS
    return read_only(np.column_stack([np.cos(angles), np.sin(angles)]))


def read_outline(mask: BoolArray, in_front: BoolArray | None = None) -> SeenOutline:
    """The outline of a mask.

    Args:
        mask: ``(rows, columns)`` the object's pixels.
        in_front: ``(rows, columns)`` where something may stand before it, as the arm; None for nowhere.

    Raises:
        DataRefused: too few pixels, or cut off all around.
    """
    if mask.sum() < _LEAST:
        raise DataRefused(
            f"the object covers {int(mask.sum())} pixels of the picture, and {_LEAST} are needed; check that "
            "it stands in the camera's view, and that both pictures are of the same camera"
        )
    extents = _extents(mask)
    reach = extents
    if in_front is not None and in_front.any():
        # What stands apart from the object hides nothing of it.
        parts, _ = ndimage.label(in_front & ~mask)
        touching = np.unique(parts[ndimage.binary_dilation(mask, iterations=2)])
        reach = np.maximum(reach, _extents(mask | np.isin(parts, touching[touching > 0])))
    cut = _cut_off(mask)
    if cut.mean() > _MOST_CUT:
        raise DataRefused(
            "what differs from the picture of the bare bench reaches the picture's borders on most sides; "
            "move the camera back, and check that both pictures are of one camera, in one light"
        )
    hidden = (reach > extents + 0.5) | cut
    return SeenOutline(read_only(extents + OUTSIDE), read_only(hidden))


def corners_of(outline: SeenOutline) -> FloatArray:
    """``(DIRECTIONS, 2)`` pixels: corners of the polygon that reaches as far, in order around it."""
    step = 2.0 * np.pi / DIRECTIONS
    towards, extents = directions(), outline.extents
    along = (np.roll(extents, -1) - extents * np.cos(step)) / np.sin(step)
    aside = np.column_stack([-towards[:, 1], towards[:, 0]])
    return np.asarray(extents[:, None] * towards + along[:, None] * aside)


def _extents(mask: BoolArray) -> FloatArray:
    rows, columns = np.nonzero(mask ^ ndimage.binary_erosion(mask))
    spanning = hull_of(np.column_stack([columns + 0.5, rows + 0.5]))
    return np.asarray((directions() @ spanning.T).max(axis=1))


def _cut_off(mask: BoolArray) -> BoolArray:
    """``(DIRECTIONS,)`` where the object leaves the picture."""
    cut = np.zeros(DIRECTIONS, bool)
    towards = directions()
    for side, normal in (
        (mask[:, 0], (-1, 0)),
        (mask[:, -1], (1, 0)),
        (mask[0], (0, -1)),
        (mask[-1], (0, 1)),
    ):
        if side.any():
            cut |= towards @ np.array(normal) > 0.0
    return cut
