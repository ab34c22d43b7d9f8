"""How large a teacher is, and what it may cost: one network of an object's whole look."""

from dataclasses import dataclass, replace

from harness.authoring.vision.finish_profiles import TeacherFinish
from harness.basics.errors import WrongUse
from harness.objectfile.vision_tensors import EXTRAS, Kind


@dataclass(frozen=True)
class TeacherSpec:
    """One network of a whole object, and how it is trained.

    Attributes:
        kind: ``osf`` is told place, view and light; ``osf-v`` visibility and normal too.
        width: of every hidden layer.
        deep: layers between what is told of directions and the colour.
        turns: octaves of a direction's encoding.
        coarsest: cubes along the lattice at the coarsest level of features.
        finest: at the finest; those between grow by one factor.
        levels: of features.
        features: of a corner of a cube.
        slots: of a level's table, as a power of 2: finer levels share them.
        places: of the surface that it learns from.
        steps: of Adam in all.
        epochs: after each the state is kept.
        batch: places in a step.
        rate: of Adam's first steps, of layers; it falls to zero as half a cosine.
        table_rate: the same of features.
        hidden: share of lamps that are hidden.
        opacity: weight of the density's errors beside the colours'.
        finish: what it learns from pictures then; None for nothing.
    """

    kind: Kind = "osf-v"
    width: int = 64
    deep: int = 1
    turns: int = 3
    coarsest: int = 16
    finest: int = 256
    levels: int = 6
    features: int = 4
    slots: int = 17
    places: int = 1_000_000
    steps: int = 3000
    epochs: int = 25
    batch: int = 2048
    rate: float = 1e-2
    table_rate: float = 2e-2
    hidden: float = 0.2
    opacity: float = 0.02
    finish: TeacherFinish | None = None

    def __post_init__(self) -> None:
        sizes = (self.width, self.deep, self.coarsest, self.levels, self.features, self.places, self.batch)
        if min(*sizes, self.epochs) < 1 or self.turns < 0 or self.finest < self.coarsest:
            raise WrongUse(f"no teacher is {self}; sizes are 1 or more, and the finest level is the last")
        if self.kind not in EXTRAS or not 1 <= self.slots <= 24 or self.steps < self.epochs:
            raise WrongUse(
                f"a teacher of kind {self.kind!r} with 2^{self.slots} slots and {self.steps} steps in "
                f"{self.epochs} epochs; kinds are {', '.join(EXTRAS)}, slots 2^1 to 2^24, steps one an epoch"
            )

    @property
    def resolutions(self) -> tuple[int, ...]:
        """Cubes along the lattice, of each level."""
        if self.levels == 1:
            return (self.finest,)
        growth = (self.finest / self.coarsest) ** (1.0 / (self.levels - 1))
        return tuple(round(self.coarsest * growth**level) for level in range(self.levels))

    @property
    def direction(self) -> int:
        """Numbers that a direction becomes."""
        return 3 + 6 * self.turns


_TOLD = TeacherSpec()
_STRICT = replace(_TOLD, kind="osf", deep=2)

SMOKE_TEACHERS = (replace(_TOLD, places=500_000, steps=500, epochs=5),)
STANDARD_TEACHERS = (_TOLD, _STRICT)
"""One that is told visibility and normal, and one that is told no more than the paper's."""
