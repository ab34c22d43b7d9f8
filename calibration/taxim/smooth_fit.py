"""The smooth model from ball presses: coefficients and the presses' true centres together.

The marks made by hand are a pixel or more off; the model is linear in its coefficients and a
ball's normal is linear in its centre, so the two are found in turns. Speckles of dirt on the
gel weigh less by Huber's rule.

A contact also takes light from the gel, whatever the slope: at the apex of a ball, where the gel is as
flat as untouched, real sensors are darker by a dozen grey levels. ``Manner.offset`` fits that too, as a
polynomial of the position; without it the model is pulled aside, and the centres with it.
"""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.moments import OFFSET, SLOPES, colour_terms, place_products
from calibration.taxim.pictures import PressPack
from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.shading import POSITION_TERMS, scaled_position, shades
from harness.sim.optics.tactile_calibration import POSITION_DEGREE, smooth_terms

_HUBER = 10.0
"""Grey levels beyond which a residual counts as an outlier: about twice the typical one."""

_RIDGE = 1e-6
"""Of the normalised normal equations."""

_PLACE_DEGREES = np.array([c + d for c in range(POSITION_DEGREE + 1) for d in range(POSITION_DEGREE + 1 - c)])

_FAR = 2.5
"""Ball radii from the centre beyond which the gel is taken to be untouched."""

_ENOUGH = 20.0
"""Pixels of contact radius that are enough; of larger contacts every second, third, ... row and column
is looked at."""

_LONGEST_STEP = 0.05
"""Ball radii, or a pixel where that is more: how far a centre may move at once."""


@dataclass(frozen=True)
class Manner:
    """How a set is fitted; the defaults are of presses whose circles were marked by hand."""

    offset: bool = False  #: whether a contact may change the colour whatever its slope.
    rounds: int = 6  #: of coefficients and centres in turns.
    place_ridge: float = 1e-3
    """pulls the colours towards being the same everywhere, in units of the constant terms' own weight.
    Presses seldom cover the whole gel; where none was made, two halves of the published set differ by 16 grey
    levels without it and by 6 with 1e-3, for 0.1 dB on presses held out."""
    edge_again: bool = False
    """whether the contact line is looked for again with refined centres, which show it sharper."""


WITH_OFFSET = Manner(offset=True, rounds=3, place_ridge=1e-4)
"""Fit for presses detected without marks; it includes an offset of each contact."""


@dataclass(frozen=True, eq=False)
class SmoothFit:
    """A smooth model and the presses as it sees them."""

    colours: FloatArray
    """``(120, 3)`` coefficients, see ``harness.sim.optics.shading``; ``(126, 3)`` where the last six are a
    contact's offset by the position."""
    centres: FloatArray  #: ``(presses, 2)`` pixels (column, row), refined.
    edge: float  #: pixels, the radius out to which the gel follows the ball.
    condition: float  #: of the normalised least-squares problem.
    residual_rms: float  #: grey levels.


def changes(pack: PressPack) -> FloatArray:
    """``(presses, rows, columns, 3)`` grey levels against the untouched gel, drift of the light removed."""
    change = pack.images.astype(np.float64) - pack.background
    for k in range(len(change)):
        far = distance(pack.shape, pack.centres[k]) > _FAR * pack.radii[k]
        change[k] -= np.median(change[k][far], axis=0)
    return change


def _ball_edge(change: FloatArray, centres: FloatArray, ball: float) -> float:
    """Return the radius in pixels where the gel is steepest, averaged over the presses."""
    profile = [strength_by_radius(change[k], centres[k], ball) for k in range(len(change))]
    edge = float(np.argmax(np.median(profile, axis=0))) + 0.5
    if not 3.0 <= edge < ball:
        raise CalibrationRefused(
            f"the presses are steepest {edge:.1f} px from their centres, and the ball has a radius "
            f"of {ball:.1f} px; check the ball's radius, the pitch and the marks"
        )
    return edge


