"""How much is searched, and how far the readings are believed: the dial of the family's estimate."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class FamilySettings:
    """Work and scales of a fit.

    Attributes:
        draws: shapes drawn from the prior, spread evenly over the classes.
        yaws: turns that each draw is tried at.
        aligning: rounds in which each draw finds its place, turn and size.
        starts: of them that are refined.
        refining: rounds of each.
        finals: hypotheses that are refined to the end.
        finishing: rounds of each of those.
        pitch: m, of the grid that the surface is taken from.
        seed: of the draws.
    """

    draws: int = 1200
    yaws: int = 6
    aligning: int = 4
    starts: int = 48
    refining: int = 7
    finals: int = 10
    finishing: int = 14
    pitch: float = 2.5e-3
    seed: int = 0


LEVELS = {
    "coarse": FamilySettings(draws=400, yaws=4, starts=20, finals=5, finishing=8, pitch=4.0e-3),
    "default": FamilySettings(),
    "fine": replace(FamilySettings(), draws=4000, yaws=8, starts=120, finals=20, finishing=20, pitch=2.0e-3),
}
"""By name, the cheapest first."""
