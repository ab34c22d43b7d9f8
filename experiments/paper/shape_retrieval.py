"""Retrieval: the known mesh that fits the contacts best at its size, yaw and position, bent to them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial import ConvexHull, cKDTree
from scipy.spatial.distance import cdist

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.smooth.free_space import (
    ContactSamples,
    Silhouette,
    all_samples,
    beyond_deviation,
    known_by,
    limited_sides,
    not_bounded,
    sensor_depth,
    silhouette_of,
    thinned,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objects.builtin import DESCRIPTION
from harness.sim.solid.household.families import FAMILIES, draw
from harness.sim.solid.intake import take_in
from harness.sim.solid.mesh_read import read_mesh
from harness.sim.solid.mesh_repair import is_watertight
from harness.sim.solid.surface_samples import random_points

SAMPLES = 3000
"""Points sampled on each shape for the rough fit."""

SUFFIXES = (".ply", ".obj", ".stl", ".off", ".glb", ".gltf", ".3mf", ".msh")
"""File name extensions of meshes that a library folder may hold."""


@dataclass(frozen=True, eq=False)
class LibraryShape:
    """A mesh scaled to length 1: upright, centred above the origin, its lowest point at z = 0."""

    name: str  #: name of its file or folder, or of its family with a number.
    mesh: Mesh  #: watertight.

    @cached_property
    def samples(self) -> tuple[cKDTree, FloatArray, FloatArray]:
        """Surface samples as a tree and as ``(SAMPLES, 3)`` points, and their normals."""
        points, faces = random_points(self.mesh, SAMPLES, np.random.default_rng(0))
        return cKDTree(points), points, self.mesh.face_normals[faces]

    @cached_property
    def outside(self) -> float:
        """Area of the convex hull over the squared longest side: about the area that presses can reach."""
        return float(ConvexHull(self.mesh.vertices).area)

    @cached_property
    def search(self) -> NearestSurface:
        """Index of exact nearest points."""
        return NearestSurface(self.mesh)

    @classmethod
    def of(cls, name: str, mesh: Mesh) -> "LibraryShape":
        """Create the library shape of a watertight mesh whose z axis is up.

        Raises:
            MeshRefused: the mesh is open, so it bounds no body.
        """
        if not is_watertight(mesh.faces):
            raise MeshRefused(f"{name} is not closed; repair it, or leave it out of the library")
        low, high = mesh.bounds
        middle = np.array([*(0.5 * (low + high))[:2], low[2]])
        return cls(name, Mesh((mesh.vertices - middle) / float((high - low).max()), mesh.faces))


def library_of(folder: Path) -> tuple[list[LibraryShape], list[str]]:
    """Read the shapes of a folder in the order of their names, and the reasons why others were left out.

    Raises:
        WrongUse: there is no such folder, or it holds no shape that can be used.
    """
    if not folder.is_dir():
        raise WrongUse(f"there is no folder {folder}; name one that holds meshes or ObjectFiles")
    shapes, left_out = [], []
    for path in sorted(folder.iterdir()):
        try:
            mesh = _mesh_in(path)
            if mesh is not None:
                shapes.append(LibraryShape.of(path.name, mesh))
        except MeshRefused as refused:
            left_out.append(str(refused))
    if not shapes:
        raise WrongUse(
            f"{folder} holds no closed mesh that can be read ({len(left_out)} were left out: "
            f"{'; '.join(left_out[:3]) or 'none'}); put meshes ({', '.join(SUFFIXES)}) or ObjectFiles there"
        )
    return shapes, left_out


def _mesh_in(path: Path) -> Mesh | None:
    if (path / DESCRIPTION).is_file():
        return ObjectFile.open(path).mesh
    if path.suffix.lower() not in SUFFIXES:
        return None
    raw = read_mesh(path)
    if not np.isfinite(raw.vertices).all():
        raise MeshRefused(f"{path.name} has vertices that are not finite numbers; export it again")
    longest = float(np.ptp(raw.vertices, axis=0).max())
    if not longest > 0.0:
        raise MeshRefused(f"{path.name} has all its vertices in one place; export it again")
    return take_in(path, "m", 1.0 / longest).mesh  # 1 m long in any unit: the readings determine the size


EACH = 4
"""Shapes of each family in the household library."""

_SEED = 30_000


@cache
def household_library() -> tuple[LibraryShape, ...]:
    """Draw ``EACH`` shapes of every family, none of them a test object: ``"cup 1"``, ``"cup 2"``, ..."""
    random = np.random.default_rng(_SEED)
    return tuple(
        LibraryShape.of(f"{name} {number}", draw(name, random).surface)
        for name in FAMILIES
        for number in range(1, EACH + 1)
    )


YAWS = 16
"""Yaw angles that the fit starts from."""

SIZES = (0.7, 0.85, 1.0, 1.2, 1.45, 1.8)
"""Longest sides that the fit starts from, relative to the longest side of the contacts' bounding box."""

REFINED = 3
"""Starts of each shape that are refined, the best ones."""

