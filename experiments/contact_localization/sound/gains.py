"""How loudly each mode sounds from each place of an object, as a table that a search reads."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from experiments.contact_localization.sound.kernels import faces_about, nearest_in_table
from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface

_CANDIDATES = 16
"""Faces about a sample among which the one nearest to a place is looked for."""


@dataclass(frozen=True, eq=False)
class GainTable:
    """The modes at a surface's samples and at the nodes of their own mesh, made once an object.

    Attributes:
        surface: whose samples; gives the sample nearest to any place.
        shapes: ``(samples + nodes, m, 3)`` 1/sqrt(kg), float32.
        mean_squares: ``(m,)`` 1/kg: of each mode's gain along the normal, over the samples.
        nodes: ``(nodes, 3)`` metres.
        faces: ``(f, 3)`` nodes of the mesh's surface.
        near_faces: ``(samples, k)`` faces about each sample.
    """

    surface: Surface
    shapes: AnyArray
    mean_squares: FloatArray
    nodes: FloatArray
    faces: IntArray
    near_faces: AnyArray

    @property
    def at_samples(self) -> AnyArray:
        """``(samples, m, 3)`` of ``shapes``."""
        return self.shapes[: len(self.surface.points)]

    def nearest(self, points: FloatArray) -> IntArray:
        """``(n,)`` sample nearest to each of ``(n, 3)`` points in metres, however far."""
        table = self.surface.table
        found = nearest_in_table(np.ascontiguousarray(points), table.nearest, table.origin, table.pitch)
        far = np.nonzero(found < 0)[0]
        if len(far):
            found[far] = self.surface.tree.query(points[far])[1]
        return found

    def about(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """``(n, 3)`` rows of ``shapes`` about ``(n, 3)`` places in metres, and shares: linear on a face.

        Samples about a place would give it the shapes of one beside it, another one for every place, and
        near a rim those of a face that the hammer never meets; so it is nodes that are blended.
        """
        points = np.ascontiguousarray(points)
        nodes, shares = faces_about(points, self.nearest(points), self.near_faces, self.nodes, self.faces)
        return nodes + len(self.surface.points), shares


def gain_table(modes: Modes, surface: Surface) -> GainTable:
    """Tabulate the modes at a surface's samples and at their own nodes."""
    at_samples = modes.at(surface.points).astype(np.float32)
    along = np.einsum("smi,si->sm", at_samples, surface.normals.astype(np.float32))
    squares = np.asarray(np.mean(along**2, axis=0, dtype=np.float64))
    shapes = np.concatenate([at_samples, modes.shapes.astype(np.float32)])
    count = min(_CANDIDATES, len(modes.faces))
    middles = cKDTree(modes.points[modes.faces].mean(axis=1))
    near = np.asarray(middles.query(surface.points, k=count)[1], dtype=np.int32).reshape(-1, count)
    return GainTable(
        surface, read_only(shapes), read_only(squares), modes.points, modes.faces, read_only(near)
    )
