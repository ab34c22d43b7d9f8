"""How well presses are predicted that a calibration has never seen: eight folds, press by press."""

from dataclasses import dataclass, replace

import numpy as np

from calibration.taxim.arm.rest import rest_change
from calibration.taxim.contact_circle import ContactCircle, contact_circle
from calibration.taxim.light_fit import GelLight, fit_light, light_shades
from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import (
    Manner,
    SmoothFit,
    aligned,
    contact_pixels,
    refined_centre,
    settled,
)
from calibration.taxim.table_fit import fit_table, table_shades
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.sim.optics.tactile_calibration import Float32Array

FOLDS = 8
WITHIN = 0.95
"""Of the median contact radius: the pixels that are scored."""

PLAIN = Manner(rounds=5, place_ridge=1e-4, edge_again=True)
OFFSET = Manner(offset=True, rounds=3, place_ridge=1e-4)

_SETTLE = 12


@dataclass(frozen=True, eq=False)
class FittedModel:
    """What is taught by a set of presses.

    Attributes:
        plain: slopes alone make the colour, as the smooth model of a calibration has it.
        fit: a contact's offset besides. With it a shift of all centres together is hardly seen in the
            colours, so the centres are those of the contact line.
        circle: the contact line.
        light: skirt and colours of the smooth level, fitted to the skirt too.
        table: of ``fit``.
        support: of the table.
        rest: ``(rows, columns, 3)`` grey levels, of the untouched gel against the background.
        bias: ``(2,)`` pixels from where the detector finds a centre to where the fit does.
    """

    plain: SmoothFit
    fit: SmoothFit
    circle: ContactCircle
    light: GelLight
    table: Float32Array
    support: BoolArray
    rest: FloatArray
    bias: FloatArray


@dataclass(frozen=True)
class Score:
    """One press predicted by presses it was not among; PSNR in dB over the scored pixels.

    Attributes:
        table: of the table, only the centre refitted.
        smooth: of the smooth level with the light of a press, at the same centre.
        unrefitted: of the table, with the centre where the detector found it.
        nothing: of no prediction at all, the untouched gel.
    """

    table: float
    smooth: float
    unrefitted: float
    nothing: float


def teach(pack: PressPack, change: FloatArray, ball: float) -> FittedModel:
    """Fit everything a calibration holds to presses.

    Args:
        pack: the presses; centres and radii as found.
        change: ``(presses, rows, columns, 3)`` grey levels against the background, drift removed.
        ball: radius in pixels.

    Raises:
        CalibrationRefused: the presses contradict the ball.
    """
    rest = rest_change(pack, change)
    clean = change - rest
    slopes_alone, _ = aligned(pack, clean, ball, PLAIN)
    loose, _ = aligned(replace(pack, centres=slopes_alone), clean, ball, OFFSET)
    circle = contact_circle(clean, loose, ball)
    fit = settled(pack, clean, loose + circle.shift, circle.radius, ball, OFFSET)
    plain = settled(pack, clean, slopes_alone, circle.radius, ball, PLAIN)
    table, support = fit_table(pack, fit, ball, clean)
    bias = np.median(fit.centres - pack.centres, axis=0)
    light = fit_light(pack, clean, fit.centres, circle.radius, ball)
    return FittedModel(plain, fit, circle, light, table, support, rest, np.asarray(bias))


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Presses predicted by the others.

    Attributes:
        scores: of every press.
        left: ``(rows, columns)`` what the table left over, summed over the presses, grey levels rms squared.
        count: ``(rows, columns)`` how many presses each pixel was scored in.
        centres: ``(presses, 2)`` pixels (column, row), refitted on the press by the other folds' model.
        folds: of each its model, the presses it was taught by and those left out.
    """

    scores: list[Score]
    left: FloatArray
    count: FloatArray
    centres: FloatArray
    folds: list[tuple[FittedModel, IntArray, IntArray]]


def held_out(pack: PressPack, change: FloatArray, ball: float, radius: float) -> HeldOut:
    """Score every press by a model of the other folds' presses.

    Args:
        pack: the presses; press ``k`` belongs to fold ``k % 8``.
        change: as for ``teach``.
        ball: radius in pixels.
        radius: pixels about a press's centre that are scored.
    """
    shape = change.shape[1:3]
    scores: dict[int, Score] = {}
    left, count, centres = np.zeros(shape), np.zeros(shape), np.zeros((len(change), 2))
    folds: list[tuple[FittedModel, IntArray, IntArray]] = []
    for fold in range(FOLDS):
        out = np.arange(len(change)) % FOLDS == fold
        taught: IntArray = np.nonzero(~out)[0]
        model = teach(pack.of(taught), change[taught], ball)
        folds.append((model, taught, np.nonzero(out)[0]))
        for k in np.nonzero(out)[0]:
            centres[k] = settled_centre(pack, change[k] - model.rest, pack.centres[k], model, ball)
            scores[int(k)], place, apart = score(pack, change[k], pack.centres[k], model, ball, radius)
            left[place[:, 0], place[:, 1]] += np.mean(apart**2, axis=1)
            count[place[:, 0], place[:, 1]] += 1.0
    return HeldOut([scores[k] for k in range(len(change))], left, count, centres, folds)


def score(
    pack: PressPack, change: FloatArray, found: FloatArray, model: FittedModel, ball: float, radius: float
) -> tuple[Score, IntArray, FloatArray]:
    """Score one press; also the pixels of it ``(n, 2)`` and what the table leaves over ``(n, 3)``."""
    clean = change - model.rest
    start = found + model.bias
    centre = settled_centre(pack, clean, found, model, ball)
    place, apart = _table_residual(pack, clean, centre, model.table, ball, radius)
    _, guessed = _table_residual(pack, clean, start, model.table, ball, radius)
    nothing = clean[place[:, 0], place[:, 1]]
    smooth = light_shades(pack, model.light, centre, place) - nothing
    answer = Score(decibels(apart), decibels(smooth), decibels(guessed), decibels(nothing))
    return answer, place, apart


def settled_centre(
    pack: PressPack, clean: FloatArray, found: FloatArray, model: FittedModel, ball: float
) -> FloatArray:
    """``(2,)`` pixels (column, row): where a model puts a press that the detector ``found``."""
    start = found + model.bias
    return refined_centre(pack, clean, start, model.fit.colours, model.fit.edge, ball, _SETTLE)


def decibels(left: FloatArray) -> float:
    """PSNR of what a prediction leaves over, in grey levels of 255."""
    return float(10.0 * np.log10(255.0**2 / max(float(np.mean(left**2)), 1e-12)))


def _table_residual(
    pack: PressPack, change: FloatArray, centre: FloatArray, table: Float32Array, ball: float, radius: float
) -> tuple[IntArray, FloatArray]:
    place = contact_pixels(pack.shape, centre, radius, 1)
    return place, table_shades(table, centre, place, ball) - change[place[:, 0], place[:, 1]]
