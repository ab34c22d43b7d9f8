"""What can be said without looking at one tactile image; a table without these rows is not honest."""

from collections.abc import Sequence

import numpy as np

from experiments.contact_localization.contact_point import nearest_point
from experiments.contact_localization.grid import Contact, Noise, Search
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.posterior import best_point
from experiments.contact_localization.surface import random_points
from harness.arrays import FloatArray, IntArray
from harness.mesh import Mesh

_RANDOM_POINTS = 4000


def geometry_answer(
    observations: Sequence[Observation],
    model: Model,
    prior: Prior,
    spacing: float = 2.0e-3,
    use_axis: bool = False,
    noise: Noise | None = None,
) -> FloatArray:
    """``(3,)`` metres: the last contact, from the arm's translations and the object's shape alone.

    Args:
        observations: their images are not opened.
        model: the object.
        prior: of its orientation.
        spacing: metres between the surface's samples.
        use_axis: whether the tool's attitude counts too: that it was within 15 degrees of the normal.
        noise: of the places and axes.
    """
    contacts = [Contact(observation.base_from_gel, None) for observation in observations]
    search = Search(contacts, model, prior, spacing, noise or Noise())
    members: IntArray = np.arange(len(contacts), dtype=np.int64)
    found = search.grid(members, len(contacts) - 1, use_axis)
    cloud = search.surface_points(len(contacts) - 1, found.gels, found.yaws)
    return nearest_point(model.mesh, best_point(cloud, found.weights))


def random_error(mesh: Mesh, true: FloatArray) -> float:
    """Metres: the expected distance from ``(3,)`` ``true`` of a point drawn evenly from the surface."""
    points, _ = random_points(mesh, _RANDOM_POINTS, np.random.default_rng(0))
    return float(np.linalg.norm(points - true, axis=1).mean())
