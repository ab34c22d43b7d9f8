"""Sets of touches of drawn shapes, beside the whole of each."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.pcn.point_frame import TAKEN, PointFrame, taken
from experiments.shape_reconstruction.pcn.training.touched_shape import TouchedShape
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.mesh import Mesh
from harness.sim.solid.household.families import FAMILIES, draw
from harness.sim.solid.surface_samples import random_points

SIZES = (0.08, 0.28)
"""M, least and greatest longest side of a shape; even in its logarithm."""

PRESSES = (4, 40)
"""Fewest and most of a set."""

FEWEST = 60
"""Points of a set: fewer give no frame worth completing."""

WHOLE = 2048
"""Points all over each shape that an answer is compared with."""


@dataclass(frozen=True, eq=False)
class TouchSets:
    """What the network learns from; all in its own frame."""

    touched: AnyArray  #: ``(n, TAKEN, 3)`` float32.
    whole: AnyArray  #: ``(n, WHOLE, 3)`` float32, in the same frame as what was touched.
    reach: FloatArray  #: ``(n,)`` m for one of the frame's units.
    shapes: IntArray  #: ``(n,)`` number of the shape that each is of.

    def of(self, rows: AnyArray) -> "TouchSets":
        """Some of them."""
        return TouchSets(self.touched[rows], self.whole[rows], self.reach[rows], self.shapes[rows])


def shape_of(number: int, seed: int) -> TouchedShape:
    """The shapes of a seed by their number; families take turns."""
    random = np.random.default_rng((seed, number))
    names = list(FAMILIES)
    surface = draw(names[number % len(names)], random).surface
    size = float(np.exp(random.uniform(*np.log(SIZES))))
    return TouchedShape(Mesh(size * surface.vertices, surface.faces), number)


def touch_sets(shapes: int, each: int, seed: int) -> TouchSets:
    """So many sets of each of so many shapes; fewer of a shape that no sensor finds room about."""
    touched, whole, reach, numbers = [], [], [], []
    for number in range(shapes):
        shape, random = shape_of(number, seed), np.random.default_rng((seed, number, 2))
        everywhere = random_points(shape.mesh, WHOLE, random)[0]
        for _ in range(each):
            points = shape.touched(int(random.integers(PRESSES[0], PRESSES[1] + 1)), random)
            if len(points) < FEWEST:
                continue
            frame = PointFrame.of(points)
            touched.append(frame.inward(taken(points, number)).astype(np.float32))
            whole.append(frame.inward(everywhere).astype(np.float32))
            reach.append(frame.reach)
            numbers.append(number)
    empty = np.zeros((0, TAKEN, 3), np.float32)
    if not touched:
        return TouchSets(empty, np.zeros((0, WHOLE, 3), np.float32), np.zeros(0), np.zeros(0, np.int64))
    return TouchSets(np.stack(touched), np.stack(whole), np.array(reach), np.array(numbers))
