"""What networks of a look learn from pictures last: which pictures, and how long."""

from dataclasses import dataclass

from harness.basics.errors import WrongUse


@dataclass(frozen=True)
class PictureSet:
    """Pictures to learn from, clear of those kept back.

    Attributes:
        pictures: how many, each of another camera and lamp.
        side: pixels of each.
        samples: a side of a pixel.
    """

    pictures: int = 24
    side: int = 256
    samples: int = 4

    def __post_init__(self) -> None:
        if min(self.pictures, self.side, self.samples) < 1:
            raise WrongUse(f"nothing is learned from {self}; counts are 1 or more")


@dataclass(frozen=True)
class TeacherFinish(PictureSet):
    """What a teacher learns from pictures when it has learned from the surface.

    Attributes:
        steps: of Adam in all.
        epochs: after each the state is kept.
        rays: in a step, beside a batch of places.
        slower: share of the rates that it learned from the surface by.
        weight: of what pictures say beside what the surface says.
    """

    steps: int = 1000
    epochs: int = 10
    rays: int = 1024
    slower: float = 0.3
    weight: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.epochs, self.rays) < 1 or self.steps < self.epochs:
            raise WrongUse(
                f"no teacher is finished by {self}; counts are 1 or more, and there is a step an epoch"
            )
        if not (self.slower > 0.0 and self.weight > 0.0):
            raise WrongUse(f"rates {self.slower} times as fast, a weight of {self.weight}; give two above 0")


@dataclass(frozen=True)
class CellsFinish(PictureSet):
    """What tiny networks learn from pictures when they have learned from the surface.

    Attributes:
        rounds: of drawing them anew.
        steps: of Adam, of each network, a round.
        slower: share of the rate that they learned from the surface by.
        share: of each batch that is of pictures.
    """

    pictures: int = 96
    rounds: int = 3
    steps: int = 1000
    slower: float = 0.3
    share: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(self.rounds, self.steps) < 1:
            raise WrongUse(f"no networks are finished by {self}; counts are 1 or more")
        if not (self.slower > 0.0 and 0.0 <= self.share < 1.0):
            raise WrongUse(
                f"a rate {self.slower} times as fast, a share of {self.share} of pictures; "
                "give one above 0, and 0 to below 1"
            )
