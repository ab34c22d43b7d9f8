"""The tiny networks of an object, trained cell by cell; what was trained is kept and never trained again."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from harness.authoring.vision.batch import batch_of
from harness.authoring.vision.cell_lessons import CellLessons
from harness.authoring.vision.kernels import teach
from harness.authoring.vision.layers import (
    first_weights,
    layer_shapes,
    layers_of,
    parameter_count,
    weights_of,
)
from harness.authoring.vision.lessons import Lessons
from harness.authoring.vision.profiles import CellsSpec
from harness.basics.arrays import AnyArray
from harness.basics.cores import own_cores
from harness.basics.errors import DataRefused
from harness.basics.files.foreign_file import refused_as
from harness.basics.npz_file import read_arrays, write_arrays
from harness.basics.store import digest
from harness.objectfile.vision.network import VisionGrid, VisionModel

VERSION = 2
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""

_AT_ONCE = 32
"""Cells between two checkpoints."""


class CellTraining:
    """A training that can stop after any of its epochs, each some cells, and go on, bit for bit.

    Nothing random has a state, and no cell depends on another: the same networks come of any number of
    threads.

    Args:
        spec: of the networks.
        grid: of the cells.
        lessons: what all learn from.
        lamps: ``(m, 3)`` float32, drawn anew at every step for networks that are told visibility and
            normal; ``(0, 3)`` where each lesson has a lamp of its own.
        density_scale: 1/m of a density of 1.
        seed: of first weights, and of what is drawn.
        threads: None for as many as the process has cores.
    """

    def __init__(
        self,
        spec: CellsSpec,
        grid: VisionGrid,
        lessons: Lessons,
        lamps: AnyArray,
        density_scale: float,
        seed: int,
        threads: int | None = None,
    ) -> None:
        self.spec, self.grid, self.scale, self.seed = spec, grid, density_scale, seed
        self.threads = own_cores() if threads is None else threads
        self.by_cell = CellLessons(spec.size, grid, lessons, lamps, spec.overlap, spec.least)
        """what each learns from."""
        self.flats = np.zeros((len(grid), parameter_count(spec.size)), np.float32)
        """``(networks, parameters)`` float32."""
        self.losses: list[float] = []  #: of the networks that were trained, in their order.
        self.epoch = 0  #: that is next.
        self.identity = digest(
            [
                *("vision cells", VERSION, list(astuple(spec)), seed, grid.low, grid.cell, grid.cells),
                *(lessons.points, lessons.normals, lessons.colours, lessons.lamps, lamps, density_scale),
            ]
        )
        """hash of all that the networks depend on."""
        self._begin = first_weights(spec.size, seed)

    @property
    def epochs(self) -> int:
        """That it takes."""
        return -(-len(self.grid) // _AT_ONCE)

    @property
    def done(self) -> bool:
        """Whether all cells were trained."""
        return self.epoch >= self.epochs

    def step_epoch(self) -> float:
        """Train the next cells; the mean of their colours' errors, as roots of linear light."""
        first = self.epoch * _AT_ONCE
        cells = range(first, min(first + _AT_ONCE, len(self.grid)))
        # The compiled training releases the interpreter lock, so threads run in parallel.
        with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(self.threads) as pool:
            found = list(pool.map(self._teach, cells))
        self.losses += found
        self.epoch += 1
        return float(np.mean(found))

    def finish(self) -> VisionModel:
        """The networks, in float16."""
        return VisionModel(self.grid, weights_of(self.flats, self.spec.size, self.scale))

    def save(self, path: Path) -> None:
        """Write a checkpoint, whole or not at all."""
        state = {"identity": np.array(self.identity), "epoch": np.array(self.epoch)}
        done = {"losses": np.array(self.losses), "flats": self.flats[: len(self.losses)]}
        write_arrays(path, {**state, **done})

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, data or seed.
        """
        begin_anew = "; delete it to begin anew"
        arrays = read_arrays(path, "a checkpoint", advice=begin_anew, refused=DataRefused)
        with refused_as(DataRefused, f"{path} does not read as a checkpoint: other arrays{begin_anew}"):
            identity, flats = str(arrays["identity"]), arrays["flats"]
            epoch, losses = int(arrays["epoch"]), arrays["losses"].tolist()
        if identity != self.identity:
            raise DataRefused(
                f"checkpoint {path} is of another network, object, data or seed; "
                "delete it to begin anew, or build into another folder"
            )
        self.epoch, self.losses = epoch, losses
        self.flats[: len(losses)] = flats

    def _teach(self, cell: int) -> float:
        spec, flat = self.spec, self.flats[cell]
        flat[:] = self._begin
        size, slope = spec.size, np.empty_like(flat)
        batch = batch_of(spec.batch, size.place, layer_shapes(size).told[0], size.width)
        # Below 2^63, so that the compiled kernel takes it as the integer that it is.
        state = np.random.SeedSequence([self.seed, 77, cell]).generate_state(1, np.uint64)[0]
        loss = teach(
            *(flat, layers_of(flat, size), slope, layers_of(slope, size), self.by_cell.lesson(cell), batch),
            *(np.ones(size.turns, np.float32), spec.steps, spec.rate, spec.hidden, spec.opacity),
            int(state >> np.uint64(1)),
        )
        return float(loss)
