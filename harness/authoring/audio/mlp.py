"""The perceptrons of sound: the paper's three and one for all, trained by Adam, resumed exactly."""

from collections.abc import Iterator
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from harness.authoring.adam_state import load_training, save_training
from harness.authoring.audio.data import between_nodes
from harness.authoring.audio.profiles import PerceptronSpec
from harness.authoring.audio.waves import error_shares, solve_readout
from harness.authoring.checkpoint import TrainingProgress
from harness.authoring.perceptron import arrays_of, dense_layers, encode, set_rate
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.store import digest
from harness.objectfile.audio.graph import OutputScales
from harness.objectfile.graph import Encoding, MlpWeights, Normaliser
from harness.sim.modal.modes import Modes

VERSION = 1
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""

_CHUNK = 4096


@dataclass(frozen=True, eq=False)
class TrainedMlp:
    """Plain arrays, as ``harness.objectfile.audio.graph.audio_graph`` takes them."""

    branches: tuple[MlpWeights, ...]
    normaliser: Normaliser
    scales: OutputScales
    encoding: Encoding


class Perceptrons(nn.Module):
    """Branches side by side on one encoded input: ``(k, e)`` to ``(k, m, 3)``."""

    def __init__(self, spec: PerceptronSpec, modes: int, seed: int) -> None:
        super().__init__()
        self._skip = spec.skip
        encoded = Encoding.octaves(spec.octaves).width(3)
        random = np.random.default_rng([seed, 4])
        outputs = 3 * modes // spec.branches
        self.branches = nn.ModuleList(
            dense_layers(encoded, outputs, spec.depth, spec.width, spec.skip, random)
            for _ in range(spec.branches)
        )

    def forward(self, encoded: Tensor) -> Tensor:
        """Outputs of all modes and directions."""
        last: list[Tensor] = [branch[-1](self.hidden(encoded, branch)) for branch in self.layers()]
        if len(last) == 1:
            return last[0].reshape(len(encoded), -1, 3)
        return torch.stack(last, dim=2)

    def hidden(self, encoded: Tensor, branch: list[nn.Linear]) -> Tensor:
        """``(k, width)``: what the last layer of a branch takes."""
        hidden = encoded
        for index, layer in enumerate(branch[:-1]):
            if index and index == self._skip:
                hidden = torch.cat([encoded, hidden], dim=1)
            hidden = torch.relu(layer(hidden))
        return hidden

    def layers(self) -> Iterator[list[nn.Linear]]:
        """The linear layers of each branch."""
        for branch in self.branches:
            assert isinstance(branch, nn.ModuleList)
            yield [layer for layer in branch if isinstance(layer, nn.Linear)]


