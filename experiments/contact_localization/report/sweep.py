"""Error against seconds: one recording, estimated at several levels of accuracy."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from experiments.contact_localization.accuracy.dials import accuracy_at, by_sound, grid, particles
from experiments.contact_localization.accuracy.solving import Readings, loaded, prepare, solve
from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Accuracy, Setting

LEVELS: dict[str, Setting] = {
    "4 mm, no refinement": grid("both", 4e-3, 0, 3000, 8),
    "3 mm, no refinement": grid("both", 3e-3, 0, 3000, 8),
    "2 mm, no refinement": grid("both", 2e-3, 0, 3000, 8),
    "2 mm, refined once": grid("both", 2e-3, 1, 3000, 8),
    "2 mm, refined": grid("both", 2e-3, 5, 3000, 8),
    "1.5 mm, refined": grid("both", 1.5e-3, 5, 6000, 8),
    "300 particles": particles(300, 2e-3, 8),
    "1,000 particles": particles(1000, 2e-3, 8),
    "3,000 particles": particles(3000, 2e-3, 8),
}
"""What the report tries, by name, from cheap to exact for each method; `touchstone cost` tries more."""

BY_SENSE: dict[str, Setting] = {
    "touch: 4 mm, no refinement": grid("touch", 4e-3, 0, 3000, 8),
    "touch: 2 mm, no refinement": grid("touch", 2e-3, 0, 3000, 8),
    "touch: 2 mm, refined": grid("touch", 2e-3, 5, 3000, 8),
    "sound: 4 mm": by_sound(4e-3),
    "sound: 2 mm": by_sound(2e-3),
}
"""What is tried beside where contacts were struck, so that each sense is seen alone."""


@dataclass(frozen=True)
class SweepPoint:
    """One level of accuracy on one recording.

    Attributes:
        name: of the level.
        accuracy: the dials.
        seconds_a_contact: of the estimate, samples of the surface prepared.
        error: m, of the last contact.
    """

    name: str
    accuracy: Accuracy
    seconds_a_contact: float
    error: float


def trade(readings: Readings, true: FloatArray) -> tuple[SweepPoint, ...]:
    """Estimate the same readings again at every level; a level that refuses the fit is left out.

    Args:
        readings: of the run, its images read once.
        true: ``(3,)`` metres, the last contact.
    """
    points = []
    for name, setting in (LEVELS | BY_SENSE if readings.heard else LEVELS).items():
        prepare(readings.model, setting)
        solved = loaded(partial(solve, readings, setting))
        if solved.found is None:
            continue
        seconds = (readings.shared[1] + solved.wall) / len(readings.observations)
        error = float(np.linalg.norm(solved.found.position_in_object - true))
        points.append(SweepPoint(name, accuracy_at(setting), seconds, error))
    return tuple(points)
