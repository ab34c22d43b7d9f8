"""How loudly each mode sounds from each place of an object, as a table that a search reads."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled, copy_line
from harness.basics.faces.nearest_kernels import nearest_on_triangle
from harness.basics.geometry import rotation_about
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface

_PAIR_POINTS = 500
"""Surface points on which two mode shapes are compared with their rotated copies."""

_PAIR_ANGLES = (0.13, 0.45, 0.9)
"""Rotations about the object's axis in rad, in no simple ratio to each other."""

_PAIR_COVERAGE = 0.7
"""Share of a rotated mode shape's square that the two shapes of a pair must span."""

_PAIR_EXCHANGE = 0.25
"""Share of a mode shape's square that some rotation must move into the other shape; less is no pair."""

_CANDIDATES = 16
"""Faces about a sample among which the one nearest to a place is looked for."""


@dataclass(frozen=True, eq=False)
class GainTable:
    """The modes at a surface's samples and at the nodes of their own mesh, made once an object."""

    surface: Surface  #: whose samples; gives the sample nearest to any place.
    shapes: AnyArray  #: ``(samples + nodes, m, 3)`` 1/sqrt(kg), float32.
    mean_squares: FloatArray  #: ``(m,)`` 1/kg: of each mode's gain along the normal, over the samples.
    nodes: FloatArray  #: ``(nodes, 3)`` metres.
    faces: IntArray  #: ``(f, 3)`` nodes of the mesh's surface.
    near_faces: AnyArray  #: ``(samples, k)`` faces about each sample.
    rotation_pairs: BoolArray
    """``(m - 1,)`` whether a mode and the next one are a pair that a rotation about the object's axis turns
    into each other (``find_rotation_pairs``)."""

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
        surface,
        read_only(shapes),
        read_only(squares),
        modes.points,
        modes.faces,
        read_only(near),
        read_only(find_rotation_pairs(modes, surface.points)),
    )


def find_rotation_pairs(modes: Modes, points: FloatArray) -> BoolArray:
    """Find neighbouring modes that are one pair of a round object: cos(n a) and sin(n a) about its axis.

    Small asymmetries, which a real object and its model do not share, decide where about the axis the nodal
    lines of such a pair lie, and split its frequencies.

    Args:
        modes: modes of the object, in ascending order of frequency.
        points: ``(n, 3)`` points of the surface in metres, evenly distributed.

    Returns:
        ``(m - 1,)`` for every mode but the last, whether it and the next one are such a pair.
    """
    count = len(modes.frequencies)
    if count < 2:
        return np.zeros(max(0, count - 1), np.bool_)
    spread = np.linspace(0, len(points) - 1, min(_PAIR_POINTS, len(points))).astype(np.int64)
    places, centre = points[spread], points.mean(axis=0)
    moments, axes = np.linalg.eigh(np.cov((points - centre).T))
    # The axis of a round object: the other two principal moments are the two nearest to each other.
    axis = axes[:, 2] if moments[1] - moments[0] < moments[2] - moments[1] else axes[:, 0]
    shapes = modes.at(places).transpose(1, 0, 2).reshape(count, -1)
    squares = (shapes**2).sum(axis=1)
    coverage, exchange = np.ones(count - 1), np.zeros(count - 1)
    overlap = (shapes[:-1] * shapes[1:]).sum(axis=1) / np.sqrt(squares[:-1] * squares[1:])
    for angle in _PAIR_ANGLES:
        turn = rotation_about(axis, angle)
        turned = modes.at((places - centre) @ turn.T + centre) @ turn
        turned = turned.transpose(1, 0, 2).reshape(count, -1)[:-1]
        lengths = np.sqrt((turned**2).sum(axis=1))
        own = (turned * shapes[:-1]).sum(axis=1) / (lengths * np.sqrt(squares[:-1]))
        other = (turned * shapes[1:]).sum(axis=1) / (lengths * np.sqrt(squares[1:]))
        across = (other - overlap * own) / np.sqrt(np.maximum(1.0 - overlap**2, 1e-6))
        coverage = np.minimum(coverage, own**2 + across**2)
        exchange = np.maximum(exchange, across**2)
    return np.asarray((coverage > _PAIR_COVERAGE) & (exchange > _PAIR_EXCHANGE))


_LITTLE = 1.0e-3
"""Share below which a place of the table adds nothing."""


