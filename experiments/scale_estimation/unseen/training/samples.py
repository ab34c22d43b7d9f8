"""Samples of shapes of the families: strikes and ways of the gel, made in several processes."""

import sys
import time
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np

from experiments.scale_estimation.unseen import contact_set
from experiments.scale_estimation.unseen.ringing_shape import MODES, RingingShape
from experiments.scale_estimation.unseen.spectrogram import features
from experiments.scale_estimation.unseen.training.contact_samples import (
    TouchableShape,
    contact_sample,
    imprint_sample,
)
from experiments.scale_estimation.unseen.training.strike_samples import RATE, strike_responses
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import MATERIALS
from harness.basics.store import Store, default_folder, digest
from harness.basics.worker_pool import worker_pool
from harness.sim.solid.household.families import FAMILIES, draw
from harness.sim.solid.household.solid_grid import HouseholdSolid

SIZES = (0.05, 0.6)
"""M, least and greatest longest side; even in the logarithm."""

_SAID_EVERY = 10.0
"""S between lines of progress."""


@dataclass(frozen=True, eq=False)
class SizeSamples:
    """Readings of shapes of known size."""

    inputs: dict[str, AnyArray]  #: by their name in the graph, ``(n, ...)`` each.
    sizes: FloatArray  #: ``(n,)`` m.
    shapes: IntArray  #: ``(n,)`` number of the shape that each is of.

    def of(self, rows: AnyArray) -> "SizeSamples":
        """Some of them."""
        return SizeSamples({k: v[rows] for k, v in self.inputs.items()}, self.sizes[rows], self.shapes[rows])


SampleRow = tuple[dict[str, FloatArray], float]
"""Inputs by name, and the size in m."""


def shape_of(number: int, seed: int) -> HouseholdSolid:
    """The shapes of a seed by their number; families take turns."""
    return _drawn(number, np.random.default_rng((seed, number)))


def _drawn(number: int, random: np.random.Generator) -> HouseholdSolid:
    names = list(FAMILIES)
    return draw(names[number % len(names)], random)


def draw_size(random: np.random.Generator) -> float:
    """M, even in its logarithm."""
    return float(np.exp(random.uniform(*np.log(SIZES))))


def ringing_of(number: int, seed: int) -> RingingShape | None:
    """Its modes, from the store where they were solved before; None where they cannot be solved."""
    random, store = np.random.default_rng((seed, number)), Store(default_folder())
    shape = _drawn(number, random)
    key = digest(["ringing shape", 1, MODES, shape.inside.nodes, shape.inside.cells, (seed, number)])
    stored = store.get(key)
    if isinstance(stored, dict):
        return RingingShape(stored["frequencies"], stored["amplitudes"])
    try:
        found = RingingShape.solved(shape, random)
    except MeshRefused:
        return None
    store.put(key, {"frequencies": found.frequencies, "amplitudes": found.amplitudes})
    return found


def strikes(seed: int, count: int, number: int) -> list[SampleRow]:
    """So many samples of strikes of one shape; none where its modes cannot be solved."""
    shape = ringing_of(number, seed)
    random, rows = np.random.default_rng((seed, number, 2)), []
    for _ in range(count if shape is not None else 0):
        assert shape is not None
        size, material = draw_size(random), str(random.choice(list(MATERIALS)))
        responses, band = strike_responses(shape, size, material, random)
        bands, extras = features(responses, RATE, band, MATERIALS[material])
        rows.append(({"bands": bands, "extras": extras}, size))
    return rows


_SET_INPUTS = ("ways", "kinds", "whole")
_Reading = Callable[[TouchableShape, float, np.random.Generator], tuple[FloatArray, ...]]


def _explored(shape: TouchableShape, size: float, random: np.random.Generator) -> tuple[FloatArray, ...]:
    return contact_set.features(contact_sample(shape, size, random))


def _imprinted(shape: TouchableShape, size: float, random: np.random.Generator) -> tuple[FloatArray, ...]:
    return contact_set.imprint_features(imprint_sample(shape, size, random))


def presses(reading: _Reading, stream: int, seed: int, count: int, number: int) -> list[SampleRow]:
    """So many sets of presses of one shape, as a network reads them; ``stream`` numbers their draws."""
    shape = TouchableShape.of(shape_of(number, seed))
    random, rows = np.random.default_rng((seed, number, stream)), []
    for _ in range(count):
        size = draw_size(random)
        rows.append((dict(zip(_SET_INPUTS, reading(shape, size, random), strict=True)), size))
    return rows


MAKERS: dict[str, Callable[[int, int, int], list[SampleRow]]] = {
    "sound": strikes,
    "touch": partial(presses, _explored, 3),
    "imprints": partial(presses, _imprinted, 4),
}


def samples_of(sense: str, shapes: int, each: int, seed: int, processes: int) -> SizeSamples:
    """SizeSamples of all shapes, in the shapes' order whatever the number of processes.

    Args:
        sense: of ``MAKERS``.
        shapes: how many.
        each: samples of each.
        seed: of shapes and samples.
        processes: that share the work.
    """
    return gathered(partial(MAKERS[sense], seed, each), shapes, processes, sense)


def gathered(make: Callable[[int], list[SampleRow]], shapes: int, processes: int, sense: str) -> SizeSamples:
    """The rows of all shapes by their number, in the shapes' order whatever the number of processes.

    Args:
        make: the rows of one shape; can be pickled.
        shapes: how many.
        processes: that share the work.
        sense: for lines of progress.
    """
    inputs: dict[str, list[FloatArray]] = {}
    sizes: list[float] = []
    numbers: list[int] = []
    with closing(_mapped(make, shapes, processes, sense)) as made:
        for number, rows in enumerate(made):
            for one, size in rows:
                for name, value in one.items():
                    inputs.setdefault(name, []).append(value.astype(np.float32))
                sizes.append(size)
                numbers.append(number)
    stacked: dict[str, AnyArray] = {name: np.stack(values) for name, values in inputs.items()}
    return SizeSamples(stacked, np.array(sizes), np.array(numbers))


def _mapped(
    make: Callable[[int], list[SampleRow]], shapes: int, processes: int, sense: str
) -> Generator[list[SampleRow]]:
    began = said = time.perf_counter()
    with worker_pool(processes) as pool:
        for number, rows in enumerate(pool.map(make, range(shapes), chunksize=4)):
            yield rows
            if (now := time.perf_counter()) - said > _SAID_EVERY:
                said = now
                left = (now - began) / (number + 1) * (shapes - number - 1)
                sys.stderr.write(f"{sense}: shape {number + 1} of {shapes}, {left:.0f} s left\n")
