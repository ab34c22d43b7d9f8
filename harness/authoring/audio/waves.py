"""The small network of sound: one layer of plane waves and a linear layer solved exactly.

A shape of a mode is smooth at the scale of its wavelength, on thin walls too (the two sides of a
bent wall move alike but for its slope). Plane waves through space with random wave vectors as long as
the object's own are a basis for just such fields (Rahimi and Recht, Random Features for Large-Scale
Kernel Machines, NeurIPS 2007). Only the linear layer has to be found.

Vectors fill a ball evenly: a shape has few parts beyond the waves of its own frequency, and waves that
no shape needs are waves that others lack. Normally distributed ones err a little more.

``solve_readout`` solves the last layer by weighted least squares with the ridge that predicts best. It is
linear, so that the best one for given hidden features is a solved problem and not one to be trained. The
ridge is chosen by leaving out one sample at a time, which least squares answers in closed form (Allen, The
Relationship between Variable Selection and Data Augmentation, Technometrics 16, 1974), with the rounding of
the file and of single precision added: weights that cancel each other to a part in ten thousand are of no use
in half precision, and a greater ridge has none.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.authoring.audio.data import SoundSamples
from harness.authoring.audio.profiles import WavesSpec
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.objectfile.graph import Storage

ENOUGH = 0.01
"""Mean relative error that is foretold at which waves are no longer doubled: a third of the most that a
median may be."""

_BALL = 5.0**0.5
"""Radius of a ball, of the standard deviation of its places along an axis."""

RIDGES = (1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6)
"""Of the largest eigenvalue of the features' products."""

_JUDGED = 1500
"""Samples that are left out one by one, at most."""

_CHUNK = 4096

Features = Callable[[FloatArray], AnyArray]
"""From ``(k, 3)`` points to ``(k, features)``; a constant one among them."""


@dataclass(frozen=True, eq=False)
class Waves:
    """``[sin(p v + phase), p, 1] @ weights`` at ``p = (point - shift) * factor``."""

    shift: FloatArray  #: ``(3,)`` m.
    factor: float  #: 1/m.
    vectors: FloatArray  #: ``(3, d)``.
    phases: FloatArray  #: ``(d,)`` rad.
    weights: FloatArray  #: ``(d + 4, 3 m)`` 1/sqrt(kg); number ``3 i + axis`` belongs to mode ``i``.

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
class Readout:
    """A linear layer and how well it is expected to do."""

    weights: FloatArray  #: ``(features, outputs)``.
    expected: float
    """mean relative error of a sample that was left out, in single precision, with weights as the file holds
    them."""
    ridge: float  #: that was chosen, of the largest eigenvalue.


@dataclass(frozen=True, eq=False)
class FittedWaves:
    """A network and how it was chosen."""

    network: Waves  #: the best of the reaches tried.
    reach: float  #: of its waves' vectors.
    readout: Readout  #: of its linear layer.


def fit_waves(
    samples: SoundSamples,
    measured: IntArray,
    number: float,
    width: int,
    seed: int,
    reaches: tuple[float, ...],
    storage: Storage = "float32",
) -> FittedWaves:
    """Fit a network of ``width`` waves for each spread of wave vectors, and return the most accurate one.

    Args:
        samples: points and mode shapes to fit.
        measured: validation samples that select the network (``solve_readout``).
        number: the object's wave number (``wave_number``), rad/m.
        width: number of waves.
        seed: random seed of the wave vectors and phases.
        reaches: standard deviations of the vectors along an axis, relative to the wave number.
        storage: storage type of the linear layer in the file.
    """
    targets = samples.shapes.reshape(len(samples.points), -1)
    low, high = samples.points.min(axis=0), samples.points.max(axis=0)
    shift, factor = 0.5 * (low + high), 2.0 / float(np.linalg.norm(high - low))
    found = []
    for reach in reaches:
        random = np.random.default_rng([seed, 3])
        ways = random.standard_normal((3, width))
        lengths = _BALL * (reach * number / factor) * random.uniform(size=width) ** (1.0 / 3.0)
        vectors = ways * (lengths / np.linalg.norm(ways, axis=0))
        vectors, phases = _single(vectors), _single(random.uniform(0.0, 2.0 * np.pi, width))
        empty = Waves(shift, factor, vectors, phases, np.zeros((width + 4, 0)))
        shares = error_shares(targets)
        readout = solve_readout(empty.features, samples.points, targets, measured, shares, storage)
        network = Waves(shift, factor, vectors, phases, readout.weights)
        found.append(FittedWaves(network, reach, readout))
    return min(found, key=lambda one: one.readout.expected)