@compiled
def nearest_in_table(points: FloatArray, nearest: AnyArray, origin: FloatArray, pitch: float) -> IntArray:
    """``(n,)`` sample of the voxel that each of ``(n, 3)`` points lies in; -1 where the table ends."""
    found = np.full(len(points), -1, np.int64)
    for i in range(len(points)):
        a = int(np.floor((points[i, 0] - origin[0]) / pitch))
        b = int(np.floor((points[i, 1] - origin[1]) / pitch))
        c = int(np.floor((points[i, 2] - origin[2]) / pitch))
        if 0 <= a < nearest.shape[0] and 0 <= b < nearest.shape[1] and 0 <= c < nearest.shape[2]:
            found[i] = nearest[a, b, c]
    return found


@compiled
def faces_about(
    points: FloatArray, nearest: IntArray, near_faces: AnyArray, corners: FloatArray, faces: AnyArray
) -> tuple[IntArray, FloatArray]:
    """The corners of the face that each place is nearest to, and their shares in the nearest place of it.

    Args:
        points: ``(n, 3)`` metres.
        nearest: ``(n,)`` the sample nearest to each.
        near_faces: ``(samples, k)`` faces about each sample.
        corners: ``(nodes, 3)`` metres.
        faces: ``(f, 3)`` nodes.

    Returns:
        ``(n, 3)`` nodes and ``(n, 3)`` shares from 0 to 1 that sum to 1.
    """
    nodes, shares = np.empty((len(points), 3), np.int64), np.empty((len(points), 3))
    triangle, here, foot = np.empty((3, 3)), np.empty(3), np.empty(3)
    for i in range(len(points)):
        best, face = np.inf, 0
        for j in range(near_faces.shape[1]):
            other = near_faces[nearest[i], j]
            for corner in range(3):
                copy_line(triangle[corner], corners[faces[other, corner]])
            gap = nearest_on_triangle(points[i], triangle, here)
            if gap < best:
                best, face = gap, other
                copy_line(foot, here)
        for corner in range(3):
            nodes[i, corner] = faces[face, corner]
            copy_line(triangle[corner], corners[faces[face, corner]])
        _put_shares(foot, triangle, shares[i])
    return nodes, shares


@compiled
def _put_shares(foot: FloatArray, triangle: FloatArray, shares: FloatArray) -> None:
    """Write the shares of a triangle's corners in a place of it; of one without area its first corner's."""
    aa, ab, bb, pa, pb = 0.0, 0.0, 0.0, 0.0, 0.0
    for d in range(3):
        a, b = triangle[1, d] - triangle[0, d], triangle[2, d] - triangle[0, d]
        p = foot[d] - triangle[0, d]
        aa += a * a
        ab += a * b
        bb += b * b
        pa += p * a
        pb += p * b
    det = aa * bb - ab * ab
    if det > 0.0:
        shares[1] = min(max((bb * pa - ab * pb) / det, 0.0), 1.0)
        shares[2] = min(max((aa * pb - ab * pa) / det, 0.0), 1.0 - shares[1])
    else:
        shares[1] = shares[2] = 0.0
    shares[0] = 1.0 - shares[1] - shares[2]


@compiled
def put_gains(
    gains: AnyArray,
    shapes: AnyArray,
    first: IntArray,
    last: IntArray,
    samples: IntArray,
    blend: FloatArray,
    directions: FloatArray,
    blended: FloatArray,
) -> None:
    """Set ``(m, K)`` gains, 1/sqrt(kg): how strongly strikes of one hypothesis move the modes asked for.

    Args:
        gains: written where a mode is asked for.
        shapes: ``(n, 3 m)`` modes at the table's places: a mode's three axes side by side.
        first: ``(R,)`` first mode of each run of modes that are asked for.
        last: ``(R,)`` mode behind the run's last.
        samples: ``(K, J)`` places of the table about the one that each strike hit.
        blend: ``(K, J)`` their shares in it.
        directions: ``(K, 3)`` unit, of the strikes.
        blended: ``(3 m,)``, written.
    """
    strikes, about = samples.shape
    for k in range(strikes):
        for r in range(len(first)):
            blended[3 * first[r] : 3 * last[r]] = 0.0
        for j in range(about):
            share = blend[k, j]
            if abs(share) > _LITTLE:
                row = shapes[samples[k, j]]
                for r in range(len(first)):
                    for i in range(3 * first[r], 3 * last[r]):
                        blended[i] += share * row[i]
        x, y, z = directions[k, 0], directions[k, 1], directions[k, 2]
        for r in range(len(first)):
            for m in range(first[r], last[r]):
                gains[m, k] = blended[3 * m] * x + blended[3 * m + 1] * y + blended[3 * m + 2] * z
