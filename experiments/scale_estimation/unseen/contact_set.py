"""What the network of touch is given: the straight ways of the gel, what each met and where it led."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.scale_estimation.touch.fit import Patch
from harness.basics.arrays import FloatArray

MOST = 16
"""Ways that are looked at; of more, the first."""

NUMBERS = 13
"""Of each way."""

WHOLE = 6
"""Numbers of all ways together."""

IMPRINT = 4
"""Numbers of an imprint whose place nobody knows."""

_FLATTEST = 2.0e-5
"""M, added to an imprint's extents before their logarithm is taken."""

_NEAR = 0.02
"""M: within it, how far a place is from the middle is told in metres, beyond it as a direction alone."""

_LENGTH = 0.1
_LEAST = 5.0e-3


@dataclass(frozen=True, eq=False)
class GelWay:
    """A straight way of the gel."""

    end: FloatArray
    """``(3,)`` m from where the object nominally stands: where it met it, or where the way ended."""
    direction: FloatArray  #: ``(3,)`` unit, along the way.
    normal: FloatArray | None  #: ``(3,)`` unit, out of the object; None where the gel met nothing.

    @classmethod
    def made(cls, base_from_gel: FloatArray, place: FloatArray, patch: Patch | None) -> "GelWay":
        """From where the arm ended, ``(4, 4)``, and what the gel read there."""
        end = base_from_gel[:3, 3] if patch is None else patch.points.mean(axis=0)
        return cls(end - place, base_from_gel[:3, 2], None if patch is None else patch.normal)

    def turned(self, yaw: float) -> "GelWay":
        """The same about the vertical, by rad."""
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        normal = None if self.normal is None else turn @ self.normal
        return GelWay(turn @ self.end, turn @ self.direction, normal)


def features(ways: Sequence[GelWay]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``(MOST, NUMBERS)`` a way each, ``(MOST, 2)`` which of them met and which missed, ``(WHOLE,)``."""
    rows, kinds = np.zeros((MOST, NUMBERS)), np.zeros((MOST, 2))
    taken = ways[:MOST]
    for k, way in enumerate(taken):
        apart = way.end / (np.linalg.norm(way.end) + _NEAR)
        normal = np.zeros(3) if way.normal is None else way.normal
        rows[k] = np.concatenate([way.end / _LENGTH, apart, normal, way.direction, [way.normal is not None]])
        kinds[k, 0 if way.normal is not None else 1] = 1.0
    # How far the touched places are apart, as logarithms of m; how high; how many met and missed.
    met = np.array([way.end for way in taken if way.normal is not None]).reshape(-1, 3)
    if not len(met):
        return rows, kinds, np.array([np.log(_LEAST)] * 4 + [0.0, 0.1 * len(taken)])
    flat = met[:, :2]
    widest = np.linalg.norm(flat[:, None] - flat[None], axis=2).max()
    spread = np.linalg.svd(flat - flat.mean(axis=0), compute_uv=False) / np.sqrt(len(flat))
    lengths = np.array([widest, met[:, 2].max(), spread[0], spread[-1] if len(spread) > 1 else 0.0])
    counts = 0.1 * len(met), 0.1 * (len(taken) - len(met))
    return rows, kinds, np.concatenate([np.log(np.maximum(lengths, 0.0) + _LEAST), counts])


def imprint_features(imprints: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``(MOST, IMPRINT)`` an imprint each, ``(MOST, 2)`` which there are, ``(1,)`` their number.

    Nothing is in them of where the arm was: how long, wide and deep the places are that the gel met.

    Args:
        imprints: ``(n, 3)`` m each, places of the object's surface in any frame.
    """
    rows, kinds = np.zeros((MOST, IMPRINT)), np.zeros((MOST, 2))
    taken = imprints[:MOST]
    for k, places in enumerate(taken):
        centred = places - places.mean(axis=0)
        extents = np.linalg.svd(centred, compute_uv=False) / np.sqrt(len(places))
        logs = np.log(extents + _FLATTEST) + 7.0
        rows[k] = np.append(logs, logs[0] - logs[1])
        kinds[k, 0] = 1.0
    return rows, kinds, np.array([0.1 * len(taken)])
