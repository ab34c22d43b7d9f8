"""The paper's perceptron of touch: nine numbers of a pixel to a depth, by Adam, resumed exactly."""

from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from harness.authoring.adam_state import load_training, save_training
from harness.authoring.checkpoint import TrainingProgress
from harness.authoring.perceptron import arrays_of, dense_layers, encode, set_rate
from harness.authoring.touch.data import DEPTHS, MOST_TILT, pressed, reference_maps, smooth_normals
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import TouchPerceptronSpec
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.store import digest
from harness.bench.sensor import TactileSensor
from harness.objectfile.graph import Encoding, MlpWeights
from harness.objectfile.touch.part import PerceptronPart
from harness.objectfile.touch.perceptron import paper_normaliser, perceptron_graph, pixel_domain
from harness.objectfile.touch.pixels import INPUTS, pixel_queries
from harness.sim.gel.presses import Presses

VERSION = 1
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""


@dataclass(frozen=True, eq=False)
class LearnedMaps:
    """Presses and their maps, to learn from."""

    presses: Presses  #: without yaw.
    maps: AnyArray  #: ``(n, rows, columns)`` m, float32.
    sensor: TactileSensor  #: whose maps they are.
    low: FloatArray  #: ``(3,)`` m, of the object's box.
    high: FloatArray  #: ``(3,)`` m.


def learned_from(bench: PressBench, count: int, seed: int) -> LearnedMaps:
    """Random presses at the nodes, without the impossible ones.

    Raises:
        WrongUse: none is possible.
    """
    normals = smooth_normals(bench.mesh, bench.nodes.points)
    at = np.random.default_rng([seed, 9]).integers(len(bench.nodes), size=count)
    drawn = pressed(bench.nodes.points[at], normals[at], seed + 3)
    flat = Presses(
        drawn.points, drawn.normals, drawn.depths, drawn.tilts, drawn.azimuths, np.zeros(len(drawn))
    )
    reference = reference_maps(bench.raster, flat, bench.sensor, bench.skirt)
    possible = np.flatnonzero(reference.possible)
    if len(possible) == 0:
        raise WrongUse(f"none of {count} presses is possible; is the mesh inside out?")
    low, high = bench.mesh.bounds
    return LearnedMaps(flat[possible], reference.maps[possible].astype(np.float32), bench.sensor, low, high)


class Perceptron(nn.Module):
    """``(k, encoded)`` to ``(k, 1)``: ReLU after every layer but the last, the encoding again at one."""

    def __init__(self, spec: TouchPerceptronSpec, seed: int) -> None:
        super().__init__()
        self._skip = spec.skip
        random = np.random.default_rng([seed, 4])
        encoded = Encoding.octaves(spec.octaves).width(INPUTS)
        self.layers = dense_layers(encoded, 1, spec.depth, spec.width, spec.skip, random)

    def forward(self, encoded: Tensor) -> Tensor:
        """The normalised depth."""
        hidden = encoded
        for index, layer in enumerate(self.layers):
            if index and index == self._skip:
                hidden = torch.cat([encoded, hidden], dim=1)
            hidden = layer(hidden)
            if index < len(self.layers) - 1:
                hidden = torch.relu(hidden)
        return hidden

    def weights(self) -> MlpWeights:
        """As plain arrays."""
        layers = [layer for layer in self.layers if isinstance(layer, nn.Linear)]
        arrays = [arrays_of(each) for each in layers]
        return MlpWeights(tuple(arrays), (self._skip,) if self._skip else ())


class TouchTraining:
    """A training that can stop after any epoch and go on from its checkpoint, bit for bit.

    Nothing random has a state: the pixels of an epoch are drawn from the seed and the epoch's number.
    """

    def __init__(self, spec: TouchPerceptronSpec, learned: LearnedMaps, seed: int) -> None:
        _check(spec)
        self._spec, self._learned, self._seed = spec, learned, seed
        self.epoch = 0
        self.losses: list[float] = []
        domain = pixel_domain(learned.low, learned.high, DEPTHS, MOST_TILT, learned.sensor)
        self._domain, self._normaliser = domain, paper_normaliser(*domain)
        self._encoding = Encoding.octaves(spec.octaves)
        self._scale = learned.sensor.gel_thickness
        self._network = Perceptron(spec, seed)
        self._adam = torch.optim.Adam(self._network.parameters(), lr=spec.rate)
        poses, maps = learned.presses.object_from_gel, learned.maps
        self._identity = digest(
            ["touch mlp", VERSION, list(astuple(spec)), seed, poses, maps, learned.low, learned.high]
        )

    @property
    def done(self) -> bool:
        """Whether all epochs were trained."""
        return self.epoch >= self._spec.epochs

    def step_epoch(self) -> float:
        """Train one epoch; the mean of the squared error, in thicknesses of the gel squared, on the way."""
        random = np.random.default_rng([self._seed, 5, self.epoch])
        total = 0.0
        for step in range(self._spec.steps):
            over = (self.epoch + step / self._spec.steps) / self._spec.epochs
            set_rate(self._adam, self._spec.rate, over)
            asked, wanted = self._drawn(random)
            self._adam.zero_grad()
            loss = ((self._network(self._encoded(asked)) - torch.from_numpy(wanted)) ** 2).mean()
            torch.autograd.backward(loss)
            self._adam.step()
            total += float(loss.detach())
        self.epoch += 1
        self.losses.append(total / self._spec.steps)
        return self.losses[-1]

    def finish(self) -> PerceptronPart:
        """The network as a graph, with the domain it was trained on."""
        graph = perceptron_graph(self._network.weights(), self._normaliser, self._scale, self._encoding)
        least, most = self._domain
        return PerceptronPart(graph, least, most)

    def predict(self, asked: FloatArray) -> FloatArray:
        """``(k, 1)`` m at ``(k, 9)`` inputs, as torch computes them."""
        with torch.no_grad():
            found: FloatArray = self._network(self._encoded(asked)).numpy() * self._scale
        return found

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

    def _drawn(self, random: np.random.Generator) -> tuple[FloatArray, AnyArray]:
        """``(batch, 9)`` inputs and ``(batch, 1)`` normalised depths of random pixels of random presses."""
        maps, sensor = self._learned.maps, self._learned.sensor
        which = random.integers(len(maps), size=self._spec.batch)
        pixel = random.integers(maps[0].size, size=self._spec.batch)
        single = TactileSensor("one pixel", 1, 1, sensor.pitch, sensor.gel_thickness)
        asked = pixel_queries(self._learned.presses[which], single)[:, 0]
        asked[:, 7], asked[:, 8] = np.divmod(pixel, sensor.columns)
        wanted = maps.reshape(len(maps), -1)[which, pixel] / np.float32(self._scale)
        return asked, wanted[:, None]

    def _encoded(self, asked: FloatArray) -> Tensor:
        return encode(asked, self._normaliser, self._encoding)


def _check(spec: TouchPerceptronSpec) -> None:
    sizes = (spec.depth, spec.width, spec.presses, spec.epochs, spec.steps, spec.batch)
    if min(sizes) < 1 or not 0 <= spec.skip < spec.depth:
        raise WrongUse(f"no network is {spec}; sizes are 1 or more, and skip is a hidden layer or 0")
