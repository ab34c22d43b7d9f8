"""The true object: the nominal one on another tessellation, scaled and slightly out of shape."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.mesh import Mesh

_WAVES = 128


@dataclass(frozen=True, eq=False)
class ShapeDeviation:
    """How a made object differs from its drawing.

    Each coordinate's deviation is a stationary Gaussian field with a squared-exponential
    covariance, sampled as random plane waves (Rahimi and Recht, Random Features for
    Large-Scale Kernel Machines, 2007), so that it does not depend on any tessellation.
    """

    scale: float  #: true size over nominal size.
    centre: FloatArray  #: ``(3,)`` metres, the point that scaling leaves in place.
    wave_vectors: FloatArray  #: ``(3, waves, 3)`` rad per metre, a set for each coordinate.
    phases: FloatArray  #: ``(3, waves)`` rad.
    amplitude: float  #: metres, of each wave.

    @classmethod
    def draw(
        cls, scale: float, centre: FloatArray, sigma: float, length: float, random: np.random.Generator
    ) -> "ShapeDeviation":
        """A deviation of ``sigma`` metres a coordinate, smooth over ``length`` metres."""
        waves = random.standard_normal((3, _WAVES, 3)) / length
        phases = random.uniform(0.0, 2.0 * np.pi, (3, _WAVES))
        return cls(scale, centre, waves, phases, sigma * np.sqrt(2.0 / _WAVES))

    def applied(self, points: FloatArray) -> FloatArray:
        """Where ``(n, 3)`` points of the nominal object are on the true one, in the object's frame."""
        moved = self.centre + self.scale * (points - self.centre)
        if self.amplitude == 0.0:
            return moved
        for axis in range(3):
            arguments = points @ self.wave_vectors[axis].T + self.phases[axis]
            moved[:, axis] += self.amplitude * np.cos(arguments).sum(axis=1)
        return moved


def split_long_edges(mesh: Mesh, longest: float) -> Mesh:
    """The same surface with no edge longer than ``longest`` metres.

    Every long edge is cut at its middle for both its faces, so that no crack opens when the
    vertices are moved afterwards.
    """
    vertices, faces = mesh.vertices, mesh.faces
    while True:
        edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
        lengths = np.linalg.norm(vertices[edges[..., 0]] - vertices[edges[..., 1]], axis=-1)
        long = lengths > longest
        if not long.any():
            return Mesh(vertices, faces)
        vertices, middles = _cut(vertices, edges, long)
        faces = _refined(faces, long, middles)


def _cut(vertices: FloatArray, edges: IntArray, long: BoolArray) -> tuple[FloatArray, IntArray]:
    """Vertices with the middles of long edges appended; ``(faces, 3)`` index of each edge's middle."""
    ends = np.sort(edges[long], axis=-1)
    unique, which = np.unique(ends, axis=0, return_inverse=True)
    middles = np.full(long.shape, -1, dtype=np.int64)
    middles[long] = len(vertices) + which.ravel()
    added = vertices[unique].mean(axis=1)
    return np.concatenate([vertices, added]), middles


def _refined(faces: IntArray, long: BoolArray, middles: IntArray) -> IntArray:
    """Faces cut along their long edges: into one, two, three or four."""
    count = long.sum(axis=1)
    # Turn each face so that its first edge is a long one, and a single short one comes last.
    first = np.where(count == 2, (np.argmin(long, axis=1) + 1) % 3, np.argmax(long, axis=1))
    order = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, order, axis=1).T
    ab, bc, ca = np.take_along_axis(middles, order, axis=1).T
    one, two, three = count == 1, count == 2, count == 3
    pieces = [
        faces[count == 0],
        _stacked(one, (a, ab, c), (ab, b, c)),
        _stacked(two, (a, ab, c), (ab, b, bc), (ab, bc, c)),
        _stacked(three, (a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)),
    ]
    return np.concatenate(pieces)


def _stacked(chosen: BoolArray, *triangles: tuple[IntArray, IntArray, IntArray]) -> IntArray:
    return np.concatenate([np.stack(corners, axis=1)[chosen] for corners in triangles])


def nearest_face(mesh: Mesh, point: FloatArray) -> tuple[int, FloatArray]:
    """The face nearest to a ``(3,)`` point, and the point of that face that is nearest.

    By arithmetic of its own: truth is not computed by the kernel that estimates are.
    """
    corners, normals = mesh.corners, mesh.face_normals
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    height = np.einsum("ij,ij->i", point - a, normals)
    foot = point - height[:, None] * normals
    turns = [np.cross(q - p, foot - p) for p, q in ((a, b), (b, c), (c, a))]
    inside = np.all([np.einsum("ij,ij->i", turn, normals) >= 0.0 for turn in turns], axis=0)
    inside &= mesh.face_areas > 0.0
    candidates = np.stack([foot, *(_on_segment(p, q, point) for p, q in ((a, b), (b, c), (c, a)))])
    distances = np.linalg.norm(candidates - point, axis=2)
    distances[0, ~inside] = np.inf
    kind, face = np.unravel_index(int(np.argmin(distances)), distances.shape)
    return int(face), candidates[kind, face]


def _on_segment(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    along = end - start
    squares = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", point - start, along) / np.where(squares > 0.0, squares, 1.0)
    nearest: FloatArray = start + np.minimum(np.maximum(share, 0.0), 1.0)[:, None] * along
    return nearest
