"""Error against seconds: one recording, estimated at several levels of accuracy."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.accuracy.dials import accuracy_at
from experiments.contact_localization.accuracy.solving import Readings, prepare, solve_loaded
from experiments.contact_localization.posterior.dials import (
    BLOCK,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
)
from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Setting


def _grid(spacing: float, rounds: int, samples: int) -> Setting:
    return {METHOD.name: "grid", SPACING.name: spacing, ROUNDS.name: rounds, SAMPLES.name: samples}


def _particles(number: int) -> Setting:
    return {
        SENSES.name: "touch",
        METHOD.name: "particle",
        PARTICLES.name: number,
        BLOCK.name: BLOCK.default,
    }


LEVELS: dict[str, Setting] = {
    "4 mm, no refinement": _grid(4.0e-3, 0, 3000),
    "3 mm, no refinement": _grid(3.0e-3, 0, 3000),
    "2 mm, no refinement": _grid(2.0e-3, 0, 3000),
    "2 mm, refined once": _grid(2.0e-3, 1, 3000),
    "2 mm, refined": _grid(2.0e-3, 5, 3000),
    "1.5 mm, refined": _grid(1.5e-3, 5, 6000),
    "300 particles": _particles(300),
    "1,000 particles": _particles(1000),
    "3,000 particles": _particles(3000),
}
"""What the report tries, by name, from cheap to exact for each method; `touchstone cost` tries more."""

BY_SENSE: dict[str, Setting] = {
    "touch: 4 mm, no refinement": {SENSES.name: "touch", **_grid(4.0e-3, 0, 3000)},
    "touch: 2 mm, no refinement": {SENSES.name: "touch", **_grid(2.0e-3, 0, 3000)},
    "touch: 2 mm, refined": {SENSES.name: "touch", **_grid(2.0e-3, 5, 3000)},
    "sound: 4 mm": {SENSES.name: "audio", METHOD.name: "grid", SPACING.name: 4.0e-3},
    "sound: 2 mm": {SENSES.name: "audio", METHOD.name: "grid", SPACING.name: 2.0e-3},
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
        solved = solve_loaded(readings, setting)
        if solved.estimate is None:
            continue
        seconds = (readings.shared[1] + solved.wall) / len(readings.observations)
        error = float(np.linalg.norm(solved.estimate.position_in_object - true))
        points.append(SweepPoint(name, accuracy_at(setting), seconds, error))
    return tuple(points)
