"""The frame in which the network sees touches: about their middle, on the support, as long as they reach."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain

TAKEN = 1024
"""Points that the network takes, as in the paper's own network."""

GIVEN = 1024
"""Points that it gives."""

_LEAST_REACH = 1.0e-3


@dataclass(frozen=True, eq=False)
class PointFrame:
    """From metres to the network's numbers."""

    middle: FloatArray
    """``(3,)`` m in ``stand``: between the least and the greatest x and y touched; z of the support."""
    reach: float  #: m: the longest side of the box of all touches and the support.

    @classmethod
    def of(cls, points: FloatArray) -> "PointFrame":
        """Of ``(n, 3)`` m of touched places in ``stand``, whose support is z = 0.

        Raises:
            OutOfDomain: no point, or all of them in one place at the support.
        """
        if len(points) == 0:
            raise OutOfDomain(
                "no place was touched, and the network completes places; touch the object first"
            )
        low, high = points.min(axis=0), points.max(axis=0)
        reach = float(max(high[0] - low[0], high[1] - low[1], high[2]))
        if not reach > _LEAST_REACH:
            raise OutOfDomain(
                f"touches reach {reach * 1e3:.2f} mm, and {_LEAST_REACH * 1e3:g} mm are needed for a frame; "
                "touch the object in more places"
            )
        middle = 0.5 * (low + high)
        return cls(np.array([middle[0], middle[1], 0.0]), reach)

    def inward(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` m as the network's numbers."""
        return np.asarray((points - self.middle) / self.reach)

    def outward(self, numbers: FloatArray) -> FloatArray:
        """``(n, 3)`` of the network's numbers as m in ``stand``."""
        return np.asarray(numbers * self.reach + self.middle)


def taken(points: FloatArray, seed: int = 0) -> FloatArray:
    """``(TAKEN, 3)`` of ``(n, 3)`` points: as many of each as can be, the rest drawn."""
    random = np.random.default_rng(seed)
    whole, rest = divmod(TAKEN, len(points))
    rows = np.concatenate([np.tile(np.arange(len(points)), whole), random.permutation(len(points))[:rest]])
    return np.asarray(points[rows])
