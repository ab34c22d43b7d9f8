"""The ellipsoid nearest to all contacts, standing on the support: the plainest round answer."""

import time

import numpy as np
import trimesh
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from experiments.shape_reconstruction.estimators.contact_samples import all_samples, thinned
from experiments.shape_reconstruction.estimators.plain_answer import plain_answer
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh

APART = 5.0e-3
"""M, one standard deviation of a contact's distance from the ellipsoid: objects are none."""

ROUNDNESS = 0.5
"""One standard deviation of the logarithm of a radius about that of the contacts' own spread."""

_LEAST_RADIUS = 4.0e-3
_TURN = 0.5
_ROUNDS = 60
_SUBDIVISIONS = 4


def by_ellipsoid(evidence: ShapeEvidence) -> ShapeEstimate:
    """The ellipsoid that fits all contacts in the least squares of their distances from it.

    It begins as the ellipsoid of the contacts' covariance, which a prior holds it to where contacts are few,
    and its lowest place is on the support.

    Raises:
        FitRefused: no touch met the object.
    """
    start = time.perf_counter()
    samples = all_samples(evidence)
    most = 0.5 * evidence.largest
    first, axes = _by_covariance(samples.points, most)
    given = (axes, thinned(samples).points, first, evidence.support_error)
    fit = least_squares(_residuals, first, args=given, max_nfev=_ROUNDS)
    return plain_answer(evidence, samples, None, _mesh(fit.x, axes, most), "ellipsoid", start)


def _by_covariance(points: FloatArray, most: float) -> tuple[FloatArray, FloatArray]:
    """``(9,)``: centre m, logarithms of radii, a rotation vector of zeros; and ``(3, 3)`` axes as columns.

    Places all over an ellipsoid have a third of each radius squared as their variance.
    """
    variances, axes = np.linalg.eigh(np.cov(points.T, bias=True))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    radii = np.clip(np.sqrt(3.0 * np.maximum(variances, 0.0)), _LEAST_RADIUS, most)
    return np.concatenate([points.mean(axis=0), np.log(radii), np.zeros(3)]), axes


def _residuals(
    numbers: FloatArray, axes: FloatArray, points: FloatArray, first: FloatArray, support_error: float
) -> FloatArray:
    centre, radii, turned = _parts(numbers, axes)
    unit = (points - centre) @ turned / radii
    length = np.maximum(np.linalg.norm(unit, axis=1), 1e-9)
    # The distance to first order: the level over its gradient.
    apart = (length - 1.0) * length / np.maximum(np.linalg.norm(unit / radii, axis=1), 1e-9)
    lowest = centre[2] - float(np.linalg.norm(turned[2] * radii))
    scales = np.repeat([np.exp(first[3:6].max()), ROUNDNESS, _TURN], 3)
    return np.concatenate([apart / APART, [lowest / (APART + support_error)], (numbers - first) / scales])


def _parts(numbers: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Centre, radii and ``(3, 3)`` axes of an ellipsoid."""
    return numbers[:3], np.exp(numbers[3:6]), axes @ Rotation.from_rotvec(numbers[6:]).as_matrix()


def _mesh(numbers: FloatArray, axes: FloatArray, most: float) -> Mesh:
    centre, radii, turned = _parts(numbers, axes)
    ball = trimesh.creation.icosphere(subdivisions=_SUBDIVISIONS)
    vertices = centre + (np.asarray(ball.vertices) * np.minimum(radii, most)) @ turned.T
    # Nothing of the object is in its support.
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.0)
    return Mesh(vertices, np.asarray(ball.faces, dtype=np.int64))
