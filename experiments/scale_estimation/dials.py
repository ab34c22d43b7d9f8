"""The dials of a scale estimation: its estimator's own, and the simulation's."""

from harness.effects.accuracy import Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of

STARTS = Knob(
    "scale.starts",
    (1, 4, 12, 40),
    "",
    "number",
    12,
    "best places of the contacts' first scan that are refined",
)
"""Matters where the shape is known; an answer about an unknown shape has no dial of its own."""

KNOBS: tuple[Knob[Level], ...] = (STARTS, *knobs_of(EFFECTS))
