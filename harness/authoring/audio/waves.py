"""The small network of sound: one layer of plane waves and a linear layer solved exactly.

A shape of a mode is smooth at the scale of its wavelength, on thin walls too (the two sides of a
bent wall move alike but for its slope). Plane waves through space with random wave vectors as long as
the object's own are a basis for just such fields (Rahimi and Recht, Random Features for Large-Scale
Kernel Machines, NeurIPS 2007). Only the linear layer has to be found.

Vectors fill a ball evenly: a shape has few parts beyond the waves of its own frequency, and waves that
no shape needs are waves that others lack. Normally distributed ones err a little more.
"""

from dataclasses import dataclass

import numpy as np

from harness.authoring.audio.data import SoundSamples
from harness.authoring.audio.profiles import WavesSpec
from harness.authoring.audio.readout import Readout, error_shares, solve_readout
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.graph import Storage

ENOUGH = 0.01
"""Mean relative error that is foretold at which waves are no longer doubled: a third of the most that a
median may be."""

_BALL = 5.0**0.5
"""Radius of a ball, of the standard deviation of its places along an axis."""


@dataclass(frozen=True, eq=False)
class Waves:
    """``[sin(p v + phase), p, 1] @ weights`` at ``p = (point - shift) * factor``.

    Attributes:
        shift: ``(3,)`` m.
        factor: 1/m.
        vectors: ``(3, d)``.
        phases: ``(d,)`` rad.
        weights: ``(d + 4, 3 m)`` 1/sqrt(kg); number ``3 i + axis`` belongs to mode ``i``.
    """

    shift: FloatArray
    factor: float
    vectors: FloatArray
    phases: FloatArray
    weights: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """``(k, m, 3)``: the sum in double precision, to compare a graph with."""
        shapes: FloatArray = (self.features(points) @ self.weights).reshape(len(points), -1, 3)
        return shapes

    def features(self, points: FloatArray) -> AnyArray:
        """``(k, d + 4)`` in single precision as the graph has them, so that the readout allows for it."""
        place = ((points - self.shift) * self.factor).astype(np.float32)
        waves = np.sin(place @ self.vectors.astype(np.float32) + self.phases.astype(np.float32))
        return np.concatenate([waves, place, np.ones((len(points), 1), np.float32)], axis=1)


@dataclass(frozen=True, eq=False)
class FittedWaves:
    """A network and how it was chosen.

    Attributes:
        network: the best of the reaches tried.
        reach: of its waves' vectors.
        readout: of its linear layer.
    """

    network: Waves
    reach: float
    readout: Readout


def fit_waves(
    samples: SoundSamples,
    measured: IntArray,
    number: float,
    width: int,
    seed: int,
    reaches: tuple[float, ...],
    storage: Storage = "float32",
) -> FittedWaves:
    """The network of the reach that predicts best what it was not shown.

    Args:
        samples: to learn.
        measured: samples by which is chosen (``solve_readout``).
        number: rad/m, the object's wave number (``wave_number``).
        width: waves.
        seed: of their vectors and phases.
        reaches: that are tried, such as ``audio_profiles.REACHES``.
        storage: of the linear layer in the file.
    """
    targets = samples.shapes.reshape(len(samples.points), -1)
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    shift, factor = 0.5 * (low + high), 2.0 / float(np.linalg.norm(high - low))
    found = []
    for reach in reaches:
        vectors, phases = _waves(width, reach * number / factor, seed)
        empty = Waves(shift, factor, vectors, phases, np.zeros((width + 4, 0)))
        shares = error_shares(targets)
        readout = solve_readout(empty.features, samples.points, targets, measured, shares, storage)
        network = Waves(shift, factor, vectors, phases, readout.weights)
        found.append(FittedWaves(network, reach, readout))
    return min(found, key=lambda one: one.readout.expected)


def fit_enough_waves(
    samples: SoundSamples, measured: IntArray, number: float, spec: WavesSpec, seed: int
) -> FittedWaves:
    """As ``fit_waves``; with twice the waves while the error foretold is above ``ENOUGH``.

    Twice the waves reach farther by the square root of two at the same density on a surface, so that
    this is tried beside the reach that was best before.

    Args:
        samples: to learn.
        measured: samples by which is chosen.
        number: rad/m, the object's wave number.
        spec: how many waves, how they are stored, and what reaches are tried of the fewest.
        seed: of vectors and phases.
    """
    width = spec.width
    best = fit_waves(samples, measured, number, width, seed, spec.reaches, spec.storage)
    while best.readout.expected > ENOUGH and (width := 2 * width) <= spec.widest:
        reaches = (best.reach, 2.0**0.5 * best.reach)
        wider = fit_waves(samples, measured, number, width, seed, reaches, spec.storage)
        best = min(best, wider, key=lambda one: one.readout.expected)
    return best


def _waves(width: int, spread: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Vectors and phases that single precision holds exactly, so that the graph has the same waves."""
    random = np.random.default_rng([seed, 3])
    ways = random.standard_normal((3, width))
    lengths = _BALL * spread * random.uniform(size=width) ** (1.0 / 3.0)
    vectors = ways * (lengths / np.linalg.norm(ways, axis=0))
    return _single(vectors), _single(random.uniform(0.0, 2.0 * np.pi, width))


def _single(array: AnyArray) -> FloatArray:
    return np.asarray(array, np.float32).astype(np.float64)