class AudioTraining:
    """A training that can stop after any epoch and go on from its checkpoint, bit for bit.

    Nothing random has a state: the order of an epoch and its places between nodes are drawn from the
    seed and the epoch's number.
    """

    def __init__(self, spec: PerceptronSpec, modes: Modes, trained: IntArray, seed: int) -> None:
        if spec.branches not in (1, 3):
            raise WrongUse(f"{spec.branches} branches; there are three, for x, y and z, or one for all")
        if min(spec.depth, spec.width, spec.epochs, spec.batch) < 1 or not 0 <= spec.skip < max(
            spec.depth, 1
        ):
            raise WrongUse(f"no network is {spec}; sizes are 1 or more, and skip is a hidden layer or 0")
        self._spec, self._modes, self._trained, self._seed = spec, modes, trained, seed
        self.epoch = 0
        self.losses: list[float] = []
        self._allowed = np.zeros(len(modes.points), dtype=np.bool_)
        self._allowed[trained] = True
        shapes = modes.shapes[trained]
        low, high = modes.points.min(axis=0), modes.points.max(axis=0)
        self._normaliser = Normaliser.unit_box(low, high)
        self._scales = np.sqrt((shapes**2).mean(axis=0))
        self._scales[self._scales == 0.0] = 1.0
        self._encoding = Encoding.octaves(spec.octaves)
        self._network = Perceptrons(spec, len(modes.frequencies), seed)
        self._adam = torch.optim.Adam(self._network.parameters(), lr=spec.rate)
        self._identity = digest(
            ["audio mlp", VERSION, list(astuple(spec)), seed, modes.points, modes.shapes, trained]
        )

    @property
    def done(self) -> bool:
        """Whether all epochs were trained."""
        return self.epoch >= self._spec.epochs

    def step_epoch(self) -> float:
        """Train one epoch; the mean of the squared relative error on the way."""
        extra = between_nodes(self._modes, self._allowed, 1, self._seed + 1000 * self.epoch)
        points = np.concatenate([self._modes.points[self._trained], extra.points])
        shapes = np.concatenate([self._modes.shapes[self._trained], extra.shapes])
        shares = error_shares(shapes.reshape(len(shapes), -1))
        scales = torch.from_numpy(np.float32(self._scales))
        order = np.random.default_rng([self._seed, 5, self.epoch]).permutation(len(points))
        batches = np.array_split(order, max(1, len(order) // self._spec.batch))
        total = 0.0
        for number, batch in enumerate(batches):
            over = (self.epoch + number / len(batches)) / self._spec.epochs
            set_rate(self._adam, self._spec.rate, over)
            wanted = torch.from_numpy(np.float32(shapes[batch] * shares[batch, None, None]))
            weights = scales * torch.from_numpy(np.float32(shares[batch]))[:, None, None]
            self._adam.zero_grad()
            wrong = self._network(self._encoded(points[batch])) * weights - wanted
            loss = (wrong**2).sum(dim=(1, 2)).mean()
            torch.autograd.backward(loss)
            self._adam.step()
            total += float(loss.detach()) * len(batch)
        self.epoch += 1
        self.losses.append(total / len(points))
        return self.losses[-1]

    def finish(self) -> TrainedMlp:
        """The network, its last layers solved exactly for what the layers before them give."""
        points = self._modes.points[self._trained]
        shapes = self._modes.shapes[self._trained]
        shares = error_shares(shapes.reshape(len(shapes), -1))
        spec, modes = self._spec, len(self._modes.frequencies)
        branches = []
        for number, layers in enumerate(self._network.layers()):
            targets = shapes[:, :, number] if spec.branches == 3 else shapes.reshape(len(shapes), -1)

            def features(at: FloatArray, layers: list[nn.Linear] = layers) -> AnyArray:
                return self._features(at, layers)

            readout = solve_readout(features, points, targets, np.arange(len(points)), shares)
            inner = [arrays_of(layer) for layer in layers[:-1]]
            last = readout.weights[:-1], readout.weights[-1]
            branches.append(MlpWeights((*inner, last), (spec.skip,) if spec.skip else ()))
        scales = OutputScales(np.ones((modes, 3)), np.zeros((modes, 3)))
        return TrainedMlp(tuple(branches), self._normaliser, scales, self._encoding)

    def solved(self, points: FloatArray, trained: TrainedMlp) -> FloatArray:
        """``(k, m, 3)`` 1/sqrt(kg), of the network as ``finish`` gave it, to compare a graph with."""
        found = []
        for branch, layers in zip(trained.branches, self._network.layers(), strict=True):
            weight, bias = branch.layers[-1]
            found.append(self._features(points, layers)[:, :-1] @ weight + bias)
        if len(found) == 1:
            return np.asarray(found[0]).reshape(len(points), -1, 3)
        return np.stack(found, axis=2)

    def save(self, path: Path) -> None:
        """Write a checkpoint (``adam_state.save_training``)."""
        progress = TrainingProgress(self.epoch, self.losses)
        save_training(path, self._identity, progress, self._network, self._adam)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, data or seed.
        """
        progress = load_training(path, self._identity, self._network, self._adam)
        self.epoch, self.losses = progress.epoch, progress.losses

    def predict(self, points: FloatArray) -> FloatArray:
        """``(k, m, 3)`` 1/sqrt(kg), of the network as it is trained so far."""
        with torch.no_grad():
            found = self._network(self._encoded(points)).numpy()
        shapes: FloatArray = found * self._scales
        return shapes

    def _encoded(self, points: FloatArray) -> Tensor:
        return encode(points, self._normaliser, self._encoding)

    def _features(self, points: FloatArray, layers: list[nn.Linear]) -> AnyArray:
        found = []
        with torch.no_grad():
            for first in range(0, len(points), _CHUNK):
                found.append(
                    self._network.hidden(self._encoded(points[first : first + _CHUNK]), layers).numpy()
                )
        hidden = np.concatenate(found)
        return np.concatenate([hidden, np.ones((len(hidden), 1), np.float32)], axis=1)
