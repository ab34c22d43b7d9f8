"""Solids made of structured grids: blocks of hexahedra on shared nodes, each cut into six tetrahedra.

Every hexahedron is cut along the diagonal from its first corner to its last (Kuhn, Some combinatorial lemmas
in topology, IBM Journal 4(5), 1960), so that blocks which share nodes in the same order fit each other.
"""

from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.mesh import Mesh
from harness.sim.solid.modal_mesh import boundary_faces
from harness.sim.solid.tetrahedra import Tetrahedra, signed_volumes, tetrahedra

_FLAT = 1e-12
"""Volume, of an object one long, below which a cell is a face that a collapsed edge left over."""


@dataclass(frozen=True, eq=False)
class HouseholdSolid:
    """A body."""

    inside: Tetrahedra  #: its cells.

    @property
    def surface(self) -> Mesh:
        """Its outside, in the same nodes."""
        faces = boundary_faces(self.inside.cells)
        used, numbers = np.unique(faces, return_inverse=True)
        return Mesh(self.inside.nodes[used], numbers.reshape(-1, 3))

    def standing(self) -> "HouseholdSolid":
        """The same one long, the middle of its bounding box above the origin, its lowest point on z = 0."""
        nodes = self.inside.nodes
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        middle = np.array([*(0.5 * (low + high))[:2], low[2]])
        return HouseholdSolid(Tetrahedra(read_only((nodes - middle) / (high - low).max()), self.inside.cells))


@dataclass
class SolidGrid:
    """A solid under construction."""

    _nodes: list[FloatArray] = field(default_factory=list)
    _blocks: list[IntArray] = field(default_factory=list)
    _count: int = 0

    def add_nodes(self, places: FloatArray) -> IntArray:
        """Numbers, shaped as the ``(..., 3)`` places without their last axis."""
        rows = np.asarray(places, dtype=np.float64).reshape(-1, 3)
        self._nodes.append(rows)
        self._count += len(rows)
        return np.arange(self._count - len(rows), self._count).reshape(places.shape[:-1])

    def places(self, numbers: IntArray) -> FloatArray:
        """``(..., 3)`` of nodes by their numbers."""
        return np.asarray(np.concatenate(self._nodes)[numbers])

    def add_block(self, numbers: IntArray) -> None:
        """``(a, b, c)`` numbers of the nodes of a grid of hexahedra; equal numbers are a collapsed edge."""
        self._blocks.append(numbers)

    def solid(self) -> HouseholdSolid:
        """All blocks together."""
        nodes = np.concatenate(self._nodes)
        cells = np.concatenate([_split(block) for block in self._blocks])
        ordered = np.sort(cells, axis=1)
        cells = cells[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
        flat = np.abs(signed_volumes(nodes, cells)) <= _FLAT
        return HouseholdSolid(tetrahedra(nodes, cells[~flat]))


def _split(block: IntArray) -> IntArray:
    """``(n, 4)`` cells of a block of hexahedra, six each."""
    cells = []
    whole = np.array(block.shape) - 1
    for axes in permutations(range(3)):
        corner = np.zeros(3, dtype=np.int64)
        path = [corner.copy()]
        for axis in axes:
            corner[axis] += 1
            path.append(corner.copy())
        taken = [block[a : a + whole[0], b : b + whole[1], c : c + whole[2]].ravel() for a, b, c in path]
        cells.append(np.stack(taken, axis=1))
    return np.concatenate(cells)
