"""Which levels of touch are made, and at what price: the profiles of ``object build --only touch``."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.authoring.profiles import find_profile


@dataclass(frozen=True)
class CodesSpec:
    """Codes of a surface."""

    most_bytes: int = 18_000_000
    """of the codes alone, about a megabyte less than their file; nodes are as dense as it allows."""
    pitch: float = 0.5e-3  #: m, of a patch's pixels.


@dataclass(frozen=True)
class TouchProfile:
    """One trade of time for accuracy."""

    codes: CodesSpec  #: of the surface.
    presses: int  #: of each kind that errors are measured on.


TOUCH_PROFILES: Mapping[str, TouchProfile] = MappingProxyType({
    "smoke": TouchProfile(CodesSpec(most_bytes=3_000_000, pitch=0.6e-3), presses=20),
    "shipped": TouchProfile(CodesSpec(most_bytes=3_000_000, pitch=0.6e-3), presses=200),
    "standard": TouchProfile(CodesSpec(), presses=200),
})  # fmt: skip
"""``shipped`` is of the files that come with the program: as few bytes as ``smoke``, measured on as many
presses as ``standard``."""


def touch_profile(name: str) -> TouchProfile:
    """Return the profile of that name; ``WrongUse`` if there is none."""
    return find_profile(TOUCH_PROFILES, name, "touch", removed=("paper",))
