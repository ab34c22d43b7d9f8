"""The last lessons of tiny networks: pictures, drawn anew round after round; resumed exactly.

The last stage of ObjectFolder 2.0 (Gao et al., CVPR 2022, section 4.1) and of KiloNeRF (Reiser et al., ICCV
2021, section 3.2). Here what the surface teaches goes on beside, so that what no picture shows is kept.
"""

from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

import numpy as np

from harness.authoring.checkpoint import TrainingProgress, read_checkpoint, write_checkpoint
from harness.authoring.vision.cell_lessons import CellLessons
from harness.authoring.vision.cells import CellTraining, by_threads, seed_of, teach_cell
from harness.authoring.vision.finish_profiles import CellsFinish
from harness.authoring.vision.pixels import pixel_lessons
from harness.authoring.vision.seen import Exact, RayRecorder, SeenRays, together
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import VisionModel

VERSION = 1
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""


class CellFinishing:
    """A training that can stop after any round and go on, bit for bit, with any number of threads.

    Args:
        taught: by the surface, to its end; its networks are finished.
        finish: of this stage.
        mesh: of the object, in metres.
        pictures: to learn from.
    """

    def __init__(
        self, taught: CellTraining, finish: CellsFinish, mesh: Mesh, pictures: Sequence[Exact]
    ) -> None:
        self._taught, self._finish, self._mesh, self._pictures = taught, finish, mesh, pictures
        self.losses: list[float] = []
        self.epoch = 0
        self._identity = digest(
            [
                *("vision cells finish", VERSION, taught.identity, list(astuple(finish))),
                *(mesh.vertices, mesh.faces),
                *(part for _, _, exact in pictures for part in (exact.colour, exact.alpha)),
            ]
        )

    @property
    def epochs(self) -> int:
        """That it takes: rounds."""
        return self._finish.rounds

    @property
    def done(self) -> bool:
        """Whether all rounds were trained."""
        return self.epoch >= self.epochs

    def step_epoch(self) -> float:
        """Draw the pictures, and teach all cells what they miss; the mean of colours' errors, as roots."""
        taught, finish, size = self._taught, self._finish, self._taught.spec.size
        pixels = CellLessons(
            *(size, taught.grid, pixel_lessons(self._seen(), taught.scale), np.empty((0, 3), np.float32)),
            *(taught.spec.overlap, 0),
        )
        rate = taught.spec.rate * finish.slower * (1.0 - self.epoch / finish.rounds)

        def teach(cell: int) -> float:
            own = pixels.pixels(cell)
            places = taught.spec.batch - (round(finish.share * taught.spec.batch) if len(own.weight) else 0)
            drawn = seed_of(taught.seed, 81, self.epoch, cell)
            return teach_cell(
                *(taught.flats[cell], taught.spec, taught.by_cell.lesson(cell), own, places),
                *(finish.steps, rate, drawn),
            )

        self.losses.append(float(np.mean(by_threads(teach, range(len(taught.grid)), taught.threads))))
        self.epoch += 1
        return self.losses[-1]

    def finish(self) -> VisionModel:
        """The networks, in float16."""
        return self._taught.finish()

    def save(self, path: Path) -> None:
        """Write a checkpoint, whole or not at all."""
        progress = TrainingProgress(self.epoch, self.losses)
        write_checkpoint(path, self._identity, progress, {"flats": self._taught.flats})

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, pictures or seed.
        """
        progress, arrays = read_checkpoint(path, self._identity)
        self.epoch, self.losses = progress.epoch, progress.losses
        self._taught.flats[:] = arrays["flats"]

    def _seen(self) -> SeenRays:
        """The pictures' rays, as the networks answer them now."""
        recorder = RayRecorder(vision_graph(self._taught.finish()).SerializeToString(), self._mesh)
        return together([recorder.seen(*each) for each in self._pictures])
