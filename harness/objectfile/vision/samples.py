"""Samples of a wave of rays, and two ways to ask the networks for what they are."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.runtime import Network
from harness.objectfile.vision.network.fold import FoldedWeights
from harness.objectfile.vision.network.kernels import ask_blocks
from harness.objectfile.vision.network.network import VisionGrid
from harness.objectfile.vision.network.tiles import SAMPLES
from harness.objectfile.vision.query import fill_asked, take_answers
from harness.objectfile.vision.threads import Workspace

_AT_ONCE = 48
"""Blocks in a run of the graph: what it computes between then stays in the second cache."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Of rays, ``most`` places each; places that are not filled have no meaning.

    Attributes:
        rays: ``(n,)`` int32, which go on.
        most: places of each.
        counts: ``(n,)`` int32, filled ones.
        networks: ``(n * most,)`` int32, -1 where none answers.
        local: ``(n * most, 3)`` float32, in the cell.
        lengths: ``(n * most,)`` float32 m.
        places: ``(n * most,)`` float32 m along the ray.
        density: ``(n * most,)`` float32, answered, in units of the weights' scale.
        scattered: ``(n * most, 3)`` float32, answered.
    """

    rays: AnyArray
    most: int
    counts: AnyArray
    networks: AnyArray
    local: AnyArray
    lengths: AnyArray
    places: AnyArray
    density: AnyArray
    scattered: AnyArray

    @classmethod
    def room_for(cls, rays: AnyArray, most: int, room: Workspace) -> "Samples":
        """Places for samples, not filled."""
        count = len(rays) * most
        flat = {
            name: room.take(name, (count,), kind)
            for name, kind in (
                *(("networks", np.int32), ("lengths", np.float32)),
                *(("places", np.float32), ("density", np.float32)),
            )
        }
        wide = {name: room.take(name, (count, 3), np.float32) for name in ("local", "scattered")}
        return cls(rays, most, room.take("counts", (len(rays),), np.int32), **flat, **wide)

    def points(self, order: AnyArray, grid: VisionGrid) -> FloatArray:
        """``(n, 3)`` m, object frame, of the samples in ``order``, each in the cell that answers it."""
        local = self.local[order].astype(np.float64)
        points: FloatArray = grid.low + grid.cell * (grid.cells[self.networks[order]] + 0.5 * (local + 1.0))
        return points


@dataclass(frozen=True, eq=False)
class Scene:
    """What all samples of a picture have in common.

    Attributes:
        views: ``(r, 3)`` float32 unit, of each ray.
        extras: ``(r, 0)`` or ``(r, 4)`` float32, of each ray.
        light: ``(3,)`` unit, towards the lamp.
    """

    views: AnyArray
    extras: AnyArray
    light: FloatArray


class Asker(Protocol):
    """Answers samples that were sorted into blocks."""

    block: int

    def light(self, light: FloatArray) -> None:
        """Get ready for a lamp's direction, before samples are asked under it."""

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        """Fill in ``density`` and ``scattered`` of the samples in ``order``."""


class FusedAsker:
    """By the kernel that does all layers of a block at once.

    Args:
        weights: folded.
    """

    block = SAMPLES

    def __init__(self, weights: FoldedWeights) -> None:
        self._weights = weights
        self._light: FloatArray | None = None
        self._lit: AnyArray = weights.bias

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        """As ``Asker``."""
        weights = self._weights
        ask_blocks(
            *(blocks, order, samples.local, samples.rays, samples.most),
            *(weights.seen(scene.views), scene.extras, weights.packed, self._lit),
            *(weights.size.octaves, weights.size.turns, samples.density, samples.scattered),
        )

    def light(self, light: FloatArray) -> None:
        """As ``Asker``: a bias of every network, if the lamp has moved."""
        if self._light is None or not np.array_equal(light, self._light):
            self._light, self._lit = light.copy(), self._weights.lit(light)


class GraphAsker:
    """By the file's graph alone.

    Args:
        network: opened.
        grid: of its networks.
        scale: 1/m, of its densities.
        block: samples that it takes together.
    """

    def __init__(self, network: Network, grid: VisionGrid, scale: float, block: int) -> None:
        self._network, self._grid, self._scale, self.block = network, grid, scale, block

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        """As ``Asker``."""
        for begin in range(0, len(blocks), _AT_ONCE):
            self._ask(samples, order, blocks[begin : begin + _AT_ONCE], scene)

    def light(self, light: FloatArray) -> None:
        """As ``Asker``: the graph is told of it with every block."""

    def _ask(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:
        grid, shape = self._grid, (len(blocks), self.block)
        asked: dict[str, AnyArray] = {
            "network": np.empty((len(blocks), 1), np.int64),
            "points": np.empty((*shape, 3)),
            "views": np.empty((*shape, 3), np.float32),
            "light": np.tile(scene.light.astype(np.float32), (len(blocks), 1)),
        }
        told = np.empty((*shape, scene.extras.shape[1]), np.float32)
        fill_asked(
            *(blocks, order, samples.local, samples.rays, samples.most, grid.low, grid.cell, grid.cells),
            *(scene.views, scene.extras, asked["network"], asked["points"], asked["views"], told),
        )
        found = self._network(asked | ({"extras": told} if told.shape[2] else {}))
        take_answers(
            *(blocks, order, found["density"], found["scattered"], self._scale),
            *(samples.density, samples.scattered),
        )
