"""What a calibration's colours are off by on presses that it has not seen: how much, and over what slopes.

Every press is left out by one of the folds and compared with that fold's colours at its own refitted centre.
What is left over has two parts. The camera's noise differs from pixel to pixel. The rest is alike from pixel
to pixel, since the fit or the press is off as a whole, so that it adds up along a face. The covariance of
pixels some way apart shows the second part alone.
"""

from collections.abc import Iterable

import numpy as np
from scipy.optimize import curve_fit
from scipy.signal import correlate

from calibration.taxim.held_out import HeldOut
from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import ball_shades, contact_pixels
from harness.basics.arrays import FloatArray, IntArray
from harness.sim.optics.tactile_calibration import ColourMisfit

_NOISE = 2
"""Pixels from which on a camera's noise, its colour filter's and its compression's share nothing."""

_FARTHEST = 0.7
"""Contact radii up to which the covariance is fitted: beyond, the refitted centre leaves little of it."""

_FEWEST = 3
"""Distances that are fitted, however small the contact."""

_ALIKE = (0.03, 1.0)
"""Sines of the slope between which the misfit's reach is looked for: a bin of the table, and every slope."""


def colour_misfit(
    pack: PressPack, change: FloatArray, out: HeldOut, ball: float, radius: float
) -> ColourMisfit:
    """The smooth part of what held-out presses leave over.

    Args:
        pack: the presses.
        change: ``(presses, rows, columns, 3)`` grey levels against the background, drift removed.
        out: of the same presses: the folds and the centres.
        ball: radius in pixels.
        radius: pixels about a press's centre that are compared.
    """
    left: list[tuple[FloatArray, FloatArray]] = []
    for model, _, left_out in out.folds:
        for k in left_out:
            place = contact_pixels(pack.shape, out.centres[k], radius, 1)
            seen = (change[k] - model.rest)[place[:, 0], place[:, 1]]
            shown = ball_shades(pack, out.centres[k], place, model.fit.colours, ball)
            left.append(_products(place, shown - seen, int(2.0 * radius) + 2))
    covariance, pairs = _pooled(left)
    return _fitted(covariance, pairs, ball, max(_FARTHEST * radius, _NOISE + _FEWEST - 1))


def _products(place: IntArray, left: FloatArray, reach: int) -> tuple[FloatArray, FloatArray]:
    """``(reach,)`` by distance in pixels: sums of products of pixels so far apart, and how many pairs."""
    row, column = (place - place.min(axis=0)).T
    there = np.zeros((row.max() + 1, column.max() + 1))
    there[row, column] = 1.0
    total = np.zeros([2 * side - 1 for side in there.shape])
    for channel in left.T:
        picture = np.zeros(there.shape)
        picture[row, column] = channel
        total += correlate(picture, picture, method="fft") / 3.0
    down, right = np.indices(total.shape) - (np.array(there.shape) - 1)[:, None, None]
    apart = np.minimum(np.rint(np.hypot(down, right)).astype(np.int64), reach - 1).ravel()
    pairs = correlate(there, there, method="fft")
    of_products, of_pairs = (np.bincount(apart, each.ravel(), reach) for each in (total, pairs))
    return of_products.astype(np.float64), of_pairs.astype(np.float64)


def _pooled(parts: Iterable[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    total, pairs = (np.sum(part, axis=0) for part in zip(*parts, strict=True))
    return np.asarray(total / np.maximum(pairs, 1.0)), np.asarray(pairs)


def _fitted(covariance: FloatArray, pairs: FloatArray, ball: float, farthest: float) -> ColourMisfit:
    apart = np.arange(_NOISE, int(farthest) + 1)
    sine, seen = apart / ball, covariance[apart]
    (variance, alike), _ = curve_fit(
        _covariance,
        sine,
        seen,
        p0=(max(float(seen[0]), 1e-3), 0.2),
        sigma=1.0 / np.sqrt(np.maximum(pairs[apart], 1.0)),
        bounds=([0.0, _ALIKE[0]], [np.inf, _ALIKE[1]]),
    )
    return ColourMisfit(float(np.sqrt(variance)), float(alike))


def _covariance(apart: FloatArray, variance: float, alike: float) -> FloatArray:
    """Of white noise under a Gaussian of sigma ``alike``, brought to ``variance``."""
    return np.asarray(variance * np.exp(-((apart / (2.0 * alike)) ** 2)))
