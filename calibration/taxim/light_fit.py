"""The gel around a contact and the light on it, from the same ball presses.

Around a ball the gel hangs in a skirt several contacts wide, and its colours are the ball's own at the same
slopes. They are most of what a press changes in the picture. The skirt is Taxim's pyramid of blurs; how wide
it is, and how much of the ball's depth the object shapes, are the two numbers that explain the colours best.
With the surface known everywhere, the smooth model is fitted to contact and skirt at once, with the light
of ``harness.sim.optics.lit_calibration``, in proportion to how far the gel is pushed in. Without it a slope
of the skirt would get the dimming of a contact, or a contact none.
"""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.moments import SLOPES, ColourTerms, colour_terms, place_products
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import distance, huber, scaled_place
from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.sim.gel.gel import GelLevel, GelSkirt, deform
from harness.sim.optics import lit_calibration
from harness.sim.optics.shading import KNEE, POSITION_TERMS

REACH = 4.0
"""Contact radii from the centre that are looked at; in the published sets the skirt ends at 3.5."""

WITHIN_WEIGHT = 6.0
"""Of a pixel within the contact line against one of the skirt, of which there are ten times as many."""

_WIDTHS = (0.25, 1.0, 2.0, 4.0, 6.0, 9.0, 13.0)
"""Contact radii, of the widest blur."""

_BESIDE = (0.7, 0.85, 1.0, 1.15, 1.3)
_CORES = (0.2, 0.3, 0.4, 0.5, 0.55, 0.6, 0.65, 0.7)
_START = 0.5
_NARROWEST = 5
_FEW, _MANY = 250.0, 1000.0
"""Pixels of a press: to choose the skirt by, and to fit the colours to."""

_RIDGE, _PLACE_RIDGE = 1e-6, 1e-4


@dataclass(frozen=True, eq=False)
class RadialProfile:
    """A ball in the gel, by the distance from its axis; 0, 1, 2, ... pixels."""

    sine: FloatArray  #: of the surface's slope as the camera's pixels have it.
    height: FloatArray  #: pixels, of indentation.


@dataclass(frozen=True, eq=False)
class GelLight:
    """The skirt and the colours of contact and skirt."""

    skirt: GelSkirt  #: of the gel.
    lit: FloatArray
    """``(156, 3)`` as ``harness.sim.optics.lit_calibration`` keeps it, but per pixel of indentation."""
    depth: float  #: pixels that the ball reaches past the untouched gel.
    profile: RadialProfile  #: of the ball in it.
    edge: float  #: pixels, the contact line.
    limit: float  #: sine of the steepest slope.
    residual_rms: float  #: grey levels, over contact and skirt.


def fit_light(pack: PressPack, change: FloatArray, centres: FloatArray, edge: float, ball: float) -> GelLight:
    """Fit skirt and colours.

    Args:
        pack: the presses.
        change: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        centres: ``(presses, 2)`` pixels (column, row), of the balls' axes.
        edge: pixels, the contact line's radius.
        ball: radius in pixels.

    Raises:
        CalibrationRefused: the contact line is no smaller than the ball.
    """
    if not 0.0 < edge < ball:
        raise CalibrationRefused(
            f"the contact line has a radius of {edge:.1f} px and the ball one of {ball:.1f} px: no contact "
            "is larger than the ball; check the ball's radius (not its diameter) and the pitch"
        )
    few = _samples(pack, change, centres, edge, _FEW)

    def misfit(skirt: GelSkirt) -> float:
        return _solved(few, ball_profile(skirt, edge, ball, "fast"), edge, ball, turns=1)[1]

    best = min((skirt_of(width * edge, _START) for width in _WIDTHS), key=misfit)
    best = min((GelSkirt(best.kernels, best.final, core) for core in _CORES), key=misfit)
    best = min((skirt_of(wider * best.kernels[0], best.core) for wider in _BESIDE), key=misfit)
    return with_skirt(pack, change, centres, best, edge, ball)


def with_skirt(
    pack: PressPack, change: FloatArray, centres: FloatArray, skirt: GelSkirt, edge: float, ball: float
) -> GelLight:
    """Fit colours alone, to a known skirt; otherwise as ``fit_light``."""
    profile = ball_profile(skirt, edge, ball, "exact")
    lit, rms = _solved(_samples(pack, change, centres, edge, _MANY), profile, edge, ball)
    return GelLight(skirt, read_only(lit), depth_of(skirt, edge, ball), profile, edge, edge / ball, rms)


