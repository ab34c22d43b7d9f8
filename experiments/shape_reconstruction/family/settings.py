"""How much is searched, and how far the readings are believed: the dial of the family's estimate."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class FamilySettings:
    """Work and scales of a fit."""

    draws: int = 1850
    """shapes drawn from the prior, spread evenly over classes and their combinations of parts."""
    yaws: int = 4  #: turns that each draw is tried at.
    starts: int = 84  #: of them that are fitted to all readings, for a few rounds.
    refined: int = 42  #: of those, how many go on.
    refining: int = 14  #: rounds of each.
    changed: int = 4  #: hypotheses of which parts are then put on, taken off or exchanged.
    hops: int = 4  #: rounds of looking beside the best of them for better.
    hopping: int = 7  #: rounds that each shape beside one is refined for.
    finals: int = 10  #: hypotheses that are refined to the end.
    finishing: int = 14  #: rounds of each of those.
    pitch: float = 2.5e-3  #: m, of the grid that the surface is taken from.
    seed: int = 0  #: of the draws.


LEVELS = {
    "coarse": FamilySettings(
        draws=600, starts=40, refined=16, changed=2, hops=2, finals=5, finishing=8, pitch=4.0e-3
    ),
    "default": FamilySettings(),
    "fine": replace(
        FamilySettings(),
        draws=6000,
        yaws=8,
        starts=300,
        refined=100,
        changed=10,
        hops=8,
        finals=20,
        finishing=20,
        pitch=2.0e-3,
    ),
}
"""By name, the cheapest first."""

CONTINUED = replace(LEVELS["coarse"], draws=200, starts=14, refined=6, changed=1, finals=4, finishing=6)
"""Beside the hypotheses of an estimate from one press less: a third of a coarse search, by other draws each
time, so that what one misses another finds."""

ANEW = LEVELS["coarse"]
"""Beside those hypotheses where they fit ill: all of them may be of a wrong form."""
