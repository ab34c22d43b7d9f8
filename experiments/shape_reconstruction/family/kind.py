"""A kind of shape: its parameters, the prior of each, samples of it, and its neighbours."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from experiments.shape_reconstruction.family.layout import YAW
from harness.basics.arrays import FloatArray, IntArray

MM = 1e-3
Random = np.random.Generator


@dataclass(frozen=True, eq=False)
class FamilyShape:
    """One shape of the family."""

    name: str  #: its class.
    code: IntArray  #: ``(CODE_SIZE,)``, its kind and parts.
    theta: FloatArray  #: ``(n,)``, its pose, bench errors and parameters.

    def rotate(self, angle: float) -> "FamilyShape":
        """Return the shape rotated about the vertical, rad."""
        theta = self.theta.copy()
        theta[YAW] += angle
        return FamilyShape(self.name, self.code, theta)

    def with_part(self, part: int, value: int) -> "FamilyShape":
        """Return the shape with one entry of its code changed."""
        code = self.code.copy()
        code[part] = value
        return FamilyShape(self.name, code, self.theta)


Draw = Callable[[Random, IntArray, FloatArray], None]
"""Fills the code and the vector of a sample of a class, at the origin."""


@dataclass(frozen=True)
class Traits:
    """Properties that follow from the parts of a shape. Slots are indices into its vector."""

    has_yaw: bool = True  #: whether a rotation about the vertical changes it.
    yaw_factor: int = 1  #: factor on the number of yaws that a sample is tried at.
    proportions: tuple[int, ...] = ()  #: slots that are fitted on their own while a sample is placed.
    walls: tuple[int, ...] = ()  #: slots of the thicknesses of walls around a cavity.
    has_sides: bool = False  #: whether it has straight sides, which ``set_sides`` sets.


class ShapeKind(ABC):
    """A kind of shape. Slots are indices into a shape's vector."""

    number: ClassVar[int]  #: entry ``KIND`` of its codes.
    size: ClassVar[int]  #: numbers of its vectors, the pose included.
    classes: ClassVar[Mapping[str, Draw]]  #: how each class of the kind is sampled.
    lengths: ClassVar[tuple[int, ...]]  #: slots of all lengths: they scale together.
    width: ClassVar[int]  #: slot of the length that stands for the size.
    height: ClassVar[int]  #: slot of the length that sets the proportions.
    section: ClassVar[tuple[int, ...]] = ()  #: slots of lengths along the body that vary smoothly.
    is_elongated: ClassVar[bool] = True  #: whether it lies along one direction.

    @abstractmethod
    def deviations(self, code: IntArray) -> dict[int, float]:
        """Return one standard deviation of each free parameter about its sample, by slot."""

    @abstractmethod
    def extent(self, code: IntArray, theta: FloatArray) -> tuple[float, float]:
        """Compute half the width and the height of a shape roughly, m."""

    def changes(self, _shape: FamilyShape, _random: Random) -> Iterator[FamilyShape]:
        """Yield shapes with one part added, removed or exchanged."""
        return iter(())

    def traits(self, _code: IntArray) -> Traits:
        """Return what the parts of a shape imply."""
        return Traits()

    def rarity(self, _code: IntArray, _theta: FloatArray, _agrees: bool) -> float:
        """Compute the natural logarithm of the rarity of a shape by its parts and proportions.

        ``_agrees`` states whether all samples of its class are hollow, or solid, as it is.
        """
        return 0.0

    def set_sides(self, theta: FloatArray, half: FloatArray) -> None:
        """Set ``(2,)`` half sides of a body with straight ones, m."""
        raise NotImplementedError


def sample_length(random: Random, low: float, high: float) -> float:
    """Sample a length between two limits in mm, uniform in its logarithm; return m."""
    return float(np.exp(random.uniform(np.log(low), np.log(high)))) * MM
