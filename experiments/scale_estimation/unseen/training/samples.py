"""Samples of shapes of the families: strikes and ways of the gel, made in several processes."""

import sys
import time
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.signal import fftconvolve

from experiments.scale_estimation.unseen import contact_set
from experiments.scale_estimation.unseen.spectrogram import features
from experiments.scale_estimation.unseen.training.contact_samples import (
    TouchableShape,
    contact_sample,
    imprint_sample,
)
from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.errors import MeshRefused
from harness.basics.materials import MATERIALS, Material
from harness.basics.store import Store, default_folder, digest
from harness.basics.worker_pool import worker_pool
from harness.sim.modal.modal import solve_modes
from harness.sim.modal.modes import dampings
from harness.sim.solid.household.families import FAMILIES, HouseholdSolid, draw
from harness.sim.solid.tetrahedra import Tetrahedra
from harness.sim.sound.modal_sound import radiation
from harness.sim.sound.synthesis import synthesize
from harness.strikes.spectra import Analysis

SOLVED_AT = 0.2
"""M, the longest side at which modes are solved."""

SOLVED_OF = MATERIALS["ceramic"]

MODES = 60
"""Number of solved modes; higher modes are extrapolated at the same spacing."""

PLACES = 150
"""Number of surface points that may be struck."""

_MICROPHONE = 0.5
_SPACED_BY = 20


@dataclass(frozen=True, eq=False)
class RingingShape:
    """The modes of a shape, ``SOLVED_AT`` long and ``SOLVED_OF``."""

    frequencies: FloatArray  #: ``(m,)`` Hz, ascending.
    amplitudes: FloatArray
    """``(PLACES, m)`` Pa / (N s): gain along the normal of a struck place times radiation."""

    @classmethod
    def solved(cls, shape: HouseholdSolid, random: np.random.Generator) -> "RingingShape":
        """From a body one long.

        Raises:
            MeshRefused: its modes cannot be solved.
        """
        inside = Tetrahedra(read_only(shape.inside.nodes * SOLVED_AT), shape.inside.cells)
        modes = solve_modes(inside, SOLVED_OF, limit=np.inf, most=MODES)
        struck = random.integers(len(modes.points), size=PLACES)
        gains = np.einsum("nmd,nd->nm", modes.shapes[struck], modes.normals[struck])
        return cls(read_only(modes.frequencies.copy()), read_only(gains * radiation(modes, _MICROPHONE)))

    def at(
        self, size: float, material: Material, highest: float, random: np.random.Generator
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``(m,)`` Hz, ``(m,)`` 1/s and ``(PLACES, m)`` Pa / (N s) of an object of that size and material.

        Above the modes that were solved others follow at the spacing of the last ones, with the amplitudes
        of one of those each: the modes of a thin wall have one spacing all over.

        Args:
            size: m, its longest side.
            material: of it.
            highest: Hz, up to which modes are given.
            random: draws those that were not solved.
        """
        scale = material.speed / SOLVED_OF.speed * SOLVED_AT / size
        louder = SOLVED_OF.density / material.density * (SOLVED_AT / size) ** 2
        frequencies, amplitudes = self.frequencies * scale, self.amplitudes * louder
        last = frequencies[-_SPACED_BY:]
        spacing = (last[-1] - last[0]) / (_SPACED_BY - 1)
        more = max(0, int((highest - frequencies[-1]) / spacing))
        if more:
            above = frequencies[-1] + np.cumsum(spacing * random.exponential(1.0, more))
            like = amplitudes[:, random.integers(len(frequencies) - _SPACED_BY, len(frequencies), more)]
            sign = random.choice([-1.0, 1.0], (len(amplitudes), more))
            frequencies = np.append(frequencies, above)
            amplitudes = np.hstack([amplitudes, like * sign])
        kept = frequencies < highest
        return frequencies[kept], dampings(frequencies[kept], material), amplitudes[:, kept]


RATE = 32e3
"""Sampling rate in Hz."""

STRIKES = 3
SPEED_ERROR = 0.04
"""Relative error of sqrt(E / density) and of the wall thickness, common to all modes."""

MODE_ERROR = 0.01
"""Relative error of the frequency of each mode."""

EXCITED = (5.0e3, 12.0e3)
"""Range in Hz of the upper limit of a hammer's excitation; it depends on the tip and the surface."""

REVERBERANT = (-18.0, 0.0)
"""DB of the room's sound against the direct."""

ECHOES = (0.12, 0.4)
"""S, in which the room's sound falls by 60 dB."""


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


def strike_responses(
    shape: RingingShape, size: float, material: str, random: np.random.Generator
) -> tuple[FloatArray, tuple[float, float]]:
    """``(k, t)`` Pa/(N s) of up to ``STRIKES`` strikes at ``RATE``, and the band in Hz that they excited."""
    made_of = MATERIALS[material]
    highest = float(np.exp(random.uniform(*np.log(EXCITED))))
    seeming = size * float(np.exp(SPEED_ERROR * random.standard_normal()))
    frequencies, decays, amplitudes = shape.at(seeming, made_of, min(highest, 0.45 * RATE), random)
    count = STRIKES if random.random() < 0.5 else int(random.integers(1, STRIKES + 1))
    struck = amplitudes[random.choice(PLACES, count, replace=False)]
    # A place that is nearly still for a mode moves a little all the same: the tip is wide, the wall uneven.
    struck = struck + 0.1 * np.sqrt((amplitudes**2).mean(axis=0)) * random.standard_normal(struck.shape)
    settings = Analysis()
    if len(frequencies):
        frequencies = frequencies * np.exp(MODE_ERROR * random.standard_normal(len(frequencies)))
        decays = decays * np.exp(0.3 * random.standard_normal()) + settings.decay
        responses = synthesize(frequencies, decays, struck, settings.duration, RATE).sound
    else:
        responses = np.zeros((count, round(settings.duration * RATE)))
    return in_a_room(np.asarray(responses), random), (settings.lowest, highest)


def in_a_room(responses: FloatArray, random: np.random.Generator) -> FloatArray:
    """``(k, t)`` with a room's sound and a microphone's noise beside what came directly."""
    ratio, lasting = 10.0 ** (random.uniform(*REVERBERANT) / 20.0), random.uniform(*ECHOES)
    samples = round(lasting * RATE)
    tail = random.standard_normal(samples) * np.exp(-6.9 * np.arange(samples) / samples)
    room = np.append(1.0, ratio * tail / np.linalg.norm(tail))
    heard = fftconvolve(responses, room[None], axes=1)[:, : responses.shape[1]]
    noise = 10.0 ** random.uniform(-4.5, -2.5) * max(float(np.abs(heard).max()), 1e-12)
    fading = np.exp(-Analysis().decay * np.arange(heard.shape[1]) / RATE)
    return np.asarray(heard + noise * fading * random.standard_normal(heard.shape))
