"""The last layer of a network, exactly: weighted least squares with the ridge that predicts best.

A last layer is linear, so that the best one for given hidden features is a solved problem and not one
to be trained. The ridge is chosen by leaving out one sample at a time, which least squares answers
in closed form (Allen, The Relationship between Variable Selection and Data Augmentation,
Technometrics 16, 1974), with the rounding of the file and of single precision added: weights that
cancel each other to a part in ten thousand are of no use in half precision, and a greater ridge has none.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.graph import Storage

RIDGES = (1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6)
"""Of the largest eigenvalue of the features' products."""

_JUDGED = 1500
"""Samples that are left out one by one, at most."""

_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class Readout:
    """A linear layer and how well it is expected to do.

    Attributes:
        weights: ``(features, outputs)``.
        expected: mean relative error of a sample that was left out, in single precision, with weights as
            the file holds them.
        ridge: that was chosen, of the largest eigenvalue.
    """

    weights: FloatArray
    expected: float
    ridge: float


Features = Callable[[FloatArray], AnyArray]
"""From ``(k, 3)`` points to ``(k, features)``; a constant one among them."""


def solve_readout(
    features: Features,
    points: FloatArray,
    targets: FloatArray,
    measured: IntArray,
    shares: FloatArray,
    storage: Storage = "float32",
) -> Readout:
    """The linear layer with the least relative error.

    Args:
        features: of points.
        points: ``(k, 3)``.
        targets: ``(k, outputs)``.
        measured: samples by which the ridge is chosen: those without kin, such as nodes.
        shares: ``(k,)``: what an error of each sample is multiplied by (``error_shares``).
        storage: of the weights in the file, whose rounding counts when the ridge is chosen.
    """
    gram, right = _products(features, points, targets, shares)
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values, 0.0)
    turned = vectors.T @ right
    judged = measured[:: max(1, len(measured) // _JUDGED)]
    seen = np.asarray(features(points[judged]), np.float64)
    rotated = (seen * shares[judged, None]) @ vectors
    best: Readout | None = None
    for ridge in RIDGES:
        shrunk = 1.0 / (values + ridge * values[-1])
        weights = vectors @ (turned * shrunk[:, None])
        leverage = np.minimum((rotated**2) @ shrunk, 1.0 - 1e-9)
        with np.errstate(over="ignore", invalid="ignore"):  # weights that the file cannot hold are the worst
            single = seen.astype(np.float32) @ weights.astype(storage).astype(np.float32)
        exact = seen @ weights
        left_out = (exact - targets[judged]) / (1.0 - leverage)[:, None] + (single - exact)
        mean = (np.linalg.norm(left_out, axis=1) * shares[judged]).mean()
        expected = float(np.nan_to_num(mean, nan=np.inf))
        if best is None or expected < best.expected:
            best = Readout(weights, expected, ridge)
    assert best is not None
    return best


def error_shares(targets: FloatArray) -> FloatArray:
    """``(k,)``: one over the norm of each sample's targets, so that errors count as relative ones.

    Where all modes are nearly at rest it is a thousand over the root mean square of the norms.
    """
    norms = np.linalg.norm(targets, axis=1)
    floor = 1e-3 * np.sqrt((norms**2).mean())
    shares: FloatArray = 1.0 / np.maximum(norms, floor if floor > 0.0 else 1.0)
    return shares


def _products(
    features: Features, points: FloatArray, targets: FloatArray, shares: FloatArray
) -> tuple[FloatArray, FloatArray]:
    gram: FloatArray | float = 0.0
    right: FloatArray | float = 0.0
    for first in range(0, len(points), _CHUNK):
        part = slice(first, first + _CHUNK)
        seen = np.asarray(features(points[part]), np.float64) * shares[part, None]
        gram = gram + seen.T @ seen
        right = right + seen.T @ (targets[part] * shares[part, None])
    return np.asarray(gram), np.asarray(right)
