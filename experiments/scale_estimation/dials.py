"""The dials of a scale estimation: its estimators' own, and the simulation's."""

from collections.abc import Mapping

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
OF_SHAPE: Mapping[str, tuple[Knob[Level], ...]] = {"known": (YAWS, STARTS), "unknown": (TURNS,)}
"""Those that an answer turns on, where the shape is known and where it is not."""

KNOBS: tuple[Knob[Level], ...] = (*OWN, *knobs_of(EFFECTS))