def strength_by_radius(change: FloatArray, centre: FloatArray, ball: float) -> FloatArray:
    """Mean change of colour of one press in rings of a pixel, out to one and a half balls."""
    reach = int(np.ceil(1.5 * ball))
    low = np.maximum(np.floor(centre).astype(np.int64) - reach, 0)
    high = np.floor(centre).astype(np.int64) + reach + 2
    near = change[low[1] : max(high[1], 0), low[0] : max(high[0], 0)]
    ring = distance((near.shape[0], near.shape[1]), centre - low).astype(np.int64)
    seen = ring < reach
    strength = np.abs(near).sum(axis=2)
    total = np.bincount(ring[seen], strength[seen], minlength=reach)
    return np.asarray(total / np.maximum(np.bincount(ring[seen], minlength=reach), 1))


def aligned(pack: PressPack, change: FloatArray, ball: float, manner: Manner) -> tuple[FloatArray, float]:
    """Refined centres ``(presses, 2)`` and the contact line's radius, pixels.

    Args:
        pack: the presses; centres and radii are where the search begins.
        change: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        ball: radius in pixels.
        manner: how.

    Raises:
        CalibrationRefused: the presses contradict the ball.
    """
    centres = pack.centres.copy()
    edge = _ball_edge(change, centres, ball)
    for turn in range(manner.rounds):
        colours, _ = coefficients(pack, change, centres, edge, ball, manner)
        centres = np.stack(
            [refined_centre(pack, change[k], centres[k], colours, edge, ball) for k in range(len(centres))]
        )
        if manner.edge_again and turn == manner.rounds // 2:
            edge = _ball_edge(change, centres, ball)
    return centres, edge


def settled(
    pack: PressPack, change: FloatArray, centres: FloatArray, edge: float, ball: float, manner: Manner
) -> SmoothFit:
    """The fit of presses whose centres and contact line are known."""
    colours, normal = coefficients(pack, change, centres, edge, ball, manner)
    scale = np.sqrt(np.diag(normal))
    condition = float(np.linalg.cond(normal / np.outer(scale, scale)))
    left = [residual(pack, change[k], centres[k], colours, edge, ball) for k in range(len(centres))]
    rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    return SmoothFit(read_only(colours), read_only(centres), edge, condition, rms)


def residual(
    pack: PressPack, change: FloatArray, centre: FloatArray, colours: FloatArray, edge: float, ball: float
) -> FloatArray:
    """``(pixels, 3)`` model less picture, grey levels, inside the contact of one press."""
    place = contact_pixels(pack.shape, centre, edge, 1)
    return ball_shades(pack, centre, place, colours, ball) - change[place[:, 0], place[:, 1]]


def refined_centre(
    pack: PressPack,
    change: FloatArray,
    centre: FloatArray,
    colours: FloatArray,
    edge: float,
    ball: float,
    steps: int = 2,
) -> FloatArray:
    """The centre ``(2,)`` in pixels that explains one press best; Gauss-Newton steps of limited length."""
    place = contact_pixels(pack.shape, centre, edge, stride(edge))
    # What the contact adds by the place alone does not move with the centre.
    seen = change[place[:, 0], place[:, 1]] - _offset(pack, place, colours)
    longest = max(1.0, _LONGEST_STEP * ball)
    for _ in range(steps):
        shade, by_normal = _slope_shades(pack, centre, place, colours, ball)
        left = shade - seen
        weight = np.sqrt(huber(left))[:, None]
        jacobian = (by_normal * (weight / -ball)[:, None]).reshape(-1, 2)
        step = -np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ (left * weight).ravel())
        centre = centre + step * min(1.0, longest / max(float(np.linalg.norm(step)), 1e-12))
    return centre


def contact_pixels(shape: tuple[int, int], centre: FloatArray, edge: float, stride: int) -> IntArray:
    """``(n, 2)`` row and column of the pixels within ``edge`` of a centre, row by row."""
    low = np.maximum(np.floor(centre - edge).astype(np.int64), 0)
    low += -low % stride
    high = np.floor(centre + edge).astype(np.int64) + 1
    rows, columns = shape
    x, y = np.arange(low[0], min(high[0], columns), stride), np.arange(low[1], min(high[1], rows), stride)
    inside = np.argwhere(np.hypot(x[None, :] - centre[0], y[:, None] - centre[1]) <= edge)
    return inside * stride + low[::-1]


