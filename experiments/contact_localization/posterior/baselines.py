"""What an answer is worth that reads no image: the rows that every table must carry.

The translations between contacts alone say much about where on a known object they were
made; a method that reads tactile images must be seen beside them.
"""

from collections.abc import Sequence

import numpy as np

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.hypotheses import Contact, Noise
from experiments.contact_localization.posterior.likelihood import GeometryNoise
from experiments.contact_localization.posterior.posterior import best_point
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray
from harness.basics.faces.nearest import nearest_point
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import random_points

_BY_PLACES = Noise(unread=GeometryNoise(gap=1.2e-3))
"""Of baselines: with no sound to choose among more attitudes, a strict one serves them better than an
estimate's own noise of places unread (179 runs: 14.5 against 15.7 mm in the mean with close steps; 180: 2.8
against 3.5 mm with spread ones)."""


def mean_random_error(mesh: Mesh, truth_in_object: FloatArray, count: int = 4000) -> float:
    """Metres: the mean distance from a point drawn evenly from the surface to a ``(3,)`` truth."""
    points = random_points(mesh, count, np.random.default_rng(0))[0]
    return float(np.linalg.norm(points - truth_in_object, axis=1).mean())


def without_images(
    base_from_gels: Sequence[FloatArray], model: Model, prior: Prior, spacing: float, use_axis: bool = False
) -> FloatArray:
    """``(3,)`` metres, on the surface: the last contact, by this alone that all contacts lie on the object.

    Args:
        base_from_gels: ``(4, 4)`` each, in order; only the translations between them are used.
        model: of the object.
        prior: of its orientation.
        spacing: metres between surface samples.
        use_axis: whether the tool is taken to have stood near the surface's normal at every contact.
    """
    contacts = [Contact(np.asarray(pose)) for pose in base_from_gels]
    search = Search(contacts, model, prior, spacing, _BY_PLACES)
    last = len(contacts) - 1
    hypotheses = search.grid(np.arange(len(contacts)), last, use_axis)
    points = search.contact_places(last, hypotheses)
    return nearest_point(model.mesh, best_point(points, hypotheses.weights))
