"""The answer by retrieval: the best shape of a library, bent to the contacts; the next best beside it."""

import time
from collections.abc import Sequence

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from experiments.shape_reconstruction.estimators.contact_samples import ContactSamples, all_samples, thinned
from experiments.shape_reconstruction.estimators.free_space import silhouette_of
from experiments.shape_reconstruction.estimators.knowledge import (
    beyond_deviation,
    known_by,
    limited_sides,
    not_bounded,
)
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.retrieval.library import LibraryShape
from experiments.shape_reconstruction.retrieval.placing import PlacedShape, placed
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh

KEPT = 5
"""Shapes whose spread says how unsure the answer is."""

ALONG = 15.0e-3
"""M over which the shape differs from the known one alike."""

DIFFERS = 3.0e-3
"""M, one standard deviation of by how much."""

FARTHEST = 10.0e-3
"""M of a contact from the shape beyond which the shape is not bent to it."""

TEMPER = 0.3
"""Of cost, by which a shape weighs a factor e less."""

READING = 0.7e-3


def by_retrieval(evidence: ShapeEvidence, library: Sequence[LibraryShape]) -> ShapeEstimate:
    """The shape of a library that fits best.

    Args:
        evidence: one contact or more.
        library: one shape or more.

    Raises:
        FitRefused: no touch met the object.
        WrongUse: a library without shapes.
    """
    start = time.perf_counter()
    if not library:
        raise WrongUse("a library of 0 shapes holds none that fits; name a folder with meshes")
    samples = thinned(all_samples(evidence))
    silhouette = silhouette_of(evidence, samples.points)
    ranked = sorted(
        (placed(shape, samples, evidence, silhouette) for shape in library), key=lambda one: one.cost
    )[:KEPT]
    best = ranked[0]
    mesh = _bent(best.mesh, samples)
    known = known_by(mesh, samples, silhouette)
    sides = limited_sides(mesh, samples, silhouette)
    deviation = _spread(mesh, ranked) ** 2 + READING**2
    deviation += beyond_deviation(mesh, known, sides, evidence.largest) ** 2
    return ShapeEstimate(
        mesh=mesh,
        deviation=np.sqrt(deviation),
        known_by=known,
        not_bounded=not_bounded(sides),
        doubtful={},
        flags=(),
        seconds=time.perf_counter() - start,
        details={
            "estimator": "retrieval",
            "shapes": [{"name": one.shape.name, "size_m": one.size, "cost": one.cost} for one in ranked],
        },
    )


def _bent(mesh: Mesh, samples: ContactSamples) -> Mesh:
    """A mesh moved by a Gaussian process through what contacts differ from it; never below the support."""
    places, _ = NearestSurface(mesh).places(samples.points)
    off = samples.points - places
    near = np.linalg.norm(off, axis=1) < FARTHEST
    if not near.any():
        return mesh
    places, off, sigmas = places[near], off[near], samples.sigmas[near]
    total = _alike(places, places) + np.diag((sigmas / DIFFERS) ** 2)
    weights = cho_solve(cho_factor(total, lower=True), off)
    vertices = mesh.vertices + _alike(mesh.vertices, places) @ weights
    vertices[:, 2] = np.maximum(vertices[:, 2], np.minimum(mesh.vertices[:, 2], 0.0))
    return Mesh(vertices, mesh.faces)


def _alike(one: FloatArray, other: FloatArray) -> FloatArray:
    return np.exp(-0.5 * cdist(one, other, "sqeuclidean") / ALONG**2)


def _spread(mesh: Mesh, ranked: Sequence[PlacedShape]) -> FloatArray:
    """``(vertices,)`` m: how far the other shapes are from each vertex, weighed by how well they fit."""
    weights = np.exp(-(np.array([one.cost for one in ranked]) - ranked[0].cost) / TEMPER)
    squares = np.zeros(len(mesh.vertices))
    for weight, one in zip(weights, ranked, strict=True):
        squares += weight * NearestSurface(one.mesh).distances(mesh.vertices) ** 2
    return np.asarray(np.sqrt(squares / weights.sum()))
