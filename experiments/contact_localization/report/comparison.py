"""Where the answer puts the gel at each contact: what a comparison simulates the readings from."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.contact_localization.answer import Answer
from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import inverse, transform
from harness.experiment.experiment import Scored

GIVES = ("contact.gel_from_object",)
"""What an answer gives the simulation."""


def sources(scored: Scored) -> Mapping[str, Any]:
    """The answer's part of what the scene's observed quantities are computed from."""
    return {"contact.gel_from_object": inverse(object_from_gels(scored.found))}


def object_from_gels(found: Answer) -> FloatArray:
    """``(contacts, 4, 4)``: each gel as deep behind its estimated contact as its own images say."""
    object_from_base = found.prior.object_from_base(np.array([found.last.yaw]))[0]
    poses = []
    for observation, point, height in zip(
        found.observations, found.last.contacts, found.heights, strict=True
    ):
        rotation = object_from_base @ observation.base_from_gel[:3, :3]
        poses.append(transform(rotation, point + _at_centre(height) * rotation[:, 2]))
    return read_only(np.array(poses))


def _at_centre(height: FloatArray) -> float:
    rows, columns = height.shape
    middle = height[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
    return float(middle.mean())
