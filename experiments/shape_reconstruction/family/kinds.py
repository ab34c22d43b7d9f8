"""The shape family: classes of household objects, samples of each, and their rarity: the prior.

Sizes are what such things are sold in, rounded outward: tableware by makers' lists (mugs of 0.2 to 0.5 l,
plates of 150 to 300 mm, bowls of 100 to 260 mm, stemmed glasses of 130 to 260 mm), cans by the American can
sizes (202 to 603, that is 54 to 157 mm across), bottles and jugs by their litres (0.2 to 2.5), pans by hob
sizes (140 to 300 mm), spanners by DIN 3113 (8 to 32 mm across flats, 100 to 350 mm long, heads 2.0 to 2.4
times the flats), packets and boards by kitchen shelves (20 to 350 mm). Walls are 2 to 5 mm of cups and jugs,
3 to 6 mm of stoneware, 1 to 3 mm of glass. None is of an object of the tables.
"""

from functools import lru_cache
from types import MappingProxyType

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.family.bent import BentBody
from experiments.shape_reconstruction.family.kind import FamilyShape, Random, ShapeKind
from experiments.shape_reconstruction.family.layout import CODE_SIZE, KIND
from experiments.shape_reconstruction.family.revolution import BodyOfRevolution
from experiments.shape_reconstruction.family.revolution_distance import HOLLOW
from experiments.shape_reconstruction.family.tool import FlatTool
from harness.basics.arrays import FloatArray, IntArray

KINDS: tuple[ShapeKind, ...] = (BodyOfRevolution(), FlatTool(), BentBody())
"""All kinds of shapes, by their number."""

CLASSES: MappingProxyType[str, ShapeKind] = MappingProxyType(
    {name: kind for kind in KINDS for name in kind.classes}
)
"""All classes with the kind of each."""


def kind_of(code: IntArray) -> ShapeKind:
    """Return the kind of a shape by its code."""
    return KINDS[int(code[KIND])]


def draw_shape(name: str, random: Random) -> FamilyShape:
    """Sample a shape of a class, standing at the origin, its yaw zero."""
    kind = CLASSES[name]
    code, theta = np.zeros(CODE_SIZE, np.int64), np.zeros(kind.size)
    code[KIND] = kind.number
    kind.classes[name](random, code, theta)
    return FamilyShape(name, code, theta)


_UNNAMED = {"knob": 2.0, "vase": 2.0}
"""Rarity of classes that hold any round shape: what has a name of its own is seen more often."""

_SAMPLE = 40


def rarity(shape: FamilyShape) -> float:
    """Compute the natural logarithm of how much rarer a combination of parts is than an ordinary one."""
    code = shape.code
    apart = (np.array(codes_of(shape.name)) != code).astype(np.float64)
    apart[:, HOLLOW] *= limits.SOLID_RARITY / limits.PART_RARITY
    price = limits.PART_RARITY * float(apart.sum(axis=1).min()) + _UNNAMED.get(shape.name, 0.0)
    return price + kind_of(code).rarity(code, shape.theta, not apart[:, HOLLOW].any())


@lru_cache(maxsize=64)
def codes_of(name: str) -> tuple[tuple[int, ...], ...]:
    """Return kinds and combinations of parts that samples of a class have."""
    random = np.random.default_rng(0)
    found = {tuple(int(part) for part in draw_shape(name, random).code) for _ in range(_SAMPLE)}
    return tuple(sorted(found))


DRAWS = 200
"""Samples of each class whose sizes are compared."""


def rarity_of_size(shape: FamilyShape) -> float:
    """Compute the natural logarithm of how much rarer the width and height of a shape are in its class.

    A sample is scaled to the readings and then fitted: a stemmed glass as low and wide as a bowl is no glass.
    Student's density of two numbers, about those of the class (tuned on 24 development runs).
    """
    middle, precision = _ordinary(shape.name)
    off = np.log(kind_of(shape.code).extent(shape.code, shape.theta)) - middle
    return float(0.5 * (limits.SIZE_TAIL + 2.0) * np.log1p(off @ precision @ off / limits.SIZE_TAIL))


@lru_cache(maxsize=64)
def _ordinary(name: str) -> tuple[FloatArray, FloatArray]:
    """Return ``(2,)`` mean log width and log height of a class, and ``(2, 2)`` their precision."""
    random = np.random.default_rng(1)
    shapes = [draw_shape(name, random) for _ in range(DRAWS)]
    kind = CLASSES[name]
    sizes = np.log([kind.extent(shape.code, shape.theta) for shape in shapes])
    spread = np.cov(sizes.T) + limits.SIZE_SPREAD**2 * np.eye(2)
    return np.asarray(sizes.mean(axis=0)), np.asarray(np.linalg.inv(spread))
