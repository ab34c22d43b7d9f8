"""Cross-validate a calibration on presses that were left out, in eight folds.

``_contact_circle`` finds the contact line of a ball in all presses at once. Laid over one another by their
centres, the presses show one sharp line: along every ray from the centre the colour change grows with the
slope up to where the gel leaves the ball, and fades from there. A circle through those points gives the
ball's axis, independently of the lights, and the radius of the contact.

``colour_misfit`` measures the error of the colours on presses that were left out. Every press is left out by
one of the folds and compared with that fold's colours at its own refitted centre. The residual has two
parts. The camera's noise differs from pixel to pixel. The rest is correlated between pixels, since the fit or
the press has an error as a whole, so that it adds up along a face. The covariance of distant pixels shows
the second part alone.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d, map_coordinates
from scipy.optimize import curve_fit
from scipy.signal import correlate

from calibration.taxim.arm.record import rest_change
from calibration.taxim.light_fit import GelLight, fit_light, light_shades
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import (
    WITH_OFFSET,
    Manner,
    SmoothFit,
    aligned,
    ball_shades,
    contact_pixels,
    refined_centre,
    settled,
)
from calibration.taxim.table import fit_table, table_shades
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.tactile_calibration import ColourMisfit, Float32Array

FOLDS = 8
WITHIN = 0.95
"""Of the median contact radius: the pixels that are scored."""

PLAIN = Manner(rounds=5, place_ridge=1e-4, edge_again=True)

_SETTLE = 12

_RAYS = 48
_FROM, _TO = 0.5, 1.15
_STEPS = 66
_BLUR = 2.0
"""Steps of the radius, which are a hundredth of the ball."""

_TURNS = 3
_REWEIGHTED = 20
_LARGEST = 0.99
"""Ball radii: a contact line as large as the ball itself is not a contact line."""

_NOISE = 2
"""Pixels from which on a camera's noise, its colour filter's and its compression's share nothing."""

_FARTHEST = 0.7
"""Contact radii up to which the covariance is fitted: beyond, the refitted centre leaves little of it."""

_FEWEST = 3
"""Distances that are fitted, however small the contact."""

_ALIKE = (0.03, 1.0)
"""Sines of the slope between which the misfit's reach is looked for: a bin of the table, and every slope."""


@dataclass(frozen=True)
class ContactCircle:
    """Where the presses' contact line lies about the centres that were assumed."""

    shift: FloatArray  #: ``(2,)`` pixels (column, row) from the assumed centres to the circle's.
    radius: float  #: pixels.
    scatter: float  #: pixels, how far the line strays from the circle (scaled median of the rays).


@dataclass(frozen=True, eq=False)
class FittedModel:
    """What is taught by a set of presses."""

    plain: SmoothFit  #: slopes alone make the colour, as the smooth model of a calibration has it.
    fit: SmoothFit
    """a contact's offset besides. With it a shift of all centres together is hardly seen in the colours, so
    the centres are those of the contact line."""
    circle: ContactCircle  #: the contact line.
    light: GelLight  #: skirt and colours of the smooth level, fitted to the skirt too.
    table: Float32Array  #: of ``fit``.
    support: BoolArray  #: of the table.
    rest: FloatArray  #: ``(rows, columns, 3)`` grey levels, of the untouched gel against the background.
    bias: FloatArray  #: ``(2,)`` pixels from where the detector finds a centre to where the fit does.


@dataclass(frozen=True)
class Score:
    """One press predicted by presses it was not among; PSNR in dB over the scored pixels."""

    table: float  #: of the table, only the centre refitted.
    smooth: float  #: of the smooth level with the light of a press, at the same centre.
    unrefitted: float  #: of the table, with the centre where the detector found it.
    nothing: float  #: of no prediction at all, the untouched gel.


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
    loose, _ = aligned(replace(pack, centres=slopes_alone), clean, ball, WITH_OFFSET)
    circle = _contact_circle(clean, loose, ball)
    fit = settled(pack, clean, loose + circle.shift, circle.radius, ball, WITH_OFFSET)
    plain = settled(pack, clean, slopes_alone, circle.radius, ball, PLAIN)
    table, support = fit_table(pack, fit, ball, clean)
    bias = np.median(fit.centres - pack.centres, axis=0)
    light = fit_light(pack, clean, fit.centres, circle.radius, ball)
    return FittedModel(plain, fit, circle, light, table, support, rest, np.asarray(bias))


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Presses predicted by the others."""

    scores: list[Score]  #: of every press.
    left: FloatArray
    """``(rows, columns)`` what the table left over, summed over the presses, grey levels rms squared."""
    count: FloatArray  #: ``(rows, columns)`` how many presses each pixel was scored in.
    centres: FloatArray
    """``(presses, 2)`` pixels (column, row), refitted on the press by the other folds' model."""
    folds: list[tuple[FittedModel, IntArray, IntArray]]
    """of each its model, the presses it was taught by and those left out."""


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


