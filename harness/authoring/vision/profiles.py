"""Which networks of vision are made, and at what price: the profiles of ``object build --only vision``."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from harness.authoring.profiles import find_profile
from harness.basics.errors import WrongUse
from harness.objectfile.vision.network import CELLS, PAPER, NetworkSize


@dataclass(frozen=True)
class CellsSpec:
    """Tiny networks, each trained on its own cell."""

    size: NetworkSize  #: of each network.
    cells: int = CELLS  #: along 1.2 times the object's longest side.
    places: int = 2_000_000  #: of the surface that all learn from together.
    steps: int = 4000  #: of Adam, of each network.
    batch: int = 64  #: places in a step.
    rate: float = 8e-3  #: of Adam's first steps; it falls to zero as half a cosine.
    hidden: float = 0.2  #: share of lamps that are hidden.
    opacity: float = 0.02  #: weight of the density's errors beside the colours'.
    overlap: float = 0.06  #: cells by which each learns from beyond its border, so that neighbours agree.
    least: int = 512  #: places that a cell learns from at least, its neighbours' if it has fewer.

    def __post_init__(self) -> None:
        if min(self.places, self.steps, self.batch, self.least) < 1 or not 0.0 <= self.overlap <= 0.5:
            raise WrongUse(
                f"no networks are trained on {self.places} places in {self.steps} steps of {self.batch}, "
                f"overlapping by {self.overlap} cells; give 1 or more of each, and 0 to 0.5"
            )
        if not (0.0 <= self.hidden <= 1.0 and self.opacity > 0.0 and self.rate > 0.0):
            raise WrongUse(
                f"a share of {self.hidden} hidden lamps, a weight of {self.opacity}, a rate of {self.rate}; "
                "give 0 to 1, and two numbers above 0"
            )


@dataclass(frozen=True)
class VisionProfile:
    """One trade of time for accuracy."""

    networks: CellsSpec  #: that are made.
    pictures: int  #: kept back, by which they are judged.
    side: int = 256  #: pixels of those pictures.
    samples: int = 4  #: a side of a pixel of the reference.
    edge: float = 1.5e-3
    """m between vertices of a built-in object, of which pictures are drawn. At that of touch and sound, 3 mm,
    the object's mesh serves and no finer one is written beside it."""

    def __post_init__(self) -> None:
        if min(self.pictures, self.side, self.samples) < 1:
            raise WrongUse(
                f"{self.pictures} pictures of {self.side} pixels with {self.samples} samples judge nothing; "
                "give 1 or more of each"
            )


_COMPACT = NetworkSize(width=32, octaves=6, turns=3, kind="osf-v")

VISION_PROFILES: Mapping[str, VisionProfile] = MappingProxyType({
    "smoke": VisionProfile(CellsSpec(_COMPACT, places=1_500_000), pictures=4),
    "shipped": VisionProfile(
        CellsSpec(_COMPACT, cells=12, places=1_500_000, steps=6000),
        pictures=4,
        edge=3e-3,
    ),
    "standard": VisionProfile(
        CellsSpec(_COMPACT, places=4_000_000, steps=20_000, batch=128),
        pictures=12,
    ),
    "paper": VisionProfile(
        CellsSpec(replace(PAPER, kind="osf-v"), places=4_000_000, steps=10_000, batch=128),
        pictures=12,
    ),
})  # fmt: skip
"""None of them needs torch. ``shipped`` takes the fewest bytes, of the files that come with the program.
``paper`` has networks of ObjectFolder 2.0's size."""


def vision_profile(name: str) -> VisionProfile:
    """Return the profile of that name; ``WrongUse`` if there is none."""
    return find_profile(VISION_PROFILES, name, "vision")
