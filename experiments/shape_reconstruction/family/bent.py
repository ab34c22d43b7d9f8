"""Bent bodies that lie: a round section swept along an arc; fruit, grips and tubes."""

from types import MappingProxyType
from typing import Generic, NamedTuple, TypeVar, cast

import numpy as np

from experiments.shape_reconstruction.family.kind import Random, ShapeKind, sample_length
from experiments.shape_reconstruction.family.layout import BENT, POSE_SIZE
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

GIRTH_KNOTS = 5  #: points along the arc at which the section has a radius.

_S = TypeVar("_S")
_A = TypeVar("_A")


class BentParameters(NamedTuple, Generic[_S, _A]):
    """Parameters of a bent body, or their slots. Lengths are logarithms of metres."""

    arc: _S  #: length of the middle line.
    bend: _S  #: angle between its two ends, rad.
    girths: _A  #: ``(GIRTH_KNOTS,)`` radii along it.
    flat: _S  #: logarithm of the height of the section over its width.


def _by_name(own: FloatArray) -> BentParameters[float, FloatArray]:
    return BentParameters(own[0], own[1], own[2:7], own[7])


_parameters = compiled(_by_name)

SIZE = POSE_SIZE + 8  #: numbers of a bent body's vector.

SLOT = cast(BentParameters[int, IntArray], _by_name(cast(FloatArray, np.arange(POSE_SIZE, SIZE))))
"""Slot of each parameter in a shape's vector."""

_LENGTH, _BEND, _FLAT, _G, _BENT_MIDDLE = 8, 9, 10, 11, 16


@compiled
def prepare_bent(own: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a bent body from its parameters ``own``."""
    p = _parameters(own)
    q[_LENGTH], q[_BEND], q[_FLAT] = np.exp(p.arc), p.bend, np.exp(p.flat)
    most = 0.0
    for k in range(GIRTH_KNOTS):
        q[_G + k] = np.exp(p.girths[k])
        most = max(most, q[_G + k])
    q[_BENT_MIDDLE] = most * q[_FLAT]


@compiled
def bent_box(q: FloatArray, box: FloatArray) -> None:
    """Fill in the body's box in its own frame: least x, y, z, greatest x, y, z."""
    most = 0.0
    for k in range(GIRTH_KNOTS):
        most = max(most, q[_G + k])
    half = 0.5 * q[_LENGTH] + most
    # How far the ends of an arc are beside its middle.
    bow = 0.5 * q[_LENGTH] * np.tan(min(abs(0.25 * q[_BEND]), 1.5))
    box[0], box[1], box[2] = -half, -most - (bow if q[_BEND] < 0.0 else 0.0), 0.0
    box[3], box[4], box[5] = half, most + (bow if q[_BEND] > 0.0 else 0.0), 2.0 * q[_BENT_MIDDLE]


@compiled
def bent_distance(q: FloatArray, x: float, y: float, z: float) -> float:
    """Compute the signed distance from the surface, m."""
    half = 0.5 * q[_LENGTH]
    along, aside = x, y
    if abs(q[_BEND]) > 1e-3:
        radius = q[_LENGTH] / q[_BEND]
        # Polar coordinates about the arc's centre, which is at (0, radius).
        side = np.sign(radius)
        along = np.arctan2(x * side, (radius - y) * side) * abs(radius)
        aside = abs(radius) - np.hypot(x, radius - y)
    beyond = max(abs(along) - half, 0.0)
    at = (min(max(along, -half), half) / q[_LENGTH] + 0.5) * (GIRTH_KNOTS - 1)
    k = min(int(at), GIRTH_KNOTS - 2)
    girth = q[_G + k] + (at - k) * (q[_G + k + 1] - q[_G + k])
    slope = (q[_G + k + 1] - q[_G + k]) * (GIRTH_KNOTS - 1) / q[_LENGTH]
    flat = q[_FLAT]
    wide = np.hypot(beyond, aside)
    up = z - q[_BENT_MIDDLE]
    first = np.sqrt((wide / girth) ** 2 + (up / (girth * flat)) ** 2)
    second = np.sqrt((wide / girth**2) ** 2 + (up / (girth * flat) ** 2) ** 2)
    if second < 1e-9:
        return float(-girth * min(1.0, flat))
    return float(first * (first - 1.0) / second / np.sqrt(1.0 + slope * slope))


def _bent(random: Random, _code: IntArray, theta: FloatArray) -> None:
    """Fruit, grips, tubes: round, lying, straight or bent."""
    length, girth = sample_length(random, 60.0, 280.0), sample_length(random, 8.0, 35.0)
    theta[SLOT.arc], theta[SLOT.bend] = np.log(length), random.uniform(0.0, 1.8) * (random.random() < 0.7)
    ends = random.uniform(0.3, 1.1, 2)
    shape = np.array([ends[0], 0.5 * (1.0 + ends[0]), 1.0, 0.5 * (1.0 + ends[1]), ends[1]])
    theta[SLOT.girths] = np.log(girth * shape)
    theta[SLOT.flat] = np.log(random.uniform(0.7, 1.05))


class BentBody(ShapeKind):
    """A round section swept along an arc."""

    number = BENT
    size = SIZE
    lengths = (SLOT.arc, *SLOT.girths)
    width, height = int(SLOT.girths[2]), SLOT.arc
    section = tuple(SLOT.girths)
    classes = MappingProxyType({"bent body": _bent})

    def deviations(self, _code: IntArray) -> dict[int, float]:
        """Return one standard deviation of each free parameter about its sample, by slot."""
        return {SLOT.arc: 0.35, SLOT.bend: 0.5, SLOT.flat: 0.15, **dict.fromkeys(SLOT.girths, 0.35)}

    def extent(self, _code: IntArray, theta: FloatArray) -> tuple[float, float]:
        """Compute half the length and the height of a shape roughly, m."""
        return 0.5 * float(np.exp(theta[SLOT.arc])), 2.0 * float(np.exp(theta[SLOT.girths[2]]))
