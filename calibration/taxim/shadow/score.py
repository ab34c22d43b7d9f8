"""Whether shadows predict presses that they were not fitted to, over the shadows' own pixels."""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.held_out import HeldOut, decibels
from calibration.taxim.light_fit import REACH, GelLight, light_shades, pressed_ball
from calibration.taxim.pack import PressPack
from calibration.taxim.shadow.fit import ShadowFit, fit_shadow
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import BoolArray, FloatArray
from harness.sim.optics.shadow import ShadowTable
from harness.sim.optics.shadow_image import soft_shadows

OWN = 1.0
"""Grey levels by which a shadow moves a pixel that is its own."""

LEAST_PIXELS = 20
"""Of a press, for it to be scored."""

LEAST_GAIN = 0.3
"""dB in the median over the shadow's own pixels; and two presses in three must gain."""

_SHARE = 2.0 / 3.0


@dataclass(frozen=True)
class ShadowScore:
    """Presses predicted by the other folds', over the pixels that the shadow moves by a grey level or more.

    Attributes:
        shaded: dB, median PSNR with the shadow.
        plain: dB, the same without.
        gain: dB, median over the presses of the difference.
        better: share of the presses that are predicted better with it.
        presses: that were scored.
        pixels: of a press, median.
        of: presses there are.
    """

    shaded: float
    plain: float
    gain: float
    better: float
    presses: int
    pixels: float

    of: int

    @property
    def worth(self) -> bool:
        """Whether the shadow is to be drawn."""
        return self.presses >= 0.5 * self.of and self.gain >= LEAST_GAIN and self.better >= _SHARE

    @property
    def sentence(self) -> str:
        """What was found, and what was wanted."""
        return (
            f"the shadow that all presses show was found by the folds of {self.presses} of {self.of} "
            f"presses, and predicts {self.better:.0%} of those better, by {self.gain:.2f} dB in the median; "
            f"half of all, {_SHARE:.0%} and {LEAST_GAIN:g} dB are wanted"
        )


def score_shadow(pack: PressPack, change: FloatArray, out: HeldOut, pitch: float, ball: float) -> ShadowScore:
    """Score the shadows of every fold on its held-out presses.

    Args:
        pack: the presses.
        change: ``(presses, rows, columns, 3)`` grey levels against the background, drift removed.
        out: how the folds were taught, and the centres of held-out presses.
        pitch: metres a pixel.
        ball: radius in pixels.
    """
    pairs: list[tuple[float, float, int]] = []
    for model, taught, left_out in out.folds:
        clean = change - model.rest
        fit = fit_shadow(pack.of(taught), clean[taught], model.fit.centres, model.light)
        for k in left_out:
            one = _press(pack, clean[k], out.centres[k], model.light, fit, pitch, ball)
            pairs += [] if one is None else [one]
    if not pairs:
        return ShadowScore(np.nan, np.nan, 0.0, 0.0, 0, 0.0, len(change))
    shaded, plain, pixels = np.array(pairs).T
    gain = shaded - plain
    return ShadowScore(
        float(np.median(shaded)),
        float(np.median(plain)),
        float(np.median(gain)),
        float((gain > 0.0).mean()),
        len(gain),
        float(np.median(pixels)),
        len(change),
    )


def _press(
    pack: PressPack,
    clean: FloatArray,
    centre: FloatArray,
    light: GelLight,
    fit: ShadowFit,
    pitch: float,
    ball: float,
) -> tuple[float, float, int] | None:
    table = fit.in_metres(pitch)
    if table is None:
        return None
    drawn, taken = shaded_press(pack, centre, light, table, pitch, ball)
    own = taken.max(axis=-1) >= OWN
    if own.sum() < LEAST_PIXELS:
        return None
    left = (drawn - clean)[own]
    return decibels(left - taken[own]), decibels(left), int(own.sum())


def shaded_press(
    pack: PressPack, centre: FloatArray, light: GelLight, table: ShadowTable, pitch: float, ball: float
) -> tuple[FloatArray, FloatArray]:
    """A press without its shadows, and what they take from it: ``(rows, columns, 3)`` grey levels each.

    Args:
        pack: gives the size of the picture.
        centre: pixels (column, row).
        light: slopes, skirt and light.
        table: with depths in metres.
        pitch: metres a pixel.
        ball: radius in pixels.
    """
    away = distance(pack.shape, centre)
    place = np.argwhere(away < REACH * light.edge)
    change = np.zeros((*pack.shape, 3))
    change[place[:, 0], place[:, 1]] = light_shades(pack, light, centre, place)
    surface = np.interp(away, np.arange(len(light.profile.height)), light.profile.height, right=0.0)
    core: BoolArray = pressed_ball(away, light.depth, ball) > light.skirt.core * light.depth
    taken, _ = soft_shadows(change[None], pitch * surface[None], surface[None], core[None], table, pitch)
    return change, taken[0]
