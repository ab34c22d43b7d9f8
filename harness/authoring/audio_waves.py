"""The small network of sound: one layer of plane waves and a linear layer solved exactly.

A shape of a mode is smooth at the scale of its wavelength, on thin walls too (the two sides of a
bent wall move alike but for its slope). Plane waves through space with normally distributed wave
vectors as long as the object's own are a basis for just such fields (Rahimi and Recht, Random Features
for Large-Scale Kernel Machines, NeurIPS 2007). Only the linear layer has to be found.
"""

from dataclasses import dataclass

import numpy as np

from harness.arrays import AnyArray, FloatArray, IntArray
from harness.authoring.audio_data import Samples
from harness.authoring.audio_readout import Readout, error_shares, solve_readout

REACHES = (0.7, 1.0, 1.4)
"""Standard deviations of the waves' vectors that are tried, of the object's wave number."""


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
    samples: Samples, measured: IntArray, number: float, width: int, seed: int, reaches: tuple[float, ...]
) -> FittedWaves:
    """The network of the reach that predicts best what it was not shown.

    Args:
        samples: to learn.
        measured: samples by which is chosen (``solve_readout``).
        number: rad/m, the object's wave number (``wave_number``).
        width: waves.
        seed: of their vectors and phases.
        reaches: that are tried, such as ``REACHES``.
    """
    targets = samples.shapes.reshape(len(samples.points), -1)
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    shift, factor = 0.5 * (low + high), 2.0 / float(np.linalg.norm(high - low))
    found = []
    for reach in reaches:
        vectors, phases = _waves(width, reach * number / factor, seed)
        empty = Waves(shift, factor, vectors, phases, np.zeros((width + 4, 0)))
        readout = solve_readout(empty.features, samples.points, targets, measured, error_shares(targets))
        network = Waves(shift, factor, vectors, phases, readout.weights)
        found.append(FittedWaves(network, reach, readout))
    return min(found, key=lambda one: one.readout.expected)


def _waves(width: int, spread: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """Vectors and phases that single precision holds exactly, so that the graph has the same waves."""
    random = np.random.default_rng([seed, 3])
    vectors = spread * random.standard_normal((3, width))
    return _single(vectors), _single(random.uniform(0.0, 2.0 * np.pi, width))


def _single(array: AnyArray) -> FloatArray:
    return np.asarray(array, np.float32).astype(np.float64)
