"""Rotations that leave an object as it was: touches that they map onto each other feel the same."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh

_FOLDS = (12, 10, 9, 8, 7, 6, 5, 4, 3, 2)
# No two of them, nor a turn, stand in a small whole ratio: a gear does not pass for a disc.
_ANGLES = (0.307, 0.763, 1.291, 1.877, 2.641)
_HALF_TURN = np.pi
_DENSE, _ASKED, _FIRST_ASKED = 40_000, 1500, 150
_ABSOLUTE_TOLERANCE, _RELATIVE_TOLERANCE = 0.5e-3, 0.005


@dataclass(frozen=True, eq=False)
class SymmetryGroup:
    """Rotations about one axis, and half turns across it."""

    centre: FloatArray  #: ``(3,)`` metres, a point of the axis; half turns across pass through it.
    axis: FloatArray  #: ``(3,)`` unit vector.
    fold: int  #: how many steps make a turn; 1 for no symmetry about the axis, 0 for any angle.
    flip: FloatArray | None
    """``(3,)`` unit vector across the axis, about which a half turn is a symmetry; or None."""
    rms: float  #: metres, how far the worst of these rotations moves the surface off itself.
    tolerance: float  #: metres, the most that was allowed.

    @property
    def name(self) -> str:
        """In words, for the report."""
        turns = {0: "any rotation about an axis", 1: "no rotation"}
        said = turns.get(self.fold, f"{self.fold}-fold rotation about an axis")
        return said if self.flip is None else f"{said}, and a half turn across it"

    def distance(self, a: FloatArray, b: FloatArray) -> float:
        """Metres between ``(3,)`` points of the object, the least over all rotations of one of them."""
        return float(self.distances(a[None, :], b)[0])

    def distances(self, points: FloatArray, b: FloatArray) -> FloatArray:
        """``(n,)`` metres from each of ``(n, 3)`` points to ``b``, modulo the group."""
        best = self._about_axis(points, b)
        if self.flip is not None:
            best = np.minimum(best, self._about_axis(self._turned(points, self.flip, _HALF_TURN), b))
        return best

    def images(self, point: FloatArray, steps: int = 72) -> FloatArray:
        """``(k, 3)`` points that feel like ``(3,)`` ``point``; a full circle is given as ``steps``."""
        fold = steps if self.fold == 0 else self.fold
        flips = [point] if self.flip is None else [point, self._turned(point[None], self.flip, _HALF_TURN)[0]]
        return np.array(
            [self._turned(p[None], self.axis, 2.0 * np.pi * k / fold)[0] for p in flips for k in range(fold)]
        )

    def _about_axis(self, points: FloatArray, b: FloatArray) -> FloatArray:
        if self.fold == 0:
            (r, z), (r_b, z_b) = self._cylindrical(points), self._cylindrical(b[None, :])
            return np.hypot(r - r_b, z - z_b)
        turned = [self._turned(points, self.axis, 2.0 * np.pi * k / self.fold) for k in range(self.fold)]
        nearest: FloatArray = np.linalg.norm(np.array(turned) - b, axis=2).min(axis=0)
        return nearest

    def _cylindrical(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        height = (points - self.centre) @ self.axis
        return np.linalg.norm(points - self.centre - height[:, None] * self.axis, axis=1), height

    def _turned(self, points: FloatArray, axis: FloatArray, angle: float) -> FloatArray:
        turned: FloatArray = (points - self.centre) @ rotation_about(axis, angle).T + self.centre
        return turned


def find_symmetries(mesh: Mesh, seed: int = 0) -> SymmetryGroup:
    """The rotations that move a surface onto itself.

    Axes tried are the principal axes of the surface and the coordinate axes, through the
    surface's centroid. A rotation counts if the surface lies within 0.5 mm, or 0.5 % of its
    longest side if that is more, of its rotated self (root mean square over the area).

    Args:
        mesh: in metres.
        seed: of the places compared.

    Returns:
        The group with the most rotations; ``fold`` 1 and no flip if there are none.
    """
    axes: list[FloatArray] = []
    for axis in [*np.linalg.eigh(_moments(mesh)[1])[1].T, *np.eye(3)[::-1]]:
        if all(abs(float(axis @ seen)) < np.cos(np.radians(0.2)) for seen in axes):
            axes.append(np.ascontiguousarray(axis))
    tester = _Tester(mesh, seed)
    best: tuple[int, float, SymmetryGroup] | None = None
    for axis in axes:
        group = tester.group_about(axis)
        order = (1000 if group.fold == 0 else group.fold) * (1 if group.flip is None else 2)
        # Of two equal groups the earlier axis stays: principal axes come before the frame's.
        if best is None or order > best[0]:
            best = (order, group.rms, group)
    assert best is not None
    return best[2]


class _Tester:
    """A surface, and how far a rotation moves it off itself."""

    def __init__(self, mesh: Mesh, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.centre = _moments(mesh)[0]
        self.tolerance = max(
            _ABSOLUTE_TOLERANCE, _RELATIVE_TOLERANCE * float(np.ptp(mesh.bounds, axis=0).max())
        )
        places, self._normals = _drawn(mesh, _DENSE, rng)
        self._tree = cKDTree(places)
        self._pitch = float(np.sqrt(mesh.face_areas.sum() / _DENSE))
        self._asked = _drawn(mesh, _ASKED, rng)[0]

    def group_about(self, axis: FloatArray) -> SymmetryGroup:
        """The rotations about one axis and the half turns across it."""
        fold, rms = self._fold(axis)
        flip, flip_rms = self._flip(axis, fold)
        return SymmetryGroup(
            read_only(self.centre), read_only(axis), fold, flip, max(rms, flip_rms), self.tolerance
        )

    def _fold(self, axis: FloatArray) -> tuple[int, float]:
        worst = 0.0
        for angle in _ANGLES:
            rms = self._off(axis, angle)
            worst = max(worst, rms)
            if rms > self.tolerance:
                break
        else:
            return 0, worst
        for fold in _FOLDS:
            rms = self._off(axis, 2.0 * np.pi / fold)
            if rms <= self.tolerance:
                return fold, rms
        return 1, 0.0

    def _flip(self, axis: FloatArray, fold: int) -> tuple[FloatArray | None, float]:
        """A half turn across the axis: any one serves a continuous group."""
        for across in _across(axis, fold, self._asked - self.centre):
            rms = self._off(across, _HALF_TURN)
            if rms <= self.tolerance:
                return read_only(across), rms
        return None, 0.0

    def _off(self, axis: FloatArray, angle: float) -> float:
        """Root mean square distance in metres; of a few places only, if those already say no."""
        turned = (self._asked - self.centre) @ rotation_about(axis, angle).T + self.centre
        few = self._rms(turned[:_FIRST_ASKED])
        return few if few > 3.0 * self.tolerance else self._rms(turned)

    def _rms(self, points: FloatArray) -> float:
        distance, index = self._tree.query(points)
        nearest = np.asarray(self._tree.data)[index]
        off_plane = np.abs(np.einsum("ij,ij->i", points - nearest, self._normals[index]))
        # Beside the surface the plane of the nearest place says nothing: there the distance counts.
        off = np.where(distance < 3.0 * self._pitch, off_plane, distance)
        return float(np.sqrt(np.mean(off**2)))


def _moments(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Centroid ``(3,)`` and covariance ``(3, 3)`` of a surface, exact for its triangles."""
    weight = mesh.face_areas / mesh.face_areas.sum()
    centre = weight @ mesh.corners.mean(axis=1)
    local = mesh.corners - centre
    total = local.sum(axis=1)
    own = np.einsum("m,mki,mkj->ij", weight, local, local)
    return centre, (own + np.einsum("m,mi,mj->ij", weight, total, total)) / 12.0


def _across(axis: FloatArray, fold: int, places: FloatArray) -> list[FloatArray]:
    """Directions across an axis about which a half turn may be a symmetry."""
    flat = places - np.outer(places @ axis, axis)
    first = np.linalg.eigh(flat.T @ flat)[1][:, 2]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    if fold == 0:
        return [first]
    frame = [e - (e @ axis) * axis for e in np.eye(3)]
    frame = [e / np.linalg.norm(e) for e in frame if np.linalg.norm(e) > 0.5]
    steps = (0.0, 0.5 * np.pi) if fold < 3 else (0.0, np.pi / fold)
    return [rotation_about(axis, step) @ start for start in [first, *frame] for step in steps]


def _drawn(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Places uniform over the surface and its normals there, both ``(count, 3)``."""
    weight = mesh.face_areas / mesh.face_areas.sum()
    faces = rng.choice(len(weight), count, p=weight)
    share = rng.dirichlet(np.ones(3), count)
    return np.einsum("nk,nki->ni", share, mesh.corners[faces]), mesh.face_normals[faces]