ROUNDS = 20
"""Fits of size, yaw and position to the nearest points, for each start."""

COARSE = 4.0
"""Width of the loss in the first round, relative to ``SCALE``."""

SCALE = 2.0e-3
"""Contact distance above which the loss saturates, m."""

NORMAL = 0.35
"""Standard deviation of the surface normal at a contact between shapes of one family, rad."""

_RANKED_CONTACTS = 60
_COST_SAMPLES = 600
_FREE = 3.0e-3
_PIXELS = 2.0
_LEAST, _MOST = 0.02, 1.0


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A library shape at a pose in the frame ``stand``."""

    shape: LibraryShape  #: the shape.
    size: float  #: longest side, m.
    yaw: float  #: rotation about z, rad.
    place: FloatArray  #: ``(2,)`` position on the support, m.
    cost: float
    """misfit of contacts, normals, free space, silhouette and area; less is better; may be negative."""

    @property
    def mesh(self) -> Mesh:
        """Its surface in ``stand``, m."""
        return Mesh(self.outward(self.shape.mesh.vertices), self.shape.mesh.faces)

    def outward(self, points: FloatArray) -> FloatArray:
        """Transform ``(n, 3)`` points of the library shape to ``stand``, m."""
        return np.asarray(self.size * points @ self.turn.T + np.append(self.place, 0.0))

    def inward(self, points: FloatArray) -> FloatArray:
        """Transform ``(n, 3)`` points in ``stand`` to the frame of the library shape."""
        return np.asarray((points - np.append(self.place, 0.0)) @ self.turn / self.size)

    @property
    def turn(self) -> FloatArray:
        """Rotation ``(3, 3)`` from the library shape to ``stand``."""
        return rotation_about(np.array([0.0, 0.0, 1.0]), self.yaw)


def fit_pose(
    shape: LibraryShape, samples: ContactSamples, evidence: ShapeEvidence, silhouette: Silhouette | None
) -> PlacedShape:
    """Fit the size, yaw and position of a shape to one or more contacts, free space and silhouette."""
    few = samples.points[np.random.default_rng(0).permutation(len(samples.points))[:_RANKED_CONTACTS]]
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    reach = max(float(np.max([*(high - low)[:2], high[2]])), _LEAST)
    middle = 0.5 * (low + high)[:2]
    yaws = np.arange(YAWS) * 2.0 * np.pi / YAWS
    starts = [PlacedShape(shape, size * reach, float(yaw), middle, np.inf) for size in SIZES for yaw in yaws]

    def distance_cost(at: PlacedShape) -> float:
        apart = at.size * np.asarray(at.shape.samples[0].query(at.inward(few))[0])
        return float(np.log1p((apart / SCALE) ** 2).mean())

    starts.sort(key=distance_cost)
    refined = [_refine(start, samples) for start in starts[:REFINED]]
    return min((_with_cost(one, samples, evidence, silhouette) for one in refined), key=lambda one: one.cost)


def _refine(at: PlacedShape, samples: ContactSamples) -> PlacedShape:
    """Alternate between nearest points and a weighted least-squares step of size, yaw and position.

    The weights are those of a Cauchy loss, so that parts which the shape lacks do not pull it. The loss is
    wide at first, so that a distant start is not held by the few contacts that it happens to touch.
    """
    tree, places, facing = at.shape.samples
    for loss in SCALE * np.geomspace(COARSE, 1.0, ROUNDS):
        nearest = np.asarray(tree.query(at.inward(samples.points))[1])
        normals, moved = facing[nearest] @ at.turn.T, at.outward(places[nearest])
        along = np.einsum("ij,ij->i", samples.points - moved, normals)
        weight = 1.0 / (1.0 + (along / loss) ** 2)
        arm = moved - np.append(at.place, 0.0)
        swept = np.column_stack([-arm[:, 1], arm[:, 0], np.zeros(len(arm))])
        terms = np.column_stack(
            [np.einsum("ij,ij->i", arm, normals), np.einsum("ij,ij->i", swept, normals), normals[:, :2]]
        )
        weighted = (terms * weight[:, None]).T
        # A weak prior holds what the contacts do not determine, such as the yaw of a round body.
        damping = np.diag([1e-4, 1e-5, 1e-2, 1e-2]) * float(weight.sum())
        step = np.linalg.solve(weighted @ terms + damping, weighted @ along)
        size = float(np.clip(at.size * np.exp(np.clip(step[0], -0.2, 0.2)), _LEAST, _MOST))
        yaw = at.yaw + float(np.clip(step[1], -0.2, 0.2))
        at = PlacedShape(at.shape, size, yaw, at.place + np.clip(step[2:], -0.02, 0.02), np.inf)
    return at


def _with_cost(
    at: PlacedShape,
    samples: ContactSamples,
    evidence: ShapeEvidence,
    silhouette: Silhouette | None,
) -> PlacedShape:
    places, faces = at.shape.search.places(at.inward(samples.points))
    apart = np.linalg.norm(samples.points - at.outward(places), axis=1)
    cosine = np.einsum("ij,ij->i", samples.normals, at.shape.mesh.face_normals[faces] @ at.turn.T)
    angle = np.arccos(np.clip(cosine, -1.0, 1.0))
    cost = float(np.log1p((apart / SCALE) ** 2).mean() + np.log1p((angle / NORMAL) ** 2).mean())
    own = at.outward(at.shape.samples[1][:_COST_SAMPLES])
    # One term for each touch, so that one that is impossible there is not outweighed by the area.
    depths = [sensor_depth(replace(evidence, touches=(one,)), own).max() for one in evidence.distinct]
    cost += float(np.log1p((np.maximum(depths, 0.0) / _FREE) ** 2).mean())
    if silhouette is not None:
        # Surface points outside the silhouette, and its pixels without points.
        outside = float(np.log1p((np.maximum(silhouette.outside_pixels(own), 0.0) / _PIXELS) ** 2).mean())
        rows, columns = np.nonzero(silhouette.look.mask)
        some = np.random.default_rng(0).permutation(len(rows))[:_COST_SAMPLES]
        pixels = np.column_stack([columns[some] + 0.5, rows[some] + 0.5])
        gaps = cKDTree(silhouette.pixels(own)[0]).query(pixels)[0]
        # Samples of a surface leave gaps of a few pixels in its picture.
        gap = np.sqrt(len(rows) / _COST_SAMPLES) + _PIXELS
        cost += outside + float(np.log1p((np.maximum(gaps - gap, 0.0) / _PIXELS) ** 2).mean())
    # Presses reach the outside evenly: the density of each is the inverse of its area.
    cost += float(np.log(at.shape.outside * at.size**2 / evidence.largest**2))
    beyond = max(at.size / evidence.largest - 1.0, 0.0)
    return PlacedShape(at.shape, at.size, at.yaw, at.place, cost + 10.0 * beyond)


KEPT = 5
"""Best shapes, whose spread is the stated deviation."""

ALONG = 15.0e-3
"""Correlation length of the difference between the object and the known shape, m."""

DIFFERS = 3.0e-3
"""Standard deviation of that difference, m."""

FARTHEST = 10.0e-3
"""Distance of a contact above which the shape is not bent to it, m."""

TEMPER = 0.3
"""Increase of the cost that reduces the weight of a shape by a factor e."""

READING = 0.7e-3
"""Standard deviation of a contact, m."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RetrievedShape(ShapeEstimate):
    """The shape of a library that fits best, bent to the contacts."""

    ranked: tuple[PlacedShape, ...]  #: the shapes that fit best, in the order of their cost.


