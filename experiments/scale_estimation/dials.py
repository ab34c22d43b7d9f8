"""The dials of a scale estimation: its estimators' own, and the simulation's."""

from harness.effects.accuracy import Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of

YAWS = Knob("scale.yaws", (4, 12, 24), "", "number", 12, "turns that the fit of the outline begins from")
STARTS = Knob(
    "scale.starts",
    (1, 4, 12, 40),
    "",
    "number",
    12,
    "best places of the contacts' first scan that are refined",
)
TURNS = Knob(
    "scale.turns",
    (1, 4, 12, 24),
    "",
    "number",
    12,
    "turns about the vertical over which touch of an unknown shape is averaged",
)

OWN: tuple[Knob[Level], ...] = (YAWS, STARTS, TURNS)
KNOBS: tuple[Knob[Level], ...] = (*OWN, *knobs_of(EFFECTS))
