"""A known shape at the size, the turn and the place at which its surface meets the contacts."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import ContactSamples
from experiments.shape_reconstruction.estimators.free_space import Silhouette, depth_of_touches
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.retrieval.library import LibraryShape
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh

YAWS = 16
SIZES = (0.7, 0.85, 1.0, 1.2, 1.45, 1.8)
"""Longest sides that are tried, over the longest side of the box of the contacts."""

REFINED = 3
"""Best starts of a shape that are refined, ..."""

ROUNDS = 20
"""... each by so many fits of size, turn and place to nearest places."""

COARSE = 4.0
"""The loss's width at first, over ``SCALE``."""

SCALE = 2.0e-3
"""M beyond which a contact's distance weighs less and less."""

NORMAL = 0.35
"""Rad, one standard deviation of the surface's direction at a contact: shapes of a kind differ."""

_FEW = 60
_SAMPLES = 600
_FREE = 3.0e-3
_PIXELS = 2.0
_LEAST, _MOST = 0.02, 1.0


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A shape in ``stand``."""

    shape: LibraryShape  #: of the library.
    size: float  #: m, its longest side.
    yaw: float  #: rad about z.
    place: FloatArray  #: ``(2,)`` m.
    cost: float
    """the less the better: of contacts, normals, free space, silhouette and area; may be below 0."""

    @property
    def mesh(self) -> Mesh:
        """In ``stand``, m."""
        return Mesh(self.outward(self.shape.mesh.vertices), self.shape.mesh.faces)

    def outward(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` m of points of the library's shape."""
        return np.asarray(self.size * points @ self.turn.T + np.append(self.place, 0.0))

    def inward(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` in the library's frame of points in ``stand``."""
        return np.asarray((points - np.append(self.place, 0.0)) @ self.turn / self.size)

    @property
    def turn(self) -> FloatArray:
        """``(3, 3)`` stand from shape."""
        return rotation_about(np.array([0.0, 0.0, 1.0]), self.yaw)


def placed(
    shape: LibraryShape, samples: ContactSamples, evidence: ShapeEvidence, silhouette: Silhouette | None
) -> PlacedShape:
    """The best that was found.

    Args:
        shape: tried.
        samples: of the contacts, one or more.
        evidence: whose free space counts.
        silhouette: of the picture, if there is one.
    """
    some = samples.points[np.random.default_rng(0).permutation(len(samples.points))[:_FEW]]
    starts = sorted(_starts(shape, samples), key=lambda start: _distance_cost(start, some))
    refined = [_refined(start, samples) for start in starts[:REFINED]]
    return min((_costed(one, samples, evidence, silhouette) for one in refined), key=lambda one: one.cost)


def _starts(shape: LibraryShape, samples: ContactSamples) -> list[PlacedShape]:
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    reach = max(float(np.max([*(high - low)[:2], high[2]])), _LEAST)
    middle = 0.5 * (low + high)[:2]
    yaws = np.arange(YAWS) * 2.0 * np.pi / YAWS
    return [PlacedShape(shape, size * reach, float(yaw), middle, np.inf) for size in SIZES for yaw in yaws]


def _distance_cost(at: PlacedShape, points: FloatArray) -> float:
    apart = at.size * np.asarray(at.shape.samples[0].query(at.inward(points))[0])
    return float(np.log1p((apart / SCALE) ** 2).mean())


def _refined(at: PlacedShape, samples: ContactSamples) -> PlacedShape:
    """Nearest places, then the size, turn and place that bring them onto the contacts, again and again.

    Weighted by the loss of Cauchy, so that what the shape has not does not pull it; at first by a wide one,
    so that a start far off is not held by the few contacts that it happens to meet.
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
        # A little of a prior leaves as it is what contacts do not say: a turn of a round thing.
        damping = np.diag([1e-4, 1e-5, 1e-2, 1e-2]) * float(weight.sum())
        step = np.linalg.solve(weighted @ terms + damping, weighted @ along)
        size = float(np.clip(at.size * np.exp(np.clip(step[0], -0.2, 0.2)), _LEAST, _MOST))
        yaw = at.yaw + float(np.clip(step[1], -0.2, 0.2))
        at = PlacedShape(at.shape, size, yaw, at.place + np.clip(step[2:], -0.02, 0.02), np.inf)
    return at


def _costed(
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
    own = at.outward(at.shape.samples[1][:_SAMPLES])
    # Of each touch, as its contact is: one that could not have been made there is not outweighed by area.
    cost += float(np.log1p((depth_of_touches(evidence, own) / _FREE) ** 2).mean())
    if silhouette is not None:
        cost += _picture_cost(own, silhouette)
    # Touches come to the outside evenly: the density of each is one over its area.
    cost += float(np.log(at.shape.outside * at.size**2 / evidence.largest**2))
    beyond = max(at.size / evidence.largest - 1.0, 0.0)
    return PlacedShape(at.shape, at.size, at.yaw, at.place, cost + 10.0 * beyond)


def _picture_cost(own: FloatArray, silhouette: Silhouette) -> float:
    """Of ``(n, 3)`` m of a surface: how far it appears outside, and how far it is from the mask's pixels."""
    outside = float(np.log1p((np.maximum(silhouette.outside_pixels(own), 0.0) / _PIXELS) ** 2).mean())
    rows, columns = np.nonzero(silhouette.look.mask)
    some = np.random.default_rng(0).permutation(len(rows))[:_SAMPLES]
    pixels = np.column_stack([columns[some] + 0.5, rows[some] + 0.5])
    apart = cKDTree(silhouette.pixels(own)[0]).query(pixels)[0]
    # Samples of a surface leave gaps of some pixels in its picture.
    gap = np.sqrt(len(rows) / _SAMPLES) + _PIXELS
    return outside + float(np.log1p((np.maximum(apart - gap, 0.0) / _PIXELS) ** 2).mean())
