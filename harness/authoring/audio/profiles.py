"""Which network of sound is made, and at what price: the profiles of ``touchstone object build``."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
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
class PerceptronSpec:
    """Perceptrons trained by Adam; the defaults are the paper's."""

    branches: int = 3  #: 3, one for each direction of force, or 1 for all.
    depth: int = 8  #: hidden layers.
    width: int = 256  #: of each.
    octaves: int = 10  #: of the encoding.
    skip: int = 5  #: the layer, counted from 0, that takes the encoded input too; 0 for none.
    epochs: int = 60  #: passes over the samples.
    batch: int = 256  #: samples in a step.
    rate: float = 1e-3  #: of Adam's first steps; it falls to zero as half a cosine.


@dataclass(frozen=True)
class AudioProfile:
    """One trade of time for accuracy."""

    network: WavesSpec | PerceptronSpec  #: that is made.
    sounds: int  #: held-out nodes whose sounds are compared.
    table: bool = True  #: whether the exact shapes are written beside the network.


_SMALL = PerceptronSpec(branches=1, depth=4, width=256, octaves=6, skip=0, epochs=300)

PROFILES: Mapping[str, AudioProfile] = MappingProxyType({
    "smoke": AudioProfile(WavesSpec(768, (1.0,)), sounds=8),
    "shipped": AudioProfile(WavesSpec(1536, storage="float16"), sounds=40, table=False),
    "standard": AudioProfile(WavesSpec(1536, widest=3072), sounds=40),
    "small": AudioProfile(_SMALL, sounds=40),
    "paper": AudioProfile(PerceptronSpec(epochs=120), sounds=40),
})  # fmt: skip
"""``smoke``, ``shipped`` and ``standard`` need no torch; ``shipped`` is ``standard`` in the fewest bytes, of
the files that come with the program; ``paper`` is the network of ObjectFolder 2.0, ``small`` one
trunk for all three directions."""


def profile(name: str) -> AudioProfile:
    """The profile of that name.

    Raises:
        WrongUse: there is none.
    """
    found = PROFILES.get(name)
    if found is None:
        raise WrongUse(f"no profile {name!r}; {nearest(name, PROFILES)}")
    return found
