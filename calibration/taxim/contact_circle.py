"""The contact line of a ball, seen in all presses at once.

Laid over one another by their centres, the presses show one sharp line: along every ray from the centre the
change of colour grows with the slope up to where the gel leaves the ball, and fades from there. A circle
through those places says where the ball's axis is, whatever the lights do, and how large the contact is.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, map_coordinates

from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused

_RAYS = 48
_FROM, _TO = 0.5, 1.15
_STEPS = 66
_BLUR = 2.0
"""Steps of the radius, which are a hundredth of the ball."""

_TURNS = 3
_REWEIGHTED = 20
_LARGEST = 0.99
"""Ball radii: a contact line as large as the ball itself is not a contact line."""


@dataclass(frozen=True)
class ContactCircle:
    """Where the presses' contact line lies about the centres that were assumed.

    Attributes:
        shift: ``(2,)`` pixels (column, row) from the assumed centres to the circle's.
        radius: pixels.
        scatter: pixels, how far the line strays from the circle (scaled median of the rays).
    """

    shift: FloatArray
    radius: float
    scatter: float


def contact_circle(change: FloatArray, centres: FloatArray, ball: float) -> ContactCircle:
    """The circle through the places of strongest change.

    Args:
        change: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        centres: ``(presses, 2)`` pixels (column, row), right but for a shift of all together.
        ball: radius in pixels.

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