def _contact_circle(change: FloatArray, centres: FloatArray, ball: float) -> ContactCircle:
    """Fit the circle through the strongest change, and one common shift of the centres of all presses.

    Raises:
        CalibrationRefused: the line is no smaller than the ball.
    """
    shift = np.zeros(2)
    for _ in range(_TURNS):
        step, radius, scatter = _circle(*_line(change, centres + shift, ball))
        shift = shift + step
    if not radius < _LARGEST * ball:
        raise CalibrationRefused(
            f"the contact line has a radius of {radius:.1f} px and the ball one of {ball:.1f} px: no contact "
            "is larger than the ball; check the ball's radius (not its diameter) and the pitch"
        )
    return ContactCircle(shift, radius, scatter)


def _line(change: FloatArray, centres: FloatArray, ball: float) -> tuple[FloatArray, FloatArray]:
    """Along every ray the radius of strongest change, ``(rays,)`` pixels, and the rays' angles."""
    angles = 2.0 * np.pi * np.arange(_RAYS) / _RAYS
    radii = np.linspace(_FROM, _TO, _STEPS) * ball
    right, down = np.outer(np.cos(angles), radii), np.outer(np.sin(angles), radii)
    seen = np.empty((len(change), _RAYS, _STEPS, 3))
    for k, (x, y) in enumerate(centres):
        for c in range(3):
            map_coordinates(
                change[k, ..., c], [y + down, x + right], seen[k, ..., c], order=1, mode="nearest"
            )
    typical = gaussian_filter1d(np.median(seen, axis=0), _BLUR, axis=1, mode="nearest")
    strength = np.sqrt((typical**2).sum(axis=2))
    best = np.clip(np.argmax(strength, axis=1), 1, _STEPS - 2)
    before, there, after = (strength[np.arange(_RAYS), best + turn] for turn in (-1, 0, 1))
    bend = np.minimum(before - 2.0 * there + after, -1e-12)
    vertex = np.clip(0.5 * (before - after) / bend, -1.0, 1.0)
    return radii[best] + vertex * (radii[1] - radii[0]), angles


def _circle(radii: FloatArray, angles: FloatArray) -> tuple[FloatArray, float, float]:
    """Centre, radius and scatter of a circle through most of the rays' ends; algebraic, reweighted."""
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    weight = np.ones(len(x))
    terms, squares = np.column_stack([x, y, np.ones_like(x)]), x**2 + y**2
    for _ in range(_REWEIGHTED):
        solved = np.linalg.lstsq(terms * weight[:, None], squares * weight, rcond=None)[0]
        centre = 0.5 * solved[:2]
        radius = float(np.sqrt(max(float(solved[2] + centre @ centre), 0.0)))
        off = np.hypot(x - centre[0], y - centre[1]) - radius
        scatter = 1.4826 * float(np.median(np.abs(off)))
        weight = 1.0 / (1.0 + (off / max(1.5 * scatter, 1e-6)) ** 2)
    return np.asarray(centre, dtype=np.float64), radius, scatter


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
    total, pairs = (np.sum(part, axis=0) for part in zip(*left, strict=True))
    covariance = np.asarray(total / np.maximum(pairs, 1.0))
    farthest = max(_FARTHEST * radius, _NOISE + _FEWEST - 1)
    apart = np.arange(_NOISE, int(farthest) + 1)
    (variance, alike), _ = curve_fit(
        _covariance,
        apart / ball,
        covariance[apart],
        p0=(max(float(covariance[_NOISE]), 1e-3), 0.2),
        sigma=1.0 / np.sqrt(np.maximum(pairs[apart], 1.0)),
        bounds=([0.0, _ALIKE[0]], [np.inf, _ALIKE[1]]),
    )
    return ColourMisfit(float(np.sqrt(variance)), float(alike))


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


def _covariance(apart: FloatArray, variance: float, alike: float) -> FloatArray:
    """Of white noise under a Gaussian of sigma ``alike``, brought to ``variance``."""
    return np.asarray(variance * np.exp(-((apart / (2.0 * alike)) ** 2)))
