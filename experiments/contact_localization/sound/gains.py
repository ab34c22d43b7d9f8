"""How loudly each mode sounds from each place of an object, as a table that a search reads."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.sound.kernels import blend_of_samples, nearest_in_table
from experiments.contact_localization.sound.mixing import ModeGroups, ModeMixing, mixed_groups
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
        groups: of modes that sound together.
    """

    surface: Surface
    shapes: AnyArray
    mean_squares: FloatArray
    groups: ModeGroups

    def nearest(self, points: FloatArray) -> IntArray:
        """``(n,)`` sample nearest to each of ``(n, 3)`` points in metres, however far."""
        table = self.surface.table
        found = nearest_in_table(np.ascontiguousarray(points), table.nearest, table.origin, table.pitch)
        far = np.nonzero(found < 0)[0]
        if len(far):
            found[far] = self.surface.tree.query(points[far])[1]
        return found

    def about(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """``(n, 7)`` samples about ``(n, 3)`` points in metres and their shares, smooth in the point."""
        surface = self.surface
        return blend_of_samples(
            np.ascontiguousarray(points),
            self.nearest(points),
            surface.points,
            surface.normals,
            surface.neighbours,
            _ABOUT,
            _WIDTH * surface.spacing,
        )


_ABOUT = 7
_WIDTH = 0.5
"""Of the Gaussian between samples, in units of their spacing."""


def gain_table(modes: Modes, surface: Surface, mixing: ModeMixing | None = None) -> GainTable:
    """Tabulate the modes at a surface's samples.

    Args:
        modes: of the object.
        surface: its samples.
        mixing: how far the object's modes may be mixtures of these; None for the usual.

    Raises:
        WrongUse: groups larger than can be weighed are to be made.
    """
    shapes = modes.at(surface.points).astype(np.float32)
    along = np.einsum("smi,si->sm", shapes, surface.normals.astype(np.float32))
    squares = np.asarray(np.mean(along**2, axis=0, dtype=np.float64))
    groups = mixed_groups(shapes, surface.points, modes.frequencies, mixing or ModeMixing())
    return GainTable(surface, read_only(shapes), read_only(squares), groups)
