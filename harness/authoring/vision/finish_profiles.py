"""What networks of a look learn from pictures last: which pictures, and how long."""

from dataclasses import dataclass

from harness.basics.errors import WrongUse


@dataclass(frozen=True)
class CellsFinish:
    """What tiny networks learn from pictures when they have learned from the surface.

    Attributes:
        pictures: how many, each of another camera and lamp; clear of those kept back.
        side: pixels of each.
        samples: a side of a pixel.
        rounds: of drawing them anew.
        steps: of Adam, of each network, a round.
        slower: share of the rate that they learned from the surface by.
        share: of each batch that is of pictures.
    """

    pictures: int = 96
    side: int = 256
    samples: int = 4
    rounds: int = 3
    steps: int = 1000
    slower: float = 0.3
    share: float = 0.5

    def __post_init__(self) -> None:
        if min(self.pictures, self.side, self.samples, self.rounds, self.steps) < 1:
            raise WrongUse(f"no networks are finished by {self}; counts are 1 or more")
        if not (self.slower > 0.0 and 0.0 <= self.share < 1.0):
            raise WrongUse(
                f"a rate {self.slower} times as fast, a share of {self.share} of pictures; "
                "give one above 0, and 0 to below 1"
            )
