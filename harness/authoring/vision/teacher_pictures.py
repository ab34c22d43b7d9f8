"""Pictures of an object by one large network, along the same rays and samples as by its tiny ones."""

from collections.abc import Callable

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import NetworkSize, VisionGrid, VisionModel, VisionWeights
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.samples import Asker, Samples, Scene
from harness.objectfile.vision.settings import VisionLevel
from harness.objectfile.vision_tensors import Kind

Answers = Callable[[FloatArray, AnyArray, AnyArray, AnyArray], tuple[AnyArray, AnyArray]]
"""Of places, views, lights and extras: densities, and linear colours."""

_BLOCK = 256


class TeacherRenderer(VisionRenderer):
    """Outline, shell, march and compositing of ``VisionRenderer``; another network answers.

    Args:
        ask: the network.
        mesh: of the object, in metres.
        grid: cells that its lattice has.
        kind: what the network is told.
        density_scale: 1/m of a density of 1.
        threads: None for as many as the process has cores.

    Attributes:
        teacher: asks the network.
    """

    def __init__(
        self,
        ask: Answers,
        mesh: Mesh,
        grid: VisionGrid,
        kind: Kind,
        density_scale: float,
        threads: int | None = None,
    ) -> None:
        stand_in = vision_graph(_without_weights(grid, kind, density_scale))
        super().__init__(stand_in.SerializeToString(), mesh, threads)
        self.teacher = TeacherAsker(ask, grid)

    def _asker(self, level: VisionLevel) -> Asker:  # noqa: ARG002
        return self.teacher


class TeacherAsker:
    """As ``vision_samples.Asker``.

    Args:
        ask: the network.
        grid: of cells that samples are placed in.
    """

    block = _BLOCK

    def __init__(self, ask: Answers, grid: VisionGrid) -> None:
        self._ask, self._grid = ask, grid

    def light(self, light: FloatArray) -> None:
        """Nothing is to be got ready."""

    def __call__(self, samples: Samples, order: AnyArray, blocks: AnyArray, scene: Scene) -> None:  # noqa: ARG002
        """As ``Asker``; samples need no order."""
        rays, points = samples.rays[order // samples.most], samples.points(order, self._grid)
        lights = np.tile(scene.light.astype(np.float32), (len(order), 1))
        density, colour = self._ask(points, scene.views[rays], lights, scene.extras[rays])
        samples.density[order], samples.scattered[order] = np.maximum(density, 0.0), colour


def _without_weights(grid: VisionGrid, kind: Kind, density_scale: float) -> VisionModel:
    """Networks that are never asked: the renderer reads grid, kind and scale of them."""
    size = NetworkSize(width=8, octaves=0, turns=0, kind=kind)
    empty = {name: np.zeros((len(grid), *shape)) for name, shape in size.shapes.items()}
    return VisionModel(grid, VisionWeights(size, density_scale, **empty).rounded())
