"""Which levels of touch are made, and at what price: the profiles of ``object build --only touch``."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest


@dataclass(frozen=True)
class CodesSpec:
    """Codes of a surface."""

    most_bytes: int = 18_000_000
    """of the codes alone, about a megabyte less than their file; nodes are as dense as it allows."""
    pitch: float = 0.5e-3  #: m, of a patch's pixels.
    width: int | None = None  #: numbers of a code on a linear basis; None for the heights themselves.


@dataclass(frozen=True)
class TouchPerceptronSpec:
    """A perceptron trained by Adam; the network is the paper's, its training our own."""

    depth: int = 8  #: hidden layers.
    width: int = 256  #: of each.
    octaves: int = 10  #: of the encoding.
    skip: int = 5  #: the layer, counted from 0, that takes the encoded input too; 0 for none.
    presses: int = 4000  #: whose maps are learned from.
    epochs: int = 100  #: checkpoints on the way.
    steps: int = 500  #: of Adam in an epoch.
    batch: int = 4096  #: pixels in a step.
    rate: float = 5e-4  #: of Adam's first steps; it falls to zero as half a cosine.


@dataclass(frozen=True)
class TouchProfile:
    """One trade of time for accuracy."""

    codes: CodesSpec  #: of the surface.
    perceptron: TouchPerceptronSpec | None  #: None for none.
    presses: int  #: of each kind that errors are measured on.


TOUCH_PROFILES: Mapping[str, TouchProfile] = MappingProxyType({
    "smoke": TouchProfile(CodesSpec(most_bytes=3_000_000, pitch=0.6e-3), None, presses=20),
    "shipped": TouchProfile(CodesSpec(most_bytes=3_000_000, pitch=0.6e-3), None, presses=200),
    "standard": TouchProfile(CodesSpec(), None, presses=200),
    "paper": TouchProfile(CodesSpec(), TouchPerceptronSpec(), presses=200),
})  # fmt: skip
"""Only ``paper`` needs torch: it trains ObjectFolder 2.0's network beside the codes. ``shipped`` is of the
files that come with the program: as few bytes as ``smoke``, measured on as many presses as ``standard``."""


def touch_profile(name: str) -> TouchProfile:
    """The profile of that name.

    Raises:
        WrongUse: there is none.
    """
    found = TOUCH_PROFILES.get(name)
    if found is None:
        raise WrongUse(f"no profile {name!r} of touch; {nearest(name, TOUCH_PROFILES)}")
    return found
