"""Amount of search in a fit of the family: levels, and the settings between two presses."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class FamilySettings:
    """Amount of search."""

    draws: int = 1850
    """samples of the prior, spread evenly over classes and their combinations of parts."""
    yaws: int = 4  #: yaws that each sample is tried at.
    starts: int = 84  #: placed samples that are fitted to all readings, for a few iterations.
    refined: int = 42  #: of those, the number that is refined.
    refining: int = 14  #: iterations of each.
    changed: int = 4  #: hypotheses of which parts are added, removed or exchanged.
    hops: int = 4  #: rounds of perturbing the best.
    hopping: int = 7  #: iterations of each perturbed shape.
    finals: int = 10  #: hypotheses that are finished.
    finishing: int = 14  #: iterations of each of those.
    pitch: float = 2.5e-3  #: pitch of the grid that the surface is extracted from, m.
    seed: int = 0  #: seed of the samples.


LEVELS = {
    "coarse": FamilySettings(
        draws=600, starts=40, refined=16, changed=2, hops=2, finals=5, finishing=8, pitch=4.0e-3
    ),
    "default": FamilySettings(),
    "fine": FamilySettings(
        draws=6000, yaws=8, starts=300, refined=100, changed=10, hops=8, finals=20, finishing=20, pitch=2.0e-3
    ),
}
"""By name, the cheapest first."""

CONTINUED = replace(LEVELS["coarse"], draws=200, starts=14, refined=6, changed=1, finals=4, finishing=6)
"""Between two presses, next to the hypotheses before the last one: other samples each time."""
