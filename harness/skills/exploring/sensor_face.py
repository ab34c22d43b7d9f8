"""What of the sensor a surface meets first on a straight way: the gel, which reads it, or the housing.

The face is looked at in a few places, each as a ray along the way.
"""

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only

_STEPS = (-1.0, -0.5, 0.0, 0.5, 1.0)
_GRID = np.array([[x, y] for x in _STEPS for y in _STEPS])
_GEL = read_only(_GRID * [8.0e-3, 6.0e-3])
_AROUND = read_only(0.5 * _GRID[np.abs(_GRID).max(axis=1) == 1.0])

MIDDLE = 12
"""Of ``face_places``, the gel's middle."""

PRESSED = 1.0e-3
"""M that the gel is pressed on by after it has met something, for which the housing must have room."""


def face_places(housing: tuple[float, float], gel_thickness: float) -> FloatArray:
    """``(41, 3)`` m in ``gel``: 25 places of the gel's face, then 16 of the housing's border.

    Args:
        housing: ``(x, y)`` m, sides of the housing.
        gel_thickness: m by which the gel stands out of it.
    """
    gel = np.column_stack([_GEL, np.zeros(len(_GEL))])
    return np.concatenate([gel, np.column_stack([_AROUND * housing, np.full(len(_AROUND), -gel_thickness)])])


def ways_of(lines: FloatArray, places: FloatArray, back: float) -> tuple[FloatArray, FloatArray]:
    """Rays along which places of the face go.

    Args:
        lines: ``(n, 4, 4)`` of ``gel`` at the ends of straight ways along its z.
        places: ``(k, 3)`` m in ``gel``.
        back: m before its end from where on each way is followed.

    Returns:
        ``(n k, 3)`` m where rays begin, line by line; and their ``(n k, 3)`` unit directions.
    """
    begun = places - [0.0, 0.0, back]
    starts = lines[:, None, :3, 3] + np.einsum("nij,kj->nki", lines[:, :3, :3], begun)
    directions = np.repeat(lines[:, :3, 2], len(places), axis=0)
    return np.ascontiguousarray(starts.reshape(-1, 3)), np.ascontiguousarray(directions)


def gel_first(along: FloatArray) -> tuple[BoolArray, IntArray]:
    """Whether the gel reads what is met.

    Args:
        along: ``(n, 41)`` m that each of ``face_places`` goes until it meets something; infinite where it
            meets nothing.

    Returns:
        ``(n,)`` whether the gel meets something, and can be pressed on before the housing does; and ``(n,)``
        the place of the gel that does first.
    """
    gel, housing = along[:, : len(_GEL)], along[:, len(_GEL) :]
    first = gel.argmin(axis=1)
    at = gel[np.arange(len(gel)), first]
    return np.isfinite(at) & (housing.min(axis=1) > at + PRESSED), first
