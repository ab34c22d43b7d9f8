"""Extract one connected body from a signed distance on a grid of cubic cells."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree
from skimage.graph import MCP_Geometric
from skimage.measure import marching_cubes

from experiments.shape_reconstruction import thresholds as limits
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh

_NUDGE = 1e-3
"""Smallest distance of a corner from the surface as a fraction of a cell: no face has zero area."""

_UNEVEN = 1e-4
"""Perturbation of the corners as a fraction of a cell: a saddle between equal corners is ambiguous."""


MOST_CORNERS = 200_000
"""Most corners of a grid: above it the cells are larger."""

BAND = 3.0
"""Pitches from zero, within which every corner is asked."""


@dataclass(frozen=True, eq=False)
class BodySurface:
    """A closed surface of one piece."""

    mesh: Mesh  #: the surface, m.
    notes: tuple[str, ...]
    """what was joined or removed, in short sentences; none where the field held one body."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Corners of cubic cells."""

    origin: FloatArray  #: ``(3,)`` m in ``stand``, of the first corner.
    pitch: float  #: m between corners.
    shape: tuple[int, int, int]  #: corners along x, y, z.

    @classmethod
    def over(cls, low: FloatArray, high: FloatArray, pitch: float) -> "Grid":
        """The grid from one corner of a box to the other, coarser where ``MOST_CORNERS`` demand it."""
        sides = np.maximum(high - low, pitch)
        pitch = max(pitch, float((sides.prod() / MOST_CORNERS) ** (1.0 / 3.0)))
        count = np.ceil(sides / pitch).astype(int) + 1
        middle = 0.5 * (low + high)
        origin = middle - 0.5 * pitch * (count - 1)
        origin[2] = low[2]  # the support is a plane of corners
        return cls(origin, pitch, (int(count[0]), int(count[1]), int(count[2])))

    @property
    def points(self) -> FloatArray:
        """``(n, 3)`` m, all corners, the last axis fastest."""
        axes = [self.origin[axis] + self.pitch * np.arange(self.shape[axis]) for axis in range(3)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def near_zero(self, field: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """``(n,)`` m of a field that grows by about a metre a metre: exact near zero, else between corners.

        Every second corner is asked, and the others where the field may be zero nearby.

        Args:
            field: m at ``(n, 3)`` m.
        """
        half = tuple((count + 2) // 2 for count in self.shape)
        coarse = Grid(self.origin, 2.0 * self.pitch, (half[0], half[1], half[2]))
        known = field(coarse.points).reshape(half)
        at = np.indices(self.shape).reshape(3, -1) / 2.0
        values = np.asarray(ndimage.map_coordinates(known, at, order=1, mode="nearest"))
        band = np.abs(values) < BAND * self.pitch
        values[band] = field(self.points[band])
        return values

    def surface(self, field: FloatArray, contacts: FloatArray | None = None) -> BodySurface:
        """Extract the closed surface of the one body where a field is below zero.

        Args:
            field: ``(n,)`` signed distance at the corners, m.
            contacts: ``(n, 3)`` points of the surface that were touched, m; they decide which piece is the
                body.

        Raises:
            OutOfDomain: as ``isosurface``.
        """
        return extract_body(field.reshape(self.shape), self.origin, self.pitch, contacts)


INSIDE = 2.0e-3
"""Cells below zero from which a corner is inside: twice the clearance of the surface extraction."""

_BRIDGE = 0.4
"""Cells that the corners of a bridge are inside."""

_STEP = 0.05
"""Cost of a step through the body itself, relative to one cell of distance outside it."""


def extract_body(
    field: FloatArray, origin: FloatArray, pitch: float, contacts: FloatArray | None = None
) -> BodySurface:
    """Extract the zero surface of a field as one body without cavities.

    The main piece is the one that most contacts lie on, or the largest where none do. Pieces that carry
    contacts or are large are joined to it along the path on which the field is lowest; the others are
    removed.

    Args:
        field: ``(a, b, c)`` signed distance at the corners of a grid, m; negative inside.
        origin: ``(3,)`` position of the first corner, m.
        pitch: distance between corners, m.
        contacts: ``(n, 3)`` points of the surface that were touched, m; None without any.

    Raises:
        OutOfDomain: as ``isosurface``.
    """
    inside = field < -INSIDE * pitch
    found, count = ndimage.label(inside)
    labels: IntArray = found.astype(np.int64)
    notes: tuple[str, ...] = ()
    if count > 1:
        on_piece = np.zeros(count + 1, np.int64)  # contact points that lie on each piece, by its label
        if contacts is not None and len(contacts):
            corners = np.argwhere(labels > 0)
            scaled = (contacts - origin) / pitch
            apart, nearest = cKDTree(corners).query(scaled, distance_upper_bound=limits.MAX_PIECE_DISTANCE)
            near = np.asarray(nearest)[np.isfinite(apart)]
            np.add.at(on_piece, labels[tuple(corners[near].T)], 1)
        field, notes = _join(field, pitch, labels, on_piece)
        inside = field < -INSIDE * pitch
    filled = ndimage.binary_fill_holes(np.pad(inside, 1, constant_values=False))[1:-1, 1:-1, 1:-1]
    cavity = filled & ~inside
    if cavity.any():
        field = np.where(cavity, -_BRIDGE * pitch, field)
    # Corners too near to zero to be counted as inside must not become pieces of their own.
    field = np.where(inside | cavity, field, np.maximum(field, INSIDE * pitch))
    return BodySurface(isosurface(field, origin, pitch), notes)


def _join(
    field: FloatArray, pitch: float, labels: IntArray, on_piece: IntArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """The field with its pieces joined or removed, and the sentence that reports it."""
    volumes = np.bincount(labels.ravel())
    volumes[0] = 0
    main = int(np.lexsort((volumes, on_piece))[-1])
    wanted = (on_piece > 0) | (volumes >= limits.MIN_PIECE_VOLUME * volumes[main])
    wanted[[0, main]] = False
    removed = ~wanted
    removed[[0, main]] = False
    field = np.where(removed[labels], np.maximum(np.abs(field), pitch), field)
    body = labels == main
    for piece in np.flatnonzero(wanted):
        # A bar three cells thick, where the field is lowest between the two pieces.
        costs = MCP_Geometric(_STEP + np.maximum(field / pitch, 0.0))
        ends = np.argwhere(labels == piece)
        total, _ = costs.find_costs(np.argwhere(body), ends, find_all_ends=False)
        end = ends[int(np.argmin(total[tuple(ends.T)]))]
        path = np.zeros(field.shape, bool)
        path[tuple(np.array(costs.traceback(tuple(int(k) for k in end))).T)] = True
        bridge = np.asarray(ndimage.binary_dilation(path, np.ones((3, 3, 3), bool)))
        field = np.where(bridge, np.minimum(field, -_BRIDGE * pitch), field)
        body = body | bridge | (labels == piece)
    joined, gone = int(wanted.sum()), int(removed.sum())
    note = f"the surface was in {joined + gone + 1} pieces: {joined} joined to the main one, {gone} removed"
    return field, (note,)


def isosurface(field: FloatArray, origin: FloatArray, pitch: float) -> Mesh:
    """The surface around all that is below zero, closed at the border of the grid.

    Marching cubes that never leave a hole (Lewiner et al., Journal of Graphics Tools 8(2), 2003).

    Args:
        field: ``(a, b, c)`` at the corners of cells, m; below zero is inside.
        origin: ``(3,)`` m, of the first corner.
        pitch: m between corners, greater than zero.

    Returns:
        Watertight and outward; it leaves the grid by at most a cell where the inside reaches its border.

    Raises:
        OutOfDomain: a field that is empty, not finite, or is nowhere below zero.
    """
    if (
        field.ndim != 3
        or field.size == 0
        or not np.isfinite(field).all()
        or not (np.isfinite(pitch) and pitch > 0.0)
    ):
        raise OutOfDomain(
            f"a field of shape {field.shape} with {np.count_nonzero(~np.isfinite(field))} numbers not "
            f"finite, at a pitch of {pitch:g} m, has no surface; give three axes and a larger pitch"
        )
    if not (field < 0.0).any():
        raise OutOfDomain(
            f"no corner of a grid of {field.shape} corners is inside (the least value is {field.min():.3g} "
            "m); use a finer grid, or check that readings bound a body"
        )
    cells = np.pad(np.asarray(field, np.float64) / pitch, 1, constant_values=1.0)
    cells = np.where(np.abs(cells) < _NUDGE, _NUDGE, cells)
    cells += _UNEVEN * np.random.default_rng(0).uniform(-1.0, 1.0, cells.shape)
    places, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        cells, 0.0, gradient_direction="descent"
    )
    vertices = np.asarray(origin) + (places.astype(np.float64) - 1.0) * pitch
    return Mesh(vertices, faces.astype(np.int64))
