"""Whether a change of colour is that of a pressed gel: by the linear part of the calibration's shading.

Read through it, the colours of a press are the gradient of one surface that rises from its rest. Colours of
exchanged channels leave a remainder that no slope explains; a mirrored picture gives slopes that are no
surface's gradient; one turned by half a turn, or less its own press, gives a gel that was pulled out.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import label

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.poisson import free_heights
from harness.sim.optics.shading import POSITION_TERMS, design, scaled_position
from harness.sim.optics.tactile_calibration import TactileCalibration

_RIDGE = 16.0
_SHARE = 0.7
"""Of the slope limit, over which colours are made linear."""

_STRONG, _QUIET = 12.0, 6.0
"""Grey levels, length over the channels, of a block that a contact changed, and of one at rest."""

_LEAST_BLOCKS = 12
_MOST_OF_EDGE = 0.7
_STEEPEST = 0.8


@dataclass(frozen=True)
class SlopeFit:
    """How well a change of colour is explained as a pressed gel's.

    Attributes:
        explained: share of the change, in grey levels squared, that slopes explain.
        surface: share of those slopes, squared, that are one surface's gradient.
        raised: -1 to 1: mean height of the changed blocks above the rest, over the mean of its size; 0 where
            the rest does not go around the contact.
    """

    explained: float
    surface: float
    raised: float


def slope_fit(change: FloatArray, calibration: TactileCalibration, block: int) -> SlopeFit | None:
    """Explain a change of colour; None where too little changed to say, or only a table is known.

    Args:
        change: ``(rows, columns, 3)`` grey levels against the untouched gel, means over blocks.
        calibration: whose smooth model is asked.
        block: pixels a side of a block.
    """
    size = np.einsum("ijc,ijc->ij", change, change)
    strong = size > _STRONG**2
    if strong.sum() < _LEAST_BLOCKS or len(calibration.smooth) == 0:
        return None
    shading, inverse = linear_shading(calibration, block)
    normal = np.einsum("ijac,ijc->ija", inverse, change)
    apart = change - np.einsum("ijac,ija->ijc", shading, normal)
    explained = 1.0 - float((apart[strong] ** 2).sum() / size[strong].sum())
    slopes = _slopes(normal)
    slopes[size < _QUIET**2] = 0.0
    heights = free_heights(slopes[..., 1], slopes[..., 0])
    down, right = np.gradient(heights)
    curled = (right - slopes[..., 0]) ** 2 + (down - slopes[..., 1]) ** 2
    whole = float((slopes[strong] ** 2).sum())
    surface = 1.0 - float(curled[strong].sum()) / max(whole, 1e-12)
    rest = _around(size < _QUIET**2)
    if rest is None:
        return SlopeFit(explained, surface, 0.0)
    above = heights[strong] - float(heights[rest].mean())
    return SlopeFit(explained, surface, float(above.mean() / max(float(np.abs(above).mean()), 1e-12)))


def surface_residual(change: FloatArray, calibration: TactileCalibration, block: int) -> float:
    """Grey levels rms of a change of colour that is not that of one surface of the gel.

    Args:
        change: ``(rows, columns, 3)`` grey levels against the untouched gel, means over blocks.
        calibration: with a smooth model.
        block: pixels a side of a block.
    """
    shading, inverse = linear_shading(calibration, block)
    slopes = _slopes(np.einsum("ijac,ijc->ija", inverse, change))
    down, right = np.gradient(free_heights(slopes[..., 1], slopes[..., 0]))
    normal = -np.stack([right, down], axis=-1) / np.sqrt(1.0 + right**2 + down**2)[..., None]
    apart = change - np.einsum("ijac,ija->ijc", shading, normal)
    return float(np.sqrt((apart**2).sum(axis=2).mean()))


def _slopes(normal: FloatArray) -> FloatArray:
    sine = np.hypot(normal[..., 0], normal[..., 1])
    held = normal * np.minimum(1.0, _STEEPEST / np.maximum(sine, 1e-9))[..., None]
    return np.asarray(-held / np.sqrt(1.0 - (held**2).sum(axis=2, keepdims=True)))


def _around(quiet: BoolArray) -> BoolArray | None:
    """The quiet region that makes up most of the picture's edge; None where none does.

    Flat parts of a contact are quiet too, and higher than the rest: beside one that leaves the picture either
    may be the rest.
    """
    labels, count = label(quiet)
    edge = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    shares = np.bincount(edge, minlength=count + 1)[1:] / len(edge)
    if count == 0 or shares.max() < _MOST_OF_EDGE:
        return None
    return np.asarray(labels == 1 + int(shares.argmax()))


@lru_cache(maxsize=8)
def linear_shading(calibration: TactileCalibration, block: int) -> tuple[FloatArray, FloatArray]:
    """The calibration's smooth model made linear, at the middles of blocks.

    Returns:
        ``(rows, columns, 2, 3)`` colours of a normal by block, and the normal of a colour.
    """
    rows, columns = calibration.rows, calibration.columns
    by_place = np.einsum(
        "an,npc->apc",
        _linear_terms(_SHARE * calibration.header.slope_limit),
        calibration.smooth.reshape(-1, POSITION_TERMS, 3),
    )
    y, x = np.mgrid[: rows // block, : columns // block] * float(block) + 0.5 * (block - 1)
    places = place_terms(scaled_position(x.ravel(), y.ravel(), rows, columns))
    shading = np.einsum("np,apc->nac", places, by_place).reshape(*x.shape, 2, 3)
    gram = np.einsum("ijac,ijbc->ijab", shading, shading) + _RIDGE * np.eye(2)
    return read_only(shading), read_only(np.linalg.solve(gram, shading))


def _linear_terms(limit: float) -> FloatArray:
    """``(2, 20)``: least squares of the smooth model's terms by the normal alone, over a disc."""
    axis = np.linspace(-limit, limit, 15)
    normal = np.stack([one.ravel() for one in np.meshgrid(axis, axis)], axis=1)
    normal = normal[np.hypot(normal[:, 0], normal[:, 1]) <= limit]
    terms = design(normal, np.zeros_like(normal))[:, ::POSITION_TERMS]
    return np.asarray(np.linalg.lstsq(normal, terms, rcond=None)[0])
