"""Trains the spectrogram network of ObjectFolder 1.0 on spectra of the reference's modes."""

import numpy as np

from experiments.baselines.settings import FitSpec
from experiments.baselines.sound.bench import SEED, StrikeBench
from experiments.baselines.sound.spectrogram import INPUTS, OUTPUTS, SpectrumBasis, spectrum_pair
from experiments.baselines.training.fit import fitted
from harness.authoring.published.modules import exported_graph
from harness.authoring.training import Report
from harness.basics.arrays import AnyArray, FloatArray

_UNIFORM = 0.5
"""Share of bins that are drawn anywhere; the others where sounds have their energy, at less weight each."""


class SpectrumRows:
    """Bins of spectra of trained nodes, drawn at random.

    Attributes:
        scale: that the network's outputs are divided by.
    """

    def __init__(self, bench: StrikeBench, basis: SpectrumBasis, batch: int) -> None:
        self._batch, self._basis = batch, basis
        trained = bench.split.trained
        low, high = bench.mesh.bounds
        self._places = (bench.modes.points[trained] - low) / (high - low)
        self._gains = bench.modes.shapes[trained][:, basis.modes]
        flat = basis.spectra.reshape(len(basis.modes), -1)
        self._bins = np.ascontiguousarray(flat.T)
        levels = (self._gains**2).mean(axis=(0, 2))
        energy = (np.abs(flat) ** 2 * levels[:, None]).sum(axis=0)
        self._shares = _UNIFORM / len(energy) + (1.0 - _UNIFORM) * energy / energy.sum()
        self._cumulated = np.cumsum(self._shares)
        self.scale = float(np.sqrt((self._shares * energy).sum()))

    def __call__(self, random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        """``(batch, 5)`` inputs, ``(batch, 6)`` scaled values, weights that undo how bins are drawn."""
        node = random.integers(len(self._places), size=self._batch)
        at = np.searchsorted(self._cumulated, random.random(self._batch) * self._cumulated[-1], side="right")
        at = np.minimum(at, len(self._cumulated) - 1)
        values = np.einsum("km,kmd->kd", self._bins[at], self._gains[node]) / self.scale
        rows = np.concatenate([self._places[node], self._basis.places[at]], axis=1)
        even = 1.0 / (len(self._shares) * self._shares[at])
        return rows, np.concatenate([values.real, values.imag], axis=1), even


def train_spectrogram(bench: StrikeBench, spec: FitSpec, report: Report) -> bytes:
    """The graph of the trained network."""
    basis = SpectrumBasis.of(bench)
    rows = SpectrumRows(bench, basis, spec.batch)
    network = fitted(
        spec,
        (INPUTS, OUTPUTS),
        rows,
        SEED,
        lambda share: report("audio: training 1.0's network", share),
        rows.scale,
    )
    taken, given = spectrum_pair()
    doc = "A bin of a strike's spectrum, as in 1.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()
