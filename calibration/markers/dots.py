"""Dark dots in a picture, to a fraction of a pixel.

Dots are found as blobs that are darker than the gel about them, of one size. Each is then fitted by itself:
a disc with a soft edge over a gel whose brightness is a plane, eight numbers, by least squares with a loss
that a glint on the ink cannot pull far. What the picture does not fit is the uncertainty of the place.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused

LEAST_INK = 0.15
"""Share of the light that a dot must swallow to be one: shades of a lit gel vary by less from dot to dot."""

LEAST_RADIUS = 1.5
"""Pixels: of a smaller dot the edge is all there is, and its place is not to be had to a tenth of a pixel."""

_SIZES = (0.4, 2.5)
"""Of the usual blob's area: beyond, it is dirt, or two dots in one."""

_SAMPLED = 0.004
"""Pixels rms by which drawn dots are placed wrong without noise: pixels are squares, here they are points."""

_CLOSE = 1e-6
"""Of a place: how closely its fit is finished."""

_ENOUGH = 480
"""Pixels of the shorter side: the gel's own light needs no more, and a median counts in 16 bits."""

_SPECK = 6
_AROUND = 1.8
"""Radii about a dot that it is fitted over, or half the way to the next dot where that is nearer."""

_SOFT = 0.03
"""Of the gel's light: what is off by more is a glint or a scratch."""


@dataclass(frozen=True, eq=False)
class Dots:
    """Dots of a picture, in no order."""

    places: FloatArray  #: ``(n, 2)`` pixels (column, row), of their middles.
    sigma: FloatArray
    """``(n,)`` pixels, one standard uncertainty of either coordinate, by what the fit left over."""
    radius: FloatArray  #: ``(n,)`` pixels.
    ink: FloatArray  #: ``(n,)`` share of the gel's light that the dot gives back.
    cut: int  #: how many blobs the border of the picture cuts, which are not used.
    odd: FloatArray  #: ``(m, 2)`` pixels, of dark places that are no dots: another size, not round, not dark.


def find_dots(picture: ByteArray) -> Dots:
    """Find the dots of a picture.

    Args:
        picture: ``(rows, columns, 3)`` grey levels.

    Raises:
        CalibrationRefused: nothing dark enough, or dots too small to be placed.
    """
    light = relative_light(picture)
    blobs, cut, odd = _blobs(light)
    usual = float(np.median(blobs[:, 2])) if len(blobs) else 0.0
    if 0.0 < usual < LEAST_RADIUS:
        raise CalibrationRefused(
            f"dots have a radius of {usual:.1f} px; at least {LEAST_RADIUS:g} px is wanted: take the picture "
            "at the camera's own resolution"
        )
    fitted = []
    for k, blob in enumerate(blobs):
        apart = np.hypot(*(blobs[:, :2] - blob[:2]).T)
        nearest = float(np.min(apart[np.arange(len(blobs)) != k], initial=np.inf))
        fitted.append((_fitted(light, blob, min(_AROUND * float(blob[2]), 0.5 * nearest)), blob))
    good = np.array([one for one, _ in fitted if one is not None]).reshape(-1, 5)
    odd = np.concatenate([odd, np.array([blob[:2] for one, blob in fitted if one is None]).reshape(-1, 2)])
    return Dots(
        read_only(good[:, :2].copy()),
        read_only(good[:, 2].copy()),
        read_only(good[:, 3].copy()),
        read_only(good[:, 4].copy()),
        cut,
        read_only(odd),
    )