def distance(shape: tuple[int, int], centre: FloatArray) -> FloatArray:
    """``(rows, columns)`` pixels from a centre (column, row)."""
    rows, columns = shape
    right, down = np.arange(columns) - centre[0], np.arange(rows) - centre[1]
    away: FloatArray = np.sqrt((right**2)[None, :] + (down**2)[:, None])
    return away


def coefficients(
    pack: PressPack, change: FloatArray, centres: FloatArray, edge: float, ball: float, manner: Manner
) -> tuple[FloatArray, FloatArray]:
    """The colours ``(120 or 126, 3)`` that explain presses at known centres, and the normal matrix."""
    places = [contact_pixels(pack.shape, centre, edge, stride(edge)) for centre in centres]
    normal = np.concatenate([p[:, ::-1] - c for c, p in zip(centres, places, strict=True)]) / ball
    wanted = np.concatenate([change[k][place[:, 0], place[:, 1]] for k, place in enumerate(places)])
    where = scaled_place(pack, np.concatenate(places))
    terms = colour_terms(SLOPES + OFFSET if manner.offset else SLOPES, normal, place_products(where))
    weight = np.ones(len(wanted))
    for _ in range(2):
        gram, right = terms.normal_equations(weight, wanted)
        ridged = gram + np.diag(ridge_of(np.diag(gram), manner.place_ridge))
        colours = np.asarray(np.linalg.solve(ridged, right), dtype=np.float64)
        weight = huber(terms.shades(colours) - wanted)
    return colours, np.asarray(ridged, dtype=np.float64)


def ball_shades(
    pack: PressPack, centre: FloatArray, place: IntArray, colours: FloatArray, ball: float
) -> FloatArray:
    """``(n, 3)`` grey levels that a ball at a centre (column, row) gives pixels ``(n, 2)`` (row, column)."""
    return _slope_shades(pack, centre, place, colours, ball)[0] + _offset(pack, place, colours)


def scaled_place(pack: PressPack, place: IntArray) -> FloatArray:
    """``(n, 2)`` in -1..1 of pixels ``(n, 2)``, row and column."""
    y, x = (axis.astype(np.float64) for axis in place.T)
    return scaled_position(x, y, *pack.shape)


def _offset(pack: PressPack, place: IntArray, colours: FloatArray) -> FloatArray:
    offset = colours[smooth_terms() :]
    return place_terms(scaled_place(pack, place)) @ offset if len(offset) else np.zeros((len(place), 3))


def _slope_shades(
    pack: PressPack, centre: FloatArray, place: IntArray, colours: FloatArray, ball: float
) -> tuple[FloatArray, FloatArray]:
    shade, by_normal = np.empty((len(place), 3)), np.empty((len(place), 3, 2))
    shades(colours, (place[:, ::-1] - centre) / ball, place, *pack.shape, shade, by_normal)
    return shade, by_normal


def ridge_of(diagonal: FloatArray, place_ridge: float) -> FloatArray:
    """``(t,)`` what is added to the diagonal of the normal equations, see ``Manner.place_ridge``."""
    constants = diagonal.reshape(-1, POSITION_TERMS)[:, :1]
    ridge: FloatArray = _RIDGE * diagonal + (place_ridge * constants * _PLACE_DEGREES**2).ravel()
    return ridge


def stride(edge: float) -> int:
    """Every how many rows and columns a contact of this radius in pixels is looked at."""
    return max(1, int(np.ceil(edge / _ENOUGH)))


def huber(left: FloatArray) -> FloatArray:
    """``(n,)`` weights of what is left over ``(n, 3)`` grey levels: Huber's, so that dirt weighs less."""
    size = np.sqrt(np.mean(left**2, axis=1))
    weight: FloatArray = np.minimum(1.0, _HUBER / np.maximum(size, 1e-9))
    return weight
