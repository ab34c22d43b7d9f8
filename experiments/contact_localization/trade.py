"""Error against seconds: one recording, estimated at several levels of accuracy."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.estimate import estimate
from experiments.contact_localization.levels import Levels
from harness.arrays import FloatArray
from harness.clock import now
from harness.errors import FitRefused

LEVELS = {
    "4 mm, no refinement": Levels(spacing=4.0e-3, rounds=0),
    "3 mm, no refinement": Levels(spacing=3.0e-3, rounds=0),
    "2 mm, no refinement": Levels(rounds=0),
    "2 mm, refined once": Levels(rounds=1),
    "2 mm, refined": Levels(),
    "1.5 mm, refined": Levels(spacing=1.5e-3, rounds=3, samples=1200),
    "300 particles": Levels(method="particle", particles=300),
    "1,000 particles": Levels(method="particle", particles=1000),
    "3,000 particles": Levels(method="particle", particles=3000),
}
"""What the report tries, by name, from cheap to exact for each method."""


@dataclass(frozen=True)
class Point:
    """One level of accuracy on one recording.

    Attributes:
        name: of the level.
        levels: the dials.
        seconds_a_contact: of the estimate, samples of the surface prepared.
        error: m, of the last contact.
    """

    name: str
    levels: Levels
    seconds_a_contact: float
    error: float


def trade(found: Answer, true: FloatArray, seed: int) -> tuple[Point, ...]:
    """Estimate the same readings again at every level; a level that refuses the fit is left out.

    Args:
        found: the answer whose readings are used.
        true: ``(3,)`` metres, the last contact.
        seed: of the draws.
    """
    points = []
    for name, levels in LEVELS.items():
        found.model.surface(levels.spacing)
        start = now()
        try:
            answer = estimate(found.observations, found.model, found.prior, levels, seed=seed)
        except FitRefused:
            continue
        seconds = (now() - start) / len(found.observations)
        error = float(np.linalg.norm(answer.position_in_object - true))
        points.append(Point(name, levels, seconds, error))
    return tuple(points)
