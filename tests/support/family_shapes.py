"""Surfaces of shapes of the family, without an estimate around them."""

import numpy as np

from experiments.shape_reconstruction.family.classes import FamilyShape, draw_shape
from experiments.shape_reconstruction.family.field import corners_of, grid_distances
from harness.basics.faces.isosurface import isosurface
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
