"""The pressure under a rigid object that is pressed into a gel as deep as a height map says.

Where the object presses, the surface of the gel is the object's; elsewhere nothing presses, and the gel lies
at or below it. Of all pressures of zero and more that is the one with the least energy ``p K p / 2 - p g``
(Kalker; Johnson, Contact Mechanics, 1985, section 5.9), found by conjugate gradients on the squares that
press (Polonsky and Keer, A numerical method for solving rough contact problems, Wear 231, 1999), with the
layer's influence summed by transforms on a grid of twice the size: no load meets a copy of itself.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.sim.gel.elastic import GelElastic
from harness.sim.gel.layer_compliance import influence

SETTLED = 1e-5
"""Share of the energy that is left where a search ends: a hundredth of what the finest squares are off by."""

_MOST_TURNS = 1000


@dataclass(frozen=True, eq=False)
class Pressure:
    """What presses where.

    Attributes:
        pascals: of every square, 0 where nothing presses.
        left: share of the energy by which the search ended short of the least; ``SETTLED`` or less where it
            settled.
        turns: of the search.
    """

    pascals: FloatArray
    left: float
    turns: int


def contact_pressure(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> Pressure:
    """Solve one contact, or several that feel each other.

    Args:
        depth: ``(rows, columns)`` metres, 0 or more: how deep the object reaches into the untouched gel; only
            squares above zero can press.
        pitch: metres, side of a square.
        thickness: metres of the gel; infinite for a half-space.
        gel: how stiff it is.
    """
    pascals = np.zeros(depth.shape)
    if not depth.any():
        return Pressure(read_only(pascals), 0.0, 0)
    rows, columns = (_span(np.asarray(depth.any(axis=axis))) for axis in (1, 0))
    found = _Search(depth[rows, columns], pitch, thickness, gel).run()
    pascals[rows, columns] = found.pascals
    return Pressure(read_only(pascals), found.left, found.turns)


def spring_pressure(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> FloatArray:
    """``(rows, columns)`` Pa under one contact, were the gel springs: the best that goes as the depth.

    A foundation of springs (Johnson, section 4.3) has no stiffness of its own on a layer; this one's is that
    of the least energy, so that an edge gets other springs than a ball.

    Args:
        depth: ``(rows, columns)`` metres, 0 or more, somewhere above zero.
        pitch: metres, side of a square.
        thickness: metres of the gel; infinite for a half-space.
        gel: how stiff it is.
    """
    return _Search(depth, pitch, thickness, gel).springs()


def _span(touched: AnyArray) -> slice:
    where = np.flatnonzero(touched)
    return slice(int(where[0]), int(where[-1]) + 1)


class _Search:
    """Conjugate gradients, in units of the deepest square and of the pressure that it would have alone."""

    def __init__(self, depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> None:
        rows, columns = depth.shape
        self._padded = tuple(next_fast_len(2 * n - 1, real=True) for n in depth.shape)
        quarter = influence(rows, columns, pitch, thickness, gel)
        self._deepest, self._own = float(depth.max()), float(quarter[0, 0])
        whole = np.zeros(self._padded)
        whole[:rows, :columns] = quarter / self._own
        whole[-rows + 1 or None :, :columns][: rows - 1] = whole[rows - 1 : 0 : -1, :columns]
        whole[:, -columns + 1 or None :][:, : columns - 1] = whole[:, columns - 1 : 0 : -1]
        self._waves = rfft2(whole)
        self._depth = depth / self._deepest
        self._may = self._depth > 0.0

    def springs(self) -> FloatArray:
        """Pa, in proportion to the depth."""
        return np.asarray(self._guess() * (self._deepest / self._own))

    def run(self) -> Pressure:
        """Turn until what is left settles."""
        pressure = self._guess()
        gap, along = self._gap(pressure), np.zeros_like(pressure)
        before, restart, turn = 1.0, True, 0
        while self._left(pressure, gap) > SETTLED and turn < _MOST_TURNS:
            pressing = pressure > 0.0
            now = float((gap[pressing] ** 2).sum())
            along = np.where(pressing, gap + (0.0 if restart else now / before) * along, 0.0)
            pressure, gap, restart = self._turned(pressure, gap, along)
            before, turn = now, turn + 1
        left = self._left(pressure, gap)
        return Pressure(pressure * (self._deepest / self._own), left, turn)

    def _turned(
        self, pressure: FloatArray, gap: FloatArray, along: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Pressure and gap one step on, and whether squares came into contact: it then starts anew."""
        moved = self._moved(along)
        curved = float((along * moved).sum())
        step = float((gap * along).sum()) / curved if curved > 0.0 else 0.0
        onward = pressure - step * along
        pulls = onward < 0.0
        onward[pulls] = 0.0
        touching = self._may & (onward == 0.0) & (gap < 0.0)
        onward[touching] = -step * gap[touching]
        if pulls.any() or touching.any():
            return onward, self._gap(onward), bool(touching.any())
        return onward, np.where(self._may, gap - step * moved, 0.0), False

    def _gap(self, pressure: FloatArray) -> FloatArray:
        """How far the gel is pushed beyond the object: negative where the object is in the gel."""
        return np.where(self._may, self._moved(pressure) - self._depth, 0.0)

    def _moved(self, pressure: FloatArray) -> FloatArray:
        rows, columns = pressure.shape
        spread: FloatArray = irfft2(rfft2(pressure, self._padded) * self._waves, self._padded)
        return spread[:rows, :columns]

    def _guess(self) -> FloatArray:
        """The depth itself as pressure, times what gives it the least energy."""
        reached = float((self._depth * self._moved(self._depth)).sum())
        return np.asarray(self._depth * (float((self._depth**2).sum()) / reached))

    def _left(self, pressure: FloatArray, gap: FloatArray) -> float:
        """Energy that may be left, as a share: gaps under the pressure, and depths that it does not reach."""
        under = float((pressure * np.abs(gap)).sum())
        beyond = float(np.maximum(-gap, 0.0)[pressure == 0.0].sum()) * float(pressure.max())
        return (under + beyond) / float((pressure * self._depth).sum())
