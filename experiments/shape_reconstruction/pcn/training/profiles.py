"""How much the networks learn from, and for how long."""

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class CompletionProfile:
    """How much is drawn and for how long it is learnt."""

    shapes: int  #: drawn; a tenth of them is held out.
    sets: int  #: of touches of each.
    steps: int  #: of the fit.
    batch: int = 12  #: sets a step.
    compared: int = 1024  #: points at a step, of those given and of those all over a shape.


PROFILES = MappingProxyType(
    {
        "smoke": {"completion": CompletionProfile(26, 2, 4), "glance": CompletionProfile(26, 2, 4)},
        "standard": {
            "completion": CompletionProfile(520, 6, 1600),
            "glance": CompletionProfile(2000, 6, 3000, 24, 512),
        },
        "long": {"glance": CompletionProfile(12000, 6, 24000, 96, 768)},
    }
)
"""Of the networks that ship: by touch, and by a glance; that of the latter is ``long``."""
PAPER_PROFILES = MappingProxyType(
    {"paper-smoke": CompletionProfile(26, 1, 2, 4), "paper": CompletionProfile(2600, 8, 6000, 32, 4096)}
)
"""Of the paper's own networks; the first shows in a minute that all of it runs."""
