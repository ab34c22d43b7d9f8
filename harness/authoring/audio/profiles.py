"""Which network of sound is made, and at what price: the profiles of ``touchstone object build``."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.authoring.profiles import find_profile
from harness.objectfile.graph import Storage

REACHES = (0.7, 1.0, 1.4)
"""Standard deviations of the waves' vectors along an axis that are tried, of the object's wave number."""


@dataclass(frozen=True)
class WavesSpec:
    """Plane waves and a linear layer, found without training."""

    width: int  #: waves.
    reaches: tuple[float, ...] = REACHES  #: that are tried.
    widest: int = 0  #: waves at most, where those of ``width`` are too few; they are doubled up to there.
    storage: Storage = "float32"  #: of the linear layer in the file.


@dataclass(frozen=True)
class AudioProfile:
    """One trade of time for accuracy."""

    network: WavesSpec  #: that is made.
    sounds: int  #: held-out nodes whose sounds are compared.
    table: bool = True  #: whether the exact shapes are written beside the network.


PROFILES: Mapping[str, AudioProfile] = MappingProxyType({
    "smoke": AudioProfile(WavesSpec(768, (1.0,)), sounds=8),
    "shipped": AudioProfile(WavesSpec(1536, storage="float16"), sounds=40, table=False),
    "standard": AudioProfile(WavesSpec(1536, widest=3072), sounds=40),
})  # fmt: skip
"""``shipped`` is ``standard`` in the fewest bytes, of the files that come with the program."""


def profile(name: str) -> AudioProfile:
    """Return the profile of that name; ``WrongUse`` if there is none."""
    return find_profile(PROFILES, name, "audio", removed=("small", "paper"))
