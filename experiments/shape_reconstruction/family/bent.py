"""Signed distance of a bent body that lies: an elliptic section of changing girth along an arc."""

import numpy as np

from experiments.shape_reconstruction.family.layout import ARC, BEND, FLAT, GIRTH_KNOTS, GIRTHS
from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled

_LENGTH, _BEND, _FLAT, _G, _MIDDLE = 8, 9, 10, 11, 16


@compiled
def prepare_bent(theta: FloatArray, q: FloatArray) -> None:
    """Fill in the metres of a bent body from its vector."""
    q[_LENGTH], q[_BEND], q[_FLAT] = np.exp(theta[ARC]), theta[BEND], np.exp(theta[FLAT])
    most = 0.0
    for k in range(GIRTH_KNOTS):
        q[_G + k] = np.exp(theta[GIRTHS + k])
        most = max(most, q[_G + k])
    q[_MIDDLE] = most * q[_FLAT]


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
    box[3], box[4], box[5] = half, most + (bow if q[_BEND] > 0.0 else 0.0), 2.0 * q[_MIDDLE]


@compiled
def bent_distance(q: FloatArray, x: float, y: float, z: float) -> float:
    """Metres from the surface, negative inside."""
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
    up = z - q[_MIDDLE]
    first = np.sqrt((wide / girth) ** 2 + (up / (girth * flat)) ** 2)
    second = np.sqrt((wide / girth**2) ** 2 + (up / (girth * flat) ** 2) ** 2)
    if second < 1e-9:
        return float(-girth * min(1.0, flat))
    return float(first * (first - 1.0) / second / np.sqrt(1.0 + slope * slope))
