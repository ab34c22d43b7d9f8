"""The tiny networks of an object, trained cell by cell; what was trained is kept and never trained again."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from harness.authoring.vision.kernels import Lesson, batch_of, encode, teach
from harness.authoring.vision.layers import (
    first_weights,
    layer_shapes,
    layers_of,
    octave_factors,
    parameter_count,
    weights_of,
)
from harness.authoring.vision.lessons import Lessons
from harness.authoring.vision.profiles import CellsSpec
from harness.basics.arrays import AnyArray, FloatArray, IntArray
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
        self.by_cell = CellLessons(spec, grid, lessons, lamps)
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


class CellLessons:
    """Training samples by cell: the points in it and near its border, or the nearest if those are few."""

    def __init__(self, spec: CellsSpec, grid: VisionGrid, lessons: Lessons, lamps: AnyArray) -> None:
        self._size, self._grid, self._lessons, self._lamps = spec.size, grid, lessons, lamps
        self._least = spec.least
        owners, self._places = _owned((lessons.points - grid.low) / grid.cell, grid, spec.overlap)
        self._starts = np.searchsorted(owners, np.arange(len(grid) + 1))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._lessons.points)

    def lesson(self, cell: int) -> Lesson:
        """Gather the training samples of a cell."""
        lessons, grid = self._lessons, self._grid
        at = self._places[self._starts[cell] : self._starts[cell + 1]]
        if len(at) < self._least:
            middle = grid.low + grid.cell * (grid.cells[cell] + 0.5)
            near = self._tree.query(middle, min(self._least, len(lessons)))[1]
            at = np.union1d(at, np.atleast_1d(near))
        return Lesson(
            *(self._encoded(cell, at), self._told(at), lessons.normals[at], lessons.colours[at]),
            *(lessons.depth[at], lessons.weight[at], self._lamps),
        )

    def _encoded(self, cell: int, at: IntArray) -> AnyArray:
        # -1 to 1 in a cell, and on beyond its border.
        grid, points = self._grid, self._lessons.points[at]
        place = np.asarray(2.0 * ((points - grid.low) / grid.cell - grid.cells[cell]) - 1.0, np.float32)
        encoded = np.empty((len(at), self._size.place), np.float32)
        encode(place, octave_factors(self._size), 0, encoded)
        return encoded

    def _told(self, at: IntArray) -> AnyArray:
        """Return the input of the second layer from points with fixed lights; empty if lights are sampled."""
        size, lessons = self._size, self._lessons
        if not lessons.lamps.shape[1]:
            return np.empty((len(at), 0), np.float32)
        told = np.empty((len(at), layer_shapes(size).told[0]), np.float32)
        ones, first = np.ones(size.turns, np.float32), 0
        if size.kind == "osf":
            encode(lessons.views[at], ones, first, told)
            first = size.direction
        encode(lessons.lamps[at], ones, first, told)
        if size.extras:
            told[:, first + size.direction :] = np.hstack([lessons.seen[at], lessons.normals[at]])
        return told


def _owned(scaled: FloatArray, grid: VisionGrid, overlap: float) -> tuple[IntArray, IntArray]:
    """Cells, ascending, and the places that are within ``overlap`` of each."""
    least, most = (np.floor(scaled + by).astype(np.int64) for by in (-overlap, overlap))
    owners, places = [], []
    for corner in np.ndindex(2, 2, 2):
        further = np.array(corner, np.bool_)
        # A place that is near no border along an axis is counted once.
        cells = np.where(further, most, least)
        there = np.flatnonzero(np.all(~further | (most != least), axis=1))
        inside = there[np.all((cells[there] >= 0) & (cells[there] < grid.shape), axis=1)]
        network = grid.table[tuple(cells[inside].T)]
        owners.append(network[network >= 0])
        places.append(inside[network >= 0])
    owner, place = np.concatenate(owners), np.concatenate(places)
    order = np.lexsort((place, owner))
    return owner[order].astype(np.int64), place[order]
