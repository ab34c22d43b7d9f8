"""Tactile images and height maps as small pictures, pixel for pixel."""

from io import BytesIO

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imsave

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, block_means
from harness.picture.live_picture import LiveComparison
from harness.report.figures.style import ANSWER, TOOL, blank, styled, titled_picture

DIFFERENCE_GAIN = 3.0
"""How much differences of images are amplified about middle grey."""

_LARGEST_WIDTH = 480

_WIDTH, _WORDS = 4.0, 0.95

_MARGIN = 0.35
"""Of the object's box, shown on each side of it."""


def difference(live: AnyArray, simulated: AnyArray) -> ByteArray:
    """Live less simulated, amplified, about middle grey."""
    apart = live.astype(np.float64) - simulated.astype(np.float64)
    return np.clip(127.5 + DIFFERENCE_GAIN * apart, 0.0, 255.0).astype(np.uint8)


def height_picture(height: FloatArray, highest: float) -> ByteArray:
    """Colour an indentation map in m as ``(rows, columns, 3)``, dark at 0 and bright at ``highest``."""
    level = np.clip(height / highest, 0.0, 1.0) if highest > 0.0 else np.zeros_like(height)
    colours = mpl.colormaps["viridis"](level)[..., :3]
    return np.asarray(np.round(255.0 * colours), dtype=np.uint8)


def png(picture: AnyArray) -> bytes:
    """A PNG file of ``(rows, columns, 3)`` uint8 RGB, averaged down to at most 480 columns."""
    block = -(-picture.shape[1] // _LARGEST_WIDTH)
    file = BytesIO()
    imsave(file, np.round(block_means(picture, block)).astype(np.uint8), format="png")
    return file.getvalue()


def live_figure(found: LiveComparison, words: tuple[str, str, str]) -> Figure:
    """Live with both outlines, simulated, and live less simulated: the part of the pictures about the object.

    Args:
        found: the comparison.
        words: under each of the three pictures.

    Raises:
        ValueError: pictures of other shapes.
    """
    shapes = {found.live.shape, found.simulated.shape}
    if len(shapes) != 1 or {found.silhouette.shape, found.mask.shape} != {found.live.shape[:2]}:
        raise ValueError(f"pictures of {shapes} with masks of {found.silhouette.shape}, {found.mask.shape}")
    near = _about(found.mask | found.silhouette)
    live_part, simulated_part = found.live[near], found.simulated[near]
    rows, columns = live_part.shape[:2]
    with styled():
        figure = blank(3 * _WIDTH, _WIDTH * rows / columns + _WORDS, "constrained")
        live, simulated, left = np.asarray(figure.subplots(1, 3)).tolist()
        titled_picture(live, live_part, "live", words[0])
        _outline(live, found.silhouette[near], ANSWER)
        _outline(live, found.mask[near], TOOL)
        titled_picture(simulated, simulated_part, "simulated, as exposed", words[1])
        titled_picture(
            left,
            difference(live_part, simulated_part),
            f"live - simulated, x {DIFFERENCE_GAIN:g}",
            words[2],
        )
    return figure


def _about(mask: BoolArray) -> tuple[slice, slice]:
    """The rows and columns that show a mask and what is around it; all where it is empty."""
    if not mask.any():
        return slice(None), slice(None)
    shown = []
    for axis in (1, 0):
        places = np.flatnonzero(mask.any(axis=axis))
        margin = 1 + int(_MARGIN * (places[-1] - places[0] + 1))
        shown.append(slice(max(0, int(places[0]) - margin), int(places[-1]) + 1 + margin))
    return shown[0], shown[1]


def _outline(axes: Axes, mask: BoolArray, colour: str) -> None:
    if mask.any() and not mask.all():
        axes.contour(mask, levels=[0.5], colors=[colour], linewidths=0.8)
