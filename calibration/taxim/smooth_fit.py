"""The smooth model from ball presses: coefficients and the presses' true centres together.

The marks made by hand are a pixel or more off; the model is linear in its coefficients and a
ball's normal is linear in its centre, so the two are found in turns. Speckles of dirt on the
gel weigh less by Huber's rule.
"""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.pack import PressPack
from harness.arrays import BoolArray, FloatArray, read_only
from harness.errors import CalibrationRefused
from harness.sim.shading import POSITION_TERMS, design, scaled_position, shades
from harness.sim.tactile_calibration import POSITION_DEGREE

_ROUNDS = 6
_HUBER = 10.0
"""Grey levels beyond which a residual counts as an outlier: about twice the typical one."""

_RIDGE = 1e-6
"""Of the normalised normal equations."""

_PLACE_RIDGE = 1e-3
"""Pulls the colours towards being the same everywhere, in units of the constant terms' own weight.

Presses seldom cover the whole gel; where none was made, two halves of the published set differ
by 16 grey levels without this and by 6 with it, for 0.1 dB on presses held out.
"""

_PLACE_DEGREES = np.array([c + d for c in range(POSITION_DEGREE + 1) for d in range(POSITION_DEGREE + 1 - c)])

_FAR = 2.5
"""Ball radii from the centre beyond which the gel is taken to be untouched."""


@dataclass(frozen=True, eq=False)
class SmoothFit:
    """A smooth model and the presses as it sees them.

    Attributes:
        smooth: ``(120, 3)`` coefficients, see ``harness.sim.shading``.
        centres: ``(presses, 2)`` pixels (column, row), refined.
        edge: pixels, the radius out to which the gel follows the ball.
        condition: of the normalised least-squares problem.
        residual_rms: grey levels.
    """

    smooth: FloatArray
    centres: FloatArray
    edge: float
    condition: float
    residual_rms: float


def changes(pack: PressPack) -> FloatArray:
    """``(presses, rows, columns, 3)`` grey levels against the untouched gel, drift of the light removed."""
    change = pack.images.astype(np.float64) - pack.background
    for k in range(len(change)):
        far = _distance(pack, pack.centres[k]) > _FAR * pack.radii[k]
        change[k] -= np.median(change[k][far], axis=0)
    return change


def ball_edge(pack: PressPack, change: FloatArray, centres: FloatArray, ball: float) -> float:
    """The radius in pixels where the gel is steepest: the ball's contact line, mean over the presses.

    Raises:
        CalibrationRefused: it is not inside the ball.
    """
    reach = int(np.ceil(1.5 * ball))
    profile = np.zeros((len(change), reach))
    for k in range(len(change)):
        away = _distance(pack, centres[k])
        ring = away.astype(np.int64)
        seen = ring < reach
        strength = np.abs(change[k]).sum(axis=2)
        total = np.bincount(ring[seen], strength[seen], minlength=reach)
        profile[k] = total / np.maximum(np.bincount(ring[seen], minlength=reach), 1)
    edge = float(np.argmax(np.median(profile, axis=0))) + 0.5
    if not 3.0 <= edge < ball:
        raise CalibrationRefused(
            f"the presses are steepest {edge:.1f} px from their centres, and the ball has a radius "
            f"of {ball:.1f} px; check the ball's radius, the pitch and the marks"
        )
    return edge


def fit_smooth(pack: PressPack, ball: float) -> SmoothFit:
    """Fit coefficients and centres.

    Args:
        pack: the presses.
        ball: radius in pixels.

    Raises:
        CalibrationRefused: the presses contradict the ball.
    """
    change = changes(pack)
    centres = pack.centres.copy()
    edge = ball_edge(pack, change, centres, ball)
    for _ in range(_ROUNDS):
        smooth, condition = _coefficients(pack, change, centres, edge, ball)
        centres = np.stack(
            [refined_centre(pack, change[k], centres[k], smooth, edge, ball) for k in range(len(centres))]
        )
    smooth, condition = _coefficients(pack, change, centres, edge, ball)
    left = [residual(pack, change[k], centres[k], smooth, edge, ball) for k in range(len(centres))]
    rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    return SmoothFit(read_only(smooth), read_only(centres), edge, condition, rms)


