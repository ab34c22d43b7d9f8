"""The light of a press whose contact fills the window: from what no slope can have changed.

Two slopes take up two of a block's three colours. The third, across both, is the resting gel's in the light
of the moment, whatever touches the gel. A light that multiplies is told from one that adds by which of the
two explains the resting gel's pattern better.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.sim.optics.check.light import ALIKE, UNCHANGED, LightMatch
from harness.sim.optics.check.slopes import linear_shading
from harness.sim.optics.tactile_calibration import TactileCalibration

_TURNS = 6
_LEAST = 1.0
"""Grey levels: remainders smaller than this weigh alike."""

_BETTER = 0.9
"""Of the remainder of a light that adds: a light that multiplies leaves less than this of it."""

_OTHER = 0.08
"""A gain this near to 1 is the fit's own error, and too small to matter."""


def light_under_contact(
    seen: FloatArray, known: FloatArray, calibration: TactileCalibration, block: int
) -> LightMatch | None:
    """Another exposure, one gain of all channels; None where the picture shows none.

    A gain of each channel is not to be told from the contact: it would be taken for one in a press of fifty.

    Args:
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        known: the same, of the resting gel.
        calibration: with a smooth model.
        block: pixels a side of a block.
    """
    across = _across_slopes(calibration, block)
    target, resting = (across * seen.reshape(-1, 3)).sum(axis=1), across * known.reshape(-1, 3)
    _, added = _fitted(across, target - resting.sum(axis=1))
    (gain,), left = _fitted(resting.sum(axis=1, keepdims=True), target)
    if abs(gain - 1.0) <= _OTHER or left >= _BETTER * added:
        return None
    return _matched(seen, known, np.full(3, gain))


def multiplies(
    light: LightMatch, seen: FloatArray, known: FloatArray, calibration: TactileCalibration, block: int
) -> bool:
    """Whether a light explains a press better than one that only adds, its slopes left out.

    Args:
        light: found beside a contact.
        seen: ``(rows, columns, 3)`` grey levels, means over blocks.
        known: the same, of the resting gel.
        calibration: with a smooth model.
        block: pixels a side of a block.
    """
    across = _across_slopes(calibration, block)
    change, apart = ((seen - one).reshape(-1, 3) for one in (known, light.shown(known)))
    _, added = _fitted(across, (across * change).sum(axis=1))
    return float(np.abs((across * apart).sum(axis=1)).mean()) < _BETTER * added


def _across_slopes(calibration: TactileCalibration, block: int) -> FloatArray:
    """``(blocks, 3)`` of length one, across the colours of both slopes."""
    shading, _ = linear_shading(calibration, block)
    across = np.cross(shading[..., 0, :], shading[..., 1, :])
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)).reshape(-1, 3)


def _fitted(design: FloatArray, target: FloatArray) -> tuple[FloatArray, float]:
    """The fit of least sizes, not squares, and their mean: steep faces leave linear shading far behind."""
    weight = np.ones(len(target))
    for _ in range(_TURNS):
        fitted = np.linalg.lstsq(design * weight[:, None], target * weight, rcond=None)[0]
        apart = np.abs(target - design @ fitted)
        weight = 1.0 / np.sqrt(np.maximum(apart, _LEAST))
    return np.asarray(fitted, np.float64), float(apart.mean())


def _matched(seen: FloatArray, known: FloatArray, gain: FloatArray) -> LightMatch:
    off = np.abs(seen - gain * known).max(axis=2)
    alike, tight = (float((off < limit).mean()) for limit in (ALIKE, UNCHANGED))
    return LightMatch(gain, np.zeros(3), alike, tight, True)