def by_retrieval(evidence: ShapeEvidence, library: Sequence[LibraryShape]) -> RetrievedShape:
    """Choose the shape of a library that fits best, and bend it to the contacts.

    Raises:
        FitRefused: no touch met the object.
    """
    start = time.perf_counter()
    samples = thinned(all_samples(evidence))
    silhouette = silhouette_of(evidence, samples.points)
    ranked = sorted(
        (fit_pose(shape, samples, evidence, silhouette) for shape in library), key=lambda one: one.cost
    )[:KEPT]
    mesh = ranked[0].mesh
    # Move it by a Gaussian process through its distances to the contacts; never below the support.
    places, _ = NearestSurface(mesh).places(samples.points)
    off = samples.points - places
    near = np.linalg.norm(off, axis=1) < FARTHEST
    if near.any():
        places, off, sigmas = places[near], off[near], samples.sigmas[near]
        total = _covariance(places, places) + np.diag((sigmas / DIFFERS) ** 2)
        forces = cho_solve(cho_factor(total, lower=True), off)
        vertices = mesh.vertices + _covariance(mesh.vertices, places) @ forces
        vertices[:, 2] = np.maximum(vertices[:, 2], np.minimum(mesh.vertices[:, 2], 0.0))
        mesh = Mesh(vertices, mesh.faces)
    known = known_by(mesh, samples, silhouette)
    sides = limited_sides(mesh, samples, silhouette)
    # The root mean square distance to the other shapes, weighted by their fit.
    weights = np.exp(-(np.array([one.cost for one in ranked]) - ranked[0].cost) / TEMPER)
    squares = np.zeros(len(mesh.vertices))
    for weight, one in zip(weights, ranked, strict=True):
        squares += weight * NearestSurface(one.mesh).distances(mesh.vertices) ** 2
    deviation = np.sqrt(squares / weights.sum()) ** 2 + READING**2
    deviation += beyond_deviation(mesh, known, sides, evidence.largest) ** 2
    return RetrievedShape(
        mesh=mesh,
        deviation=np.sqrt(deviation),
        known_by=known,
        not_bounded=not_bounded(sides),
        doubtful={},
        flags=(),
        seconds=time.perf_counter() - start,
        estimator="retrieval",
        ranked=tuple(ranked),
    )


def _covariance(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.exp(-0.5 * cdist(one, other, "sqeuclidean") / ALONG**2)