def relative_light(picture: ByteArray) -> FloatArray:
    """``(rows, columns)`` light over the gel's own about it: 1 beside the dots, the ink's share on them.

    The gel's own is the median over a quarter of the shorter side: dots cover far less than half of that. It
    changes slowly, so that it is found on a smaller picture where the camera has many pixels.
    """
    rows, columns = picture.shape[:2]
    by = max(1, min(rows, columns) // _ENOUGH)
    small = cv2.resize(picture, (columns // by, rows // by), interpolation=cv2.INTER_AREA)
    side = (min(small.shape[:2]) // 4) | 1
    medians = cv2.merge([cv2.medianBlur(channel, side) for channel in cv2.split(small)])
    gel = cv2.resize(medians, (columns, rows), interpolation=cv2.INTER_LINEAR).astype(np.float64).sum(axis=2)
    light: FloatArray = picture.astype(np.float64).sum(axis=2) / np.maximum(gel, 1.0)
    return light


def _blobs(light: FloatArray) -> tuple[FloatArray, int, FloatArray]:
    """``(n, 3)`` column, row and radius of blobs of the usual size; how many are cut; where others are."""
    dark = _dark(light)
    _, _, boxes, middles = cv2.connectedComponentsWithStats(dark.astype(np.uint8), connectivity=8)
    area, middles = boxes[1:, cv2.CC_STAT_AREA].astype(np.float64), middles[1:]
    whole = _whole(boxes[1:], light.shape) & (area > _SPECK)
    if not whole.any():
        return np.zeros((0, 3)), int((area > _SPECK).sum()), np.zeros((0, 2))
    # The area below which half of all that is dark lies: specks are many, but make up little.
    order = np.argsort(area[whole])
    shares = np.cumsum(area[whole][order])
    usual = area[whole][order][int(np.searchsorted(shares, 0.5 * shares[-1]))]
    alike = whole & (area >= _SIZES[0] * usual) & (area <= _SIZES[1] * usual)
    cut = ~_whole(boxes[1:], light.shape) & (area > _SPECK)
    found = np.column_stack([middles[alike], np.sqrt(area[alike] / np.pi)])
    return found, int(cut.sum()), np.asarray(middles[whole & ~alike], dtype=np.float64)


def _dark(light: FloatArray) -> BoolArray:
    levels = np.clip(np.round(255.0 * light / 1.5), 0.0, 255.0).astype(np.uint8)
    split, _ = cv2.threshold(levels, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    dark = levels <= split
    apart = float(np.median(light[~dark]) - np.median(light[dark])) if dark.any() and not dark.all() else 0.0
    if apart < LEAST_INK:
        raise CalibrationRefused(
            f"what is darkest is {100.0 * apart:.0f} % darker than the gel about it; printed dots are at "
            f"least {100.0 * LEAST_INK:g} %: this gel has none, or the picture is too dark or not in focus"
        )
    return np.asarray(dark, dtype=np.bool_)


def _whole(boxes: AnyArray, shape: tuple[int, ...]) -> BoolArray:
    left, top, wide, high = (boxes[:, k] for k in range(4))
    inside: BoolArray = (left > 0) & (top > 0) & (left + wide < shape[1]) & (top + high < shape[0])
    return inside


@dataclass(frozen=True, eq=False)
class _SoftDisc:
    """A disc that swallows light, over a gel whose brightness is a plane, at ``(n,)`` pixels about a blob.

    Its eight numbers: the middle (right, down), the radius, the edge's blur, the share of light swallowed,
    and the plane's level and slopes.
    """

    right: FloatArray
    down: FloatArray
    seen: FloatArray

    def left(self, numbers: FloatArray) -> FloatArray:
        """``(n,)`` model less picture."""
        _, cover, plane, _ = self._parts(numbers)
        off: FloatArray = plane * (1.0 - numbers[4] * cover) - self.seen
        return off

    def slopes(self, numbers: FloatArray) -> FloatArray:
        """``(n, 8)`` of ``left`` by its numbers."""
        edge, cover, plane, away = self._parts(numbers)
        blur, swallowed = numbers[3:5]
        by_edge = -plane * swallowed * np.exp(-0.5 * edge**2) / (np.sqrt(2.0 * np.pi) * blur)
        kept = 1.0 - swallowed * cover
        return np.stack(
            [
                by_edge * (self.right - numbers[0]) / away,
                by_edge * (self.down - numbers[1]) / away,
                by_edge,
                -by_edge * edge,
                -plane * cover,
                kept,
                kept * self.right,
                kept * self.down,
            ],
            axis=1,
        )

    def _parts(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        away = np.maximum(np.hypot(self.right - numbers[0], self.down - numbers[1]), 1e-9)
        edge = (numbers[2] - away) / numbers[3]
        plane = numbers[5] + numbers[6] * self.right + numbers[7] * self.down
        return edge, ndtr(edge), plane, away


def _fitted(light: FloatArray, blob: FloatArray, reach: float) -> FloatArray | None:
    """Column, row, uncertainty, radius and ink of one dot; None where it is none."""
    x0, y0, radius = blob
    low = np.maximum(np.floor(blob[:2] - reach).astype(int), 0)
    high = np.ceil(blob[:2] + reach).astype(int) + 1
    window = light[low[1] : high[1], low[0] : high[0]]
    y, x = (
        axis.astype(np.float64)
        for axis in np.mgrid[low[1] : low[1] + window.shape[0], low[0] : low[0] + window.shape[1]]
    )
    near = np.hypot(x - x0, y - y0) <= reach
    seen, right, down = window[near], x[near] - x0, y[near] - y0
    disc = _SoftDisc(right, down, seen)

    start = np.array(
        [
            0.0,
            0.0,
            radius,
            0.6,
            1.0 - float(np.median(seen[np.hypot(right, down) < 0.7 * radius])),
            1.0,
            0.0,
            0.0,
        ]
    )
    lowest = np.array([-radius, -radius, 0.4 * radius, 0.2, 0.0, 0.3, -0.2, -0.2])
    highest = np.array([radius, radius, 1.7 * radius, 3.0, 1.0, 2.0, 0.2, 0.2])
    start = np.clip(start, lowest + 1e-6, highest - 1e-6)
    found = least_squares(
        disc.left,
        start,
        disc.slopes,
        bounds=(lowest, highest),
        loss="soft_l1",
        f_scale=_SOFT,
        x_scale="jac",
        ftol=_CLOSE,
        xtol=_CLOSE,
    )
    cx, cy, r, blur, swallowed = found.x[:5]
    bound = (found.x[:3] <= lowest[:3] + 1e-3) | (found.x[:3] >= highest[:3] - 1e-3)
    if not found.success or swallowed < LEAST_INK or bound.any():
        return None
    slopes: FloatArray = np.asarray(found.jac, dtype=np.float64)
    free = max(len(seen) - len(found.x), 1)
    spread = float(np.sum(np.minimum(np.abs(found.fun), 3.0 * _SOFT) ** 2)) / free
    covariance = spread * np.linalg.pinv(slopes.T @ slopes)
    sigma = np.hypot(np.sqrt(0.5 * np.trace(covariance[:2, :2])), _SAMPLED)
    # Blurring draws a bent edge inwards: half of it, over the radius, of the blur's variance.
    return np.array([x0 + cx, y0 + cy, sigma, r + 0.5 * blur**2 / r, 1.0 - swallowed])
