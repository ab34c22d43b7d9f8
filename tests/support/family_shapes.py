"""Surfaces of shapes of the family, without an estimate around them."""

from typing import Any

import numpy as np

from experiments.shape_reconstruction.family.field import corners_of, grid_distances
from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import draw_shape
from experiments.shape_reconstruction.family.posterior import Mixture
from experiments.shape_reconstruction.family.search import Hypothesis, PriorRows
from experiments.shape_reconstruction.fits import TOUCHED, UNOBSERVED, FamilyFit
from experiments.shape_reconstruction.smooth.grid import isosurface
from harness.basics.mesh import Mesh

SHAPES = ("mug", "bowl", "tray", "bottle", "spanner")
"""Classes of every kind of body."""


def drawn(name: str) -> FamilyShape:
    """A shape of a class, the same each time."""
    return draw_shape(name, np.random.default_rng(3))


def surface_of(shape: FamilyShape, pitch: float = 1.5e-3) -> Mesh:
    """The shape as a mesh, from its distances on a grid of so many m."""
    corners = corners_of(shape)
    low, high = corners.min(axis=0) - 3e-3, corners.max(axis=0) + 3e-3
    counts = np.ceil((high - low) / pitch).astype(np.int64) + 1
    return isosurface(grid_distances(shape, low, pitch, counts), low, pitch)


def mixture_of(*shapes: FamilyShape, weights: tuple[float, ...] = (), cost: float = 1.0) -> Mixture:
    """Hypotheses of one cost without samples; of equal weight where none are given."""
    found = tuple(
        Hypothesis(one, PriorRows(one.theta, np.zeros((0, len(one.theta)))), cost, np.empty((0, 0)))
        for one in shapes
    )
    shares = np.array(weights or [1.0 / len(shapes)] * len(shapes))
    return Mixture(found, shares, ((),) * len(shapes))


def family_fit(mixture: Mixture, **changes: Any) -> FamilyFit:
    """A fit of two vertices, the second of them touched, to 12 contacts that are met."""
    given: dict[str, Any] = {
        "mesh": Mesh(np.zeros((2, 3)), np.zeros((0, 3), np.int64)), "deviation": np.full(2, 1e-3),
        "known_by": np.array([UNOBSERVED, TOUCHED]), "not_bounded": (), "doubtful": {}, "flags": ("family",),
        "seconds": 1.0, "estimator": "family", "left_out": np.zeros(12), "contact_cost": 0.1,
        "other_cost": 0.0, "nuisance": NuisanceCost(0.0, ""), "beyond_contacts": 0.0, "sighted": True,
    }  # fmt: skip
    return FamilyFit(mixture=mixture, **{**given, **changes})
