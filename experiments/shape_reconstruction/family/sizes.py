"""How large things of a class are, and in which proportions: laying a draw on the readings leaves it free."""

from functools import lru_cache

import numpy as np

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape, draw_shape
from experiments.shape_reconstruction.family.layout import BENT, CORED, FLAT_SIDED, KNOTS, LOOP, SUPER, TOOL
from harness.basics.arrays import FloatArray, IntArray

DRAWS = 200
"""Of each class, whose sizes are taken."""

OWN = 0.15
"""Logarithm that a size differs by beside: draws end at makers' lists, things do not."""

TAIL = 4.0
"""Degrees of freedom of sizes: the fewer, the less odd is one far from all draws."""


def size_of(code: IntArray, theta: FloatArray) -> tuple[float, float]:
    """M: half the width and the height of a shape, roughly."""
    kind = int(code[layout.KIND])
    if kind == TOOL:
        return 0.5 * float(np.exp(theta[layout.LENGTH])), 2.0 * float(np.exp(theta[layout.HEAD_THICK]))
    if kind == BENT:
        girth = float(np.exp(theta[layout.GIRTHS + 2]))
        return 0.5 * float(np.exp(theta[layout.ARC])), 2.0 * girth
    half = float(np.exp(theta[layout.RADII : layout.RADII + KNOTS].max()))
    if code[layout.PLAN] == CORED:
        half += 0.7 * float(np.exp(theta[layout.CORE_X]) + np.exp(theta[layout.CORE_Y]))
    if code[layout.PLAN] in (SUPER, FLAT_SIDED):
        half *= 0.5 * (1.0 + float(np.exp(theta[layout.ACROSS])))
    if code[layout.LIMB] == LOOP:
        half += 0.35 * float(np.exp(theta[layout.LIMB_REACH]))
    return half, float(np.exp(theta[layout.HEIGHT]))


def rarity_of_size(shape: FamilyShape) -> float:
    """Natural logarithm of how much rarer a thing of a class's width and height is than an ordinary one.

    A draw is scaled to what was seen, and then fitted: a stemmed glass as low and wide as a bowl, which fits
    a bowl's outline and a press at its rim, is none. By Student's density of two numbers, about the class's.
    Of 24 development runs answers by 4 presses and a picture are 1.66 mm off without it and 1.62 with it, and
    by 8 and 32 the same.
    """
    middle, precision = _ordinary(shape.name)
    off = np.log(size_of(shape.code, shape.theta)) - middle
    return float(0.5 * (TAIL + 2.0) * np.log1p(off @ precision @ off / TAIL))


@lru_cache(maxsize=64)
def _ordinary(name: str) -> tuple[FloatArray, FloatArray]:
    """``(2,)`` middle of the logarithms of a class's widths and heights, ``(2, 2)`` their precision."""
    random = np.random.default_rng(1)
    shapes = [draw_shape(name, random) for _ in range(DRAWS)]
    sizes = np.log([size_of(shape.code, shape.theta) for shape in shapes])
    spread = np.cov(sizes.T) + OWN**2 * np.eye(2)
    return np.asarray(sizes.mean(axis=0)), np.asarray(np.linalg.inv(spread))
