"""How loudly each mode sounds from each place of an object, as a table that a search reads."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.sound.kernels import blend_of_samples, nearest_in_table
from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface


@dataclass(frozen=True, eq=False)
class GainTable:
    """The modes at a surface's samples, made once an object.

    Attributes:
        surface: whose samples; gives the sample nearest to any place.
        shapes: ``(samples, m, 3)`` 1/sqrt(kg), float32.
        mean_squares: ``(m,)`` 1/kg: of each mode's gain along the normal, over the samples.
    """

    surface: Surface
    shapes: AnyArray
    mean_squares: FloatArray

    def nearest(self, points: FloatArray) -> IntArray:
        """``(n,)`` sample nearest to each of ``(n, 3)`` points in metres, however far."""
        table = self.surface.table
        found = nearest_in_table(np.ascontiguousarray(points), table.nearest, table.origin, table.pitch)
        far = np.nonzero(found < 0)[0]
        if len(far):
            found[far] = self.surface.tree.query(points[far])[1]
        return found

    def about(self, points: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray]:
        """``(n, 12)`` samples about ``(n, 3)`` places in metres that a hammer strikes, and their shares.

        Args:
            points: ``(n, 3)`` metres; how far they are off the surface along the hammer does not matter.
            directions: ``(n, 3)`` unit, of the hammer.
        """
        surface = self.surface
        return blend_of_samples(
            np.ascontiguousarray(points),
            np.ascontiguousarray(directions),
            self.nearest(points),
            surface.points,
            surface.normals,
            surface.neighbours,
            _ABOUT,
            _WIDTH * surface.spacing,
        )


_ABOUT = 12
_WIDTH = 0.5
"""Of the Gaussian between samples, in units of their spacing."""


def gain_table(modes: Modes, surface: Surface) -> GainTable:
    """Tabulate the modes at a surface's samples."""
    shapes = modes.at(surface.points).astype(np.float32)
    along = np.einsum("smi,si->sm", shapes, surface.normals.astype(np.float32))
    squares = np.asarray(np.mean(along**2, axis=0, dtype=np.float64))
    return GainTable(surface, read_only(shapes), read_only(squares))