def skirt_of(widest: float, core: float) -> GelSkirt:
    """A pyramid of blurs, each half as wide as the one before it; ``widest`` in pixels."""
    kernels = [max(_NARROWEST, int(widest) | 1)]
    while kernels[-1] // 2 | 1 >= _NARROWEST and kernels[-1] > _NARROWEST:
        kernels.append(kernels[-1] // 2 | 1)
    return GelSkirt(tuple(kernels), core=core)


def depth_of(skirt: GelSkirt, edge: float, ball: float) -> float:
    """Pixels that a ball reaches in if it shapes the gel just out to its contact line."""
    return _cap(np.array(edge), ball).item() / (1.0 - skirt.core)


def ball_profile(skirt: GelSkirt, edge: float, ball: float, level: GelLevel) -> RadialProfile:
    """The surface around a ball that touches out to ``edge``; pixels."""
    reach = int(np.ceil(REACH * edge)) + 2
    size = reach + skirt.kernels[0] // 2
    away = distance((2 * size + 1, 2 * size + 1), np.array([size, size], dtype=np.float64))
    surface = deform(pressed_ball(away, depth_of(skirt, edge, ball), ball)[None], skirt, level)[0]
    height = surface[size, size : size + reach]
    slope = np.zeros(reach)
    slope[1:-1] = (height[:-2] - height[2:]) / 2.0
    return RadialProfile(read_only((slope / np.hypot(1.0, slope))[:-1]), read_only(height[:-1].copy()))


def pressed_ball(away: FloatArray, depth: float, ball: float) -> FloatArray:
    """How deep a ball reaches at distances from its axis; pixels, 0 where it does not."""
    inside = away < ball
    reached: FloatArray = np.where(
        inside, np.maximum(0.0, depth - _cap(np.where(inside, away, 0.0), ball)), 0.0
    )
    return reached


def light_shades(pack: PressPack, light: GelLight, centre: FloatArray, place: IntArray) -> FloatArray:
    """``(n, 3)`` grey levels that contact and skirt of a press give pixels ``(n, 2)``, row and column."""
    places = place_products(scaled_place(pack, place))
    return _terms(light.profile, place[:, ::-1] - centre, places, light.limit).shades(light.lit)


def _cap(away: FloatArray, ball: float) -> FloatArray:
    cap: FloatArray = ball - np.sqrt(ball**2 - away**2)
    return cap


@dataclass(frozen=True, eq=False)
class _Samples:
    """Pixels of all presses: from the press's centre (right, down), by ``place_products``, and the change."""

    offset: FloatArray
    places: FloatArray
    seen: FloatArray


def _samples(
    pack: PressPack, change: FloatArray, centres: FloatArray, edge: float, pixels: float
) -> _Samples:
    stride = max(1, round(float(np.sqrt(np.pi * (REACH * edge) ** 2 / pixels))))
    offset, where, seen = [], [], []
    for k, centre in enumerate(centres):
        # Another part of the raster in every press, so that no pixel of the sensor is always left out.
        first = np.array(divmod(k, stride)) % stride
        near = distance(pack.shape, centre)[first[0] :: stride, first[1] :: stride] < REACH * edge
        place = np.argwhere(near) * stride + first
        offset.append(place[:, ::-1] - centre)
        where.append(scaled_place(pack, place))
        seen.append(change[k][place[:, 0], place[:, 1]])
    return _Samples(np.concatenate(offset), place_products(np.concatenate(where)), np.concatenate(seen))


def _solved(
    samples: _Samples, profile: RadialProfile, edge: float, ball: float, turns: int = 2
) -> tuple[FloatArray, float]:
    """The coefficients ``(156, 3)`` and the weighted rms of what they leave over, grey levels."""
    terms = _terms(profile, samples.offset, samples.places, edge / ball)
    inside = np.hypot(samples.offset[:, 0], samples.offset[:, 1]) <= edge
    fixed = np.where(inside, WITHIN_WEIGHT, 1.0)
    weight = fixed
    for _ in range(turns):
        gram, right = terms.normal_equations(weight, samples.seen)
        diagonal = np.diag(gram)
        degrees = np.array([c + d for c in range(3) for d in range(3 - c)], dtype=np.float64)
        constants = diagonal.reshape(-1, POSITION_TERMS)[:, :1]
        ridge: FloatArray = _RIDGE * diagonal + (_PLACE_RIDGE * constants * degrees**2).ravel()
        lit = np.asarray(np.linalg.solve(gram + np.diag(ridge), right), dtype=np.float64)
        left = terms.shades(lit) - samples.seen
        weight = fixed * huber(left)
    rms = float(np.sqrt((fixed * np.mean(left**2, axis=1)).sum() / fixed.sum()))
    return lit, rms


def _terms(profile: RadialProfile, offset: FloatArray, places: FloatArray, limit: float) -> ColourTerms:
    away: FloatArray = np.hypot(offset[:, 0], offset[:, 1])
    radii = np.arange(len(profile.sine), dtype=np.float64)
    slope: FloatArray = np.interp(away, radii, profile.sine, right=0.0)
    knee, room = KNEE * limit, (1.0 - KNEE) * limit
    sine: FloatArray = np.where(
        slope <= knee, slope, knee + room * (1.0 - np.exp(-np.maximum(slope - knee, 0.0) / room))
    )
    height: FloatArray = np.interp(away, radii, profile.height, right=0.0)
    normal = offset * (sine / np.maximum(away, 1e-9))[:, None]
    light = tuple((a, b, 1) for a, b in lit_calibration.LIGHT_POWERS)
    return colour_terms(SLOPES + light, normal, places, height)
