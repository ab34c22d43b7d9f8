"""A grid laid through the dots that are printed on a gel: found by a calibration, shown by its report."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class DotLattice:
    """A grid laid through dots."""

    index: IntArray  #: ``(n, 2)`` column and row of each dot from 0; -1 where it is on no grid.
    origin: FloatArray  #: ``(2,)`` pixels (column, row), of the grid's first column and row.
    step: FloatArray  #: ``(2, 2)`` pixels: first column to the next column of dots, second to the next row.
    affine: FloatArray  #: ``(n, 2)`` pixels, by which dots are off the linear grid; NaN off the grid.
    local: FloatArray  #: ``(n, 2)`` pixels, the same once a lens's smooth bend is taken out.
    missing: IntArray  #: ``(m, 2)`` column and row of places of the grid without a dot.

    @property
    def on(self) -> BoolArray:
        """``(n,)`` whether a dot is on the grid."""
        on: BoolArray = self.index[:, 0] >= 0
        return on

    @property
    def spacing(self) -> float:
        """Pixels from dot to dot: of a square grid with as many dots on the same area."""
        return float(np.sqrt(abs(np.linalg.det(self.step))))

    @property
    def columns(self) -> int:
        """Of the grid."""
        return int(self.index[:, 0].max()) + 1

    @property
    def rows(self) -> int:
        """Of the grid."""
        return int(self.index[:, 1].max()) + 1