def residual(
    pack: PressPack, change: FloatArray, centre: FloatArray, smooth: FloatArray, edge: float, ball: float
) -> FloatArray:
    """``(pixels, 3)`` model less picture, grey levels, inside the contact of one press."""
    inside = _distance(pack, centre) <= edge
    return _shades(centre, inside, smooth, ball)[0] - change[inside]


def refined_centre(
    pack: PressPack,
    change: FloatArray,
    centre: FloatArray,
    smooth: FloatArray,
    edge: float,
    ball: float,
    steps: int = 2,
) -> FloatArray:
    """The centre ``(2,)`` in pixels that explains one press best; Gauss-Newton steps of at most 1 px."""
    inside = _distance(pack, centre) <= edge
    for _ in range(steps):
        shade, by_normal = _shades(centre, inside, smooth, ball)
        left = shade - change[inside]
        weight = _huber(left)
        jacobian = by_normal / -ball
        normal = np.einsum("p,pca,pcb->ab", weight, jacobian, jacobian)
        step = -np.linalg.solve(normal, np.einsum("p,pca,pc->a", weight, jacobian, left))
        centre = centre + step * min(1.0, 1.0 / max(float(np.linalg.norm(step)), 1e-12))
    return centre


def _shades(
    centre: FloatArray, inside: BoolArray, smooth: FloatArray, ball: float
) -> tuple[FloatArray, FloatArray]:
    place = np.argwhere(inside)
    normal = (place[:, ::-1] - centre) / ball
    shade, by_normal = np.empty((len(place), 3)), np.empty((len(place), 3, 2))
    shades(smooth, normal, place, inside.shape[0], inside.shape[1], shade, by_normal)
    return shade, by_normal


def _coefficients(
    pack: PressPack, change: FloatArray, centres: FloatArray, edge: float, ball: float
) -> tuple[FloatArray, float]:
    masks = [_distance(pack, centre) <= edge for centre in centres]
    terms = np.concatenate([_terms(c, m, ball) for c, m in zip(centres, masks, strict=True)])
    wanted = np.concatenate([change[k][mask] for k, mask in enumerate(masks)])
    weight = np.ones(len(terms))
    for _ in range(2):
        weighted = terms * weight[:, None]
        gram, right = terms.T @ weighted, weighted.T @ wanted
        normal = gram + np.diag(_ridge(np.diag(gram)))
        smooth = np.linalg.solve(normal, right)
        weight = _huber(terms @ smooth - wanted)
    scale = np.sqrt(np.diag(normal))
    return smooth, float(np.linalg.cond(normal / np.outer(scale, scale)))


def _ridge(diagonal: FloatArray) -> FloatArray:
    constants = diagonal.reshape(-1, POSITION_TERMS)[:, :1]
    ridge: FloatArray = _RIDGE * diagonal + (_PLACE_RIDGE * constants * _PLACE_DEGREES**2).ravel()
    return ridge


def _terms(centre: FloatArray, inside: BoolArray, ball: float) -> FloatArray:
    rows, columns = inside.shape
    y, x = (axis.astype(np.float64) for axis in np.nonzero(inside))
    normal = np.stack([x - centre[0], y - centre[1]], axis=1) / ball
    return design(normal, scaled_position(x, y, rows, columns))


def _distance(pack: PressPack, centre: FloatArray) -> FloatArray:
    rows, columns = pack.background.shape[:2]
    away: FloatArray = np.hypot(np.arange(columns)[None, :] - centre[0], np.arange(rows)[:, None] - centre[1])
    return away


def _huber(left: FloatArray) -> FloatArray:
    size = np.sqrt(np.mean(left**2, axis=1))
    weight: FloatArray = np.minimum(1.0, _HUBER / np.maximum(size, 1e-9))
    return weight
