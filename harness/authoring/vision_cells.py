"""The tiny networks of an object, trained cell by cell; what was trained is kept and never trained again."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import astuple
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from harness.arrays import AnyArray, FloatArray, IntArray
from harness.authoring.vision_kernels import Lesson, batch_of, encode, teach
from harness.authoring.vision_layers import (
    first_weights,
    layer_shapes,
    layers_of,
    octave_factors,
    parameter_count,
    weights_of,
)
from harness.authoring.vision_lessons import Lessons
from harness.authoring.vision_profiles import CellsSpec
from harness.cores import own_cores
from harness.errors import DataRefused
from harness.objectfile.vision_network import VisionGrid, VisionModel
from harness.store import digest

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
        self._spec, self._grid, self._lamps = spec, grid, lamps
        self._lessons, self._scale, self._seed = lessons, density_scale, seed
        self._threads = own_cores() if threads is None else threads
        self._begin = first_weights(spec.size, seed)
        self._flats = np.zeros((len(grid), parameter_count(spec.size)), np.float32)
        self.losses: list[float] = []
        self.epoch = 0
        self._taught: Callable[[int], IntArray] = _by_cell(grid, lessons.points, spec)
        self._identity = digest(
            [
                *("vision cells", VERSION, list(astuple(spec)), seed, grid.low, grid.cell, grid.cells),
                *(lessons.points, lessons.normals, lessons.colours, lessons.lamps, lamps, density_scale),
            ]
        )

    @property
    def epochs(self) -> int:
        """That it takes."""
        return -(-len(self._grid) // _AT_ONCE)

    @property
    def done(self) -> bool:
        """Whether all cells were trained."""
        return self.epoch >= self.epochs

    def step_epoch(self) -> float:
        """Train the next cells; the mean of their colours' errors, as roots of linear light."""
        first = self.epoch * _AT_ONCE
        cells = range(first, min(first + _AT_ONCE, len(self._grid)))
        with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(self._threads) as pool:
            found = list(pool.map(self._teach, cells))
        self.losses += found
        self.epoch += 1
        return float(np.mean(found))

    def finish(self) -> VisionModel:
        """The networks, in float16."""
        return VisionModel(self._grid, weights_of(self._flats, self._spec.size, self._scale))

    def save(self, path: Path) -> None:
        """Write a checkpoint, whole or not at all."""
        part = path.with_name(f".{path.name}.part")
        with part.open("wb") as stream:
            np.savez(
                stream,
                allow_pickle=False,
                identity=np.array(self._identity),
                losses=np.array(self.losses),
                epoch=np.array(self.epoch),
                flats=self._flats[: len(self.losses)],
            )
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(path)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, data or seed.
        """
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                held = {name: archive[name] for name in archive.files}
            identity, losses = str(held["identity"]), held["losses"].tolist()
            epoch, flats = int(held["epoch"]), held["flats"]
        except (OSError, ValueError, BadZipFile, EOFError, KeyError, TypeError, AttributeError) as error:
            raise DataRefused(
                f"checkpoint {path} cannot be read ({error}); delete it to begin anew"
            ) from error
        if identity != self._identity:
            raise DataRefused(
                f"checkpoint {path} is of another network, object, data or seed; "
                "delete it to begin anew, or build into another folder"
            )
        self.epoch, self.losses = epoch, losses
        self._flats[: len(flats)] = flats

    def _teach(self, cell: int) -> float:
        spec, size = self._spec, self._spec.size
        flat, slope = self._flats[cell], np.empty_like(self._begin)
        flat[:] = self._begin
        batch = batch_of(spec.batch, size.place, layer_shapes(size).told[0], size.width)
        turns = np.ones(size.turns, np.float32)
        loss = teach(
            *(flat, layers_of(flat, size), slope, layers_of(slope, size), self._lesson(cell), batch, turns),
            *(spec.steps, spec.rate, spec.hidden, spec.opacity, _seed_of(self._seed, cell)),
        )
        return float(loss)

    def _lesson(self, cell: int) -> Lesson:
        size, lessons, at = self._spec.size, self._lessons, self._taught(cell)
        place = local_places(self._grid, cell, lessons.points[at])
        encoded = np.empty((len(at), size.place), np.float32)
        encode(place, octave_factors(size), 0, encoded)
        return Lesson(
            *(encoded, self._told(at), lessons.normals[at], lessons.colours[at]),
            *(lessons.depth[at], lessons.weight[at], self._lamps),
        )

    def _told(self, at: IntArray) -> AnyArray:
        """What places with lamps of their own tell the later layer; nothing where lamps are drawn anew."""
        size, lessons = self._spec.size, self._lessons
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


def local_places(grid: VisionGrid, cell: int, points: FloatArray) -> AnyArray:
    """``(n, 3)`` float32: -1 to 1 in a cell, and on beyond its border."""
    within = 2.0 * ((points - grid.low) / grid.cell - grid.cells[cell]) - 1.0
    return np.asarray(within, np.float32)


def _by_cell(grid: VisionGrid, points: FloatArray, spec: CellsSpec) -> Callable[[int], IntArray]:
    """Which places each cell learns from: those in it, a little beyond its border, or the nearest."""
    owners, places = _owned((points - grid.low) / grid.cell, grid, spec.overlap)
    starts = np.searchsorted(owners, np.arange(len(grid) + 1))
    tree: list[cKDTree] = []

    def taught(cell: int) -> IntArray:
        own = places[starts[cell] : starts[cell + 1]]
        if len(own) >= spec.least:
            return own
        if not tree:
            tree.append(cKDTree(points))
        middle = grid.low + grid.cell * (grid.cells[cell] + 0.5)
        near = np.atleast_1d(tree[0].query(middle, min(spec.least, len(points)))[1])
        return np.union1d(own, near)

    return taught


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


def _seed_of(seed: int, cell: int) -> int:
    # Below 2^63, so that the compiled kernel takes it as the integer that it is.
    return int(np.random.SeedSequence([seed, 77, cell]).generate_state(1, np.uint64)[0] >> np.uint64(1))