def fit_enough_waves(
    samples: SoundSamples, measured: IntArray, number: float, spec: WavesSpec, seed: int
) -> FittedWaves:
    """Fit waves as ``fit_waves``, and double their number until the predicted error is below ``ENOUGH``.

    Twice the waves spread wider by the square root of two at the same density on a surface, so that
    this is tried next to the previous best spread. ``spec`` states how many waves are tried first.
    """
    width = spec.width
    best = fit_waves(samples, measured, number, width, seed, spec.reaches, spec.storage)
    while best.readout.expected > ENOUGH and (width := 2 * width) <= spec.widest:
        reaches = (best.reach, 2.0**0.5 * best.reach)
        wider = fit_waves(samples, measured, number, width, seed, reaches, spec.storage)
        best = min(best, wider, key=lambda one: one.readout.expected)
    return best


def _single(array: AnyArray) -> FloatArray:
    return np.asarray(array, np.float32).astype(np.float64)


def solve_readout(
    features: Features,
    points: FloatArray,
    targets: FloatArray,
    measured: IntArray,
    shares: FloatArray,
    storage: Storage = "float32",
) -> Readout:
    """The linear layer with the least relative error.

    Args:
        features: of points.
        points: ``(k, 3)``.
        targets: ``(k, outputs)``.
        measured: samples by which the ridge is chosen: those without kin, such as nodes.
        shares: ``(k,)``: what an error of each sample is multiplied by (``error_shares``).
        storage: of the weights in the file, whose rounding counts when the ridge is chosen.
    """
    products: FloatArray | float = 0.0
    right: FloatArray | float = 0.0
    for first in range(0, len(points), _CHUNK):
        part = slice(first, first + _CHUNK)
        weighted = np.asarray(features(points[part]), np.float64) * shares[part, None]
        products = products + weighted.T @ weighted
        right = right + weighted.T @ (targets[part] * shares[part, None])
    gram = np.asarray(products)
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values, 0.0)
    turned = vectors.T @ np.asarray(right)
    judged = measured[:: max(1, len(measured) // _JUDGED)]
    seen = np.asarray(features(points[judged]), np.float64)
    rotated = (seen * shares[judged, None]) @ vectors
    best: Readout | None = None
    for ridge in RIDGES:
        shrunk = 1.0 / (values + ridge * values[-1])
        weights = vectors @ (turned * shrunk[:, None])
        leverage = np.minimum((rotated**2) @ shrunk, 1.0 - 1e-9)
        with np.errstate(over="ignore", invalid="ignore"):  # weights that the file cannot hold are the worst
            single = seen.astype(np.float32) @ weights.astype(storage).astype(np.float32)
        exact = seen @ weights
        left_out = (exact - targets[judged]) / (1.0 - leverage)[:, None] + (single - exact)
        mean = (np.linalg.norm(left_out, axis=1) * shares[judged]).mean()
        expected = float(np.nan_to_num(mean, nan=np.inf))
        if best is None or expected < best.expected:
            best = Readout(weights, expected, ridge)
    assert best is not None
    return best


def error_shares(targets: FloatArray) -> FloatArray:
    """``(k,)``: one over the norm of each sample's targets, so that errors count as relative ones.

    Where all modes are nearly at rest it is a thousand over the root mean square of the norms.
    """
    norms = np.linalg.norm(targets, axis=1)
    floor = 1e-3 * np.sqrt((norms**2).mean())
    shares: FloatArray = 1.0 / np.maximum(norms, floor if floor > 0.0 else 1.0)
    return shares
