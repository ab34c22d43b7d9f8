"""From an outline to a size without a model: a quadratic of its widths, fitted to household shapes.

The widths are metres at the distance of where the object stands. What they leave open is the shape: how far
the object reaches along the line of sight. How much that is on shapes never seen is the answer's width.
"""

from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import combinations_with_replacement

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange
from harness.basics.arrays import FloatArray
from harness.picture.outline import DIRECTIONS, SeenOutline

WEIGHTS = "data/outline_regression.npz"
"""In this package; written by ``python -m experiments.scale_estimation.unseen.train``."""

USED = 18
"""Widths of an outline that are features: one every ten degrees."""


@dataclass(frozen=True, eq=False)
class Regression:
    """A fitted quadratic."""

    middle: FloatArray  #: ``(d,)`` of the features.
    spread: FloatArray  #: ``(d,)`` of them.
    weights: FloatArray  #: ``(p,)`` of the products of the features so normalised; the constant first.
    inverse: FloatArray  #: ``(p, p)`` inverse of the products' normal matrix, ridge included.
    sigma: float
    """of the logarithm of the size, on shapes that were held out, where their products are usual."""

    def size(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``(n,)`` logarithms of the size over the mean width, and their deviations, of ``(n, d)`` features.

        A shape unlike all that it was fitted to is answered with a greater deviation (the leverage of least
        squares).
        """
        terms = products((features - self.middle) / self.spread)
        leverage = np.einsum("np,pq,nq->n", terms, self.inverse, terms)
        return terms @ self.weights, self.sigma * np.sqrt(1.0 + leverage)


def features_of(
    outline: SeenOutline, base_from_camera: FloatArray, focal_px: float, place: FloatArray
) -> tuple[FloatArray, float]:
    """Logarithms of an outline's widths over their mean, the camera's elevation; and that mean in m.

    Args:
        outline: of the picture.
        base_from_camera: ``(4, 4)``.
        focal_px: pixels.
        place: ``(3,)`` m in base, where the object nominally stands.
    """
    half = DIRECTIONS // 2
    widths = (outline.extents[:half] + outline.extents[half:])[:: half // USED]
    away = place - base_from_camera[:3, 3]
    distance = float(base_from_camera[:3, 2] @ away)
    elevation = float(np.arcsin(-away[2] / np.linalg.norm(away)))
    mean = float(widths.mean())
    return np.append(np.log(widths / mean), elevation), mean * distance / focal_px


def by_outline(features: FloatArray, mean_width: float, sizes: SizeRange) -> Belief:
    """What the widths say of the size.

    Args:
        features: as ``features_of`` gives them.
        mean_width: m, likewise.
        sizes: asked about.
    """
    log_ratio, sigma = shipped().size(features[None])
    middle = np.log(mean_width) + log_ratio[0]
    return Belief.of(sizes, -0.5 * ((sizes.logs - middle) / sigma[0]) ** 2)


def products(features: FloatArray) -> FloatArray:
    """``(n, p)``: one, the ``(n, d)`` features, and every product of two of them."""
    pairs = list(combinations_with_replacement(range(features.shape[1]), 2))
    second = np.stack([features[:, i] * features[:, j] for i, j in pairs], axis=1)
    return np.concatenate([np.ones((len(features), 1)), features, second], axis=1)


@cache
def shipped() -> Regression:
    """The one that came with the program."""
    with (files(__package__) / WEIGHTS).open("rb") as file:
        kept = np.load(file, allow_pickle=False)
        return Regression(
            kept["middle"], kept["spread"], kept["weights"], kept["inverse"], float(kept["sigma"])
        )
