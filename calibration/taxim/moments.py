"""Normal equations of a gel's colours, from moments instead of from a matrix of terms.

Every term of the models is a product of powers: of the two parts of the surface's normal, of the two scaled
coordinates of the place and, for the light of a press, of the indentation. A product of two terms is such a
product again. So the normal equations of 120 terms hold 990 different sums over the pixels, and with the
light those of 156 hold 1755, where a matrix of terms would need 14 400 and 24 336 products a pixel. The sums
are the same ones; only their rounding differs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.sim.optics.shading import POSITION_TERMS
from harness.sim.optics.tactile_calibration import NORMAL_DEGREE, POSITION_DEGREE

Power = tuple[int, int, int]
"""Of the normal's x, of its y, and of the indentation: one group of terms, six by the place."""

SLOPES: tuple[Power, ...] = tuple(
    (a, b, 0) for a in range(NORMAL_DEGREE + 1) for b in range(NORMAL_DEGREE + 1 - a) if a + b
)
"""As ``harness.sim.optics.shading.design`` orders them."""

OFFSET: tuple[Power, ...] = ((0, 0, 0),)
"""What a contact adds by the place alone, as ``harness.sim.optics.lit_calibration.place_terms``."""

_PLACES = tuple((c, d) for c in range(POSITION_DEGREE + 1) for d in range(POSITION_DEGREE + 1 - c))


def graded(first: FloatArray, second: FloatArray, degree: int) -> FloatArray:
    """``(rows, n)`` products of powers of two ``(n,)`` arrays to a total degree, lower degrees first.

    Row ``s (s + 1) / 2 + a`` is ``first^a second^(s - a)``, so that all products to a lower degree are the
    first rows.
    """
    rows = np.empty((_count(degree), len(first)))
    rows[0] = 1.0
    for total in range(1, degree + 1):
        before, here = _count(total - 2), _count(total - 1)
        for a in range(total):
            np.multiply(rows[before + a], second, out=rows[here + a])
        np.multiply(rows[here - 1], first, out=rows[here + total])
    return rows


@dataclass(frozen=True, eq=False)
class ColourTerms:
    """The terms of a model at chosen pixels, never written out."""

    powers: tuple[Power, ...]  #: of the groups of terms.
    normals: FloatArray
    """``(_, n)`` products of the normal's parts, by ``graded`` to twice the model's degree."""
    places: FloatArray  #: ``(15, n)`` of the scaled place, to twice its degree; see ``place_products``.
    height: FloatArray | None = None  #: ``(n,)`` indentation; None where no power has one.

    def normal_equations(self, weight: FloatArray, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``terms.T @ diag(weight) @ terms`` and ``terms.T @ diag(weight) @ seen``.

        Args:
            weight: ``(n,)``.
            seen: ``(n, 3)``.

        Returns:
            ``(t, t)`` and ``(t, 3)``, terms in the order of ``powers``, places within.
        """
        layout = _layout(self.powers)
        moments = np.zeros((len(layout.moment_rows), max(layout.moment_rows), len(self.places)))
        right = np.zeros((len(layout.rows), max(layout.rows), 3 * POSITION_TERMS))
        weighted = weight
        for level, count in enumerate(layout.moment_rows):
            moments[level, :count] = self.normals[:count] @ (self.places * weighted).T
            if level < len(layout.rows):
                by_place = self.places[:POSITION_TERMS, None] * (seen.T * weighted)
                rows = layout.rows[level]
                right[level, :rows] = self.normals[:rows] @ by_place.reshape(3 * POSITION_TERMS, -1).T
            if self.height is not None:
                weighted = weighted * self.height
        by_term = right.reshape(len(layout.rows), -1, POSITION_TERMS, 3)[layout.term]
        return moments.ravel()[layout.pair], by_term

    def shades(self, colours: FloatArray) -> FloatArray:
        """``(n, 3)`` what coefficients ``(t, 3)`` make of the pixels."""
        layout = _layout(self.powers)
        spread = np.zeros((len(layout.rows), max(layout.rows), POSITION_TERMS, 3))
        spread[layout.term] = colours
        total = np.zeros((3 * POSITION_TERMS, self.normals.shape[1]))
        for level, rows in enumerate(layout.rows):
            part = spread[level, :rows].reshape(rows, -1).T @ self.normals[:rows]
            total += part if level == 0 or self.height is None else part * self.height**level
        by_place = total.reshape(POSITION_TERMS, 3, -1) * self.places[:POSITION_TERMS, None]
        shades: FloatArray = by_place.sum(axis=0).T
        return shades


def colour_terms(
    powers: Sequence[Power], normal: FloatArray, places: FloatArray, height: FloatArray | None = None
) -> ColourTerms:
    """The terms at ``(n, 2)`` normals.

    Args:
        powers: of the groups of terms.
        normal: ``(n, 2)``.
        places: ``(15, n)`` by ``place_products``.
        height: ``(n,)`` indentation; wanted where a power has one.
    """
    highest = max(a + b for a, b, _ in powers)
    return ColourTerms(tuple(powers), graded(normal[:, 0], normal[:, 1], 2 * highest), places, height)


def place_products(where: FloatArray) -> FloatArray:
    """``(15, n)`` products of ``(n, 2)`` scaled places that normal equations hold."""
    return graded(where[:, 0], where[:, 1], 2 * POSITION_DEGREE)


def _count(degree: int) -> int:
    return (degree + 1) * (degree + 2) // 2


@dataclass(frozen=True, eq=False)
class _Layout:
    """Where terms and pairs of terms lie among the sums."""

    rows: tuple[int, ...]
    """by the power of the indentation, how many products of the normal its terms reach."""
    moment_rows: tuple[int, ...]  #: the same of pairs of terms.
    term: tuple[IntArray, IntArray, IntArray]
    """three index arrays ``(t,)``: power of the indentation, product of the normal, of the place."""
    pair: IntArray  #: ``(t, t)`` index into the moments, raveled.


@lru_cache(maxsize=8)
def _layout(powers: tuple[Power, ...]) -> _Layout:
    terms = np.array([(*power, *place) for power in powers for place in _PLACES], dtype=np.int64)
    degree = terms[:, 0] + terms[:, 1]
    reach = [int(degree[terms[:, 2] == e].max(initial=0)) for e in range(int(terms[:, 2].max()) + 1)]
    pair_reach = [
        max(reach[e] + reach[level - e] for e in range(len(reach)) if 0 <= level - e < len(reach))
        for level in range(2 * len(reach) - 1)
    ]
    moment_rows = tuple(_count(degree) for degree in pair_reach)
    sums = terms[:, None] + terms[None]
    shape = (len(moment_rows), max(moment_rows), _count(2 * POSITION_DEGREE))
    pair = np.ravel_multi_index((sums[..., 2], _rows(sums[..., :2]), _rows(sums[..., 3:])), shape)
    term = (terms[:, 2], _rows(terms[:, :2]), _rows(terms[:, 3:]))
    return _Layout(tuple(_count(degree) for degree in reach), moment_rows, term, pair)


def _rows(exponents: IntArray) -> IntArray:
    total = exponents.sum(axis=-1)
    rows: IntArray = total * (total + 1) // 2 + exponents[..., 0]
    return rows
