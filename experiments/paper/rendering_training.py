"""Train the networks that tables 1 and 2 measure beside ours: those of 1.0, and the layers of 2.0."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch
from torch import Tensor, nn

from experiments.paper.hexahedra import is_within
from experiments.paper.look import REACH, FieldSpec, ViewBench, ball_of
from experiments.paper.rendering import FitSpec
from experiments.paper.sound import (
    SPECTRUM_INPUTS,
    SPECTRUM_OUTPUTS,
    STRIKE_SEED,
    SpectrumBasis,
    StrikeBench,
    spectrum_pair,
)
from experiments.paper.touch import (
    CHANNELS,
    COLOUR_INPUTS,
    MIDDLE,
    PRESS_SEED,
    TouchBench,
    colours_pair,
    pixel_places,
)
from harness.authoring.audio.mlp import AudioTraining
from harness.authoring.audio.profiles import PerceptronSpec
from harness.authoring.perceptron import dense_layers, encode, set_rate
from harness.authoring.published.modules import Osf, ScaledPerceptrons, SkipPerceptron, exported_graph
from harness.authoring.touch.data import reference_maps, smooth_normals
from harness.authoring.touch.mlp import TouchTraining, learned_from
from harness.authoring.touch.profiles import TouchPerceptronSpec
from harness.authoring.training import Report, Resumable, train
from harness.authoring.vision.lessons import Lessons, draw_for
from harness.authoring.vision.places import sphere
from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.objectfile.audio.graph import audio_graph
from harness.objectfile.graph import Encoding, Normaliser
from harness.objectfile.published.look import osf_tensors
from harness.picture.srgb import bytes_from_linear
from harness.sim.gel.presses import Presses

Drawn = Callable[[np.random.Generator], tuple[FloatArray, AnyArray, AnyArray]]
"""From a generator to ``(batch, inputs)`` normalised inputs, ``(batch, outputs)`` targets and ``(batch,)``
weights of their squared errors where the last layer is solved."""


_SOLVED = 16
"""Draws of rows that the last layer is solved over."""

_RIDGE = 1e-6
"""Of the mean square of the features."""


class EncodedPerceptron(nn.Module):
    """``(k, inputs)`` normalised to ``(k, outputs)``: ReLU after every layer but the last."""

    def __init__(self, spec: FitSpec, inputs: int, outputs: int, seed: int) -> None:
        super().__init__()
        self._encoding = Encoding.octaves(spec.octaves)
        self._as_it_is = Normaliser(np.zeros(inputs), np.ones(inputs))
        random = np.random.default_rng([seed, 4])
        width = self._encoding.width(inputs)
        self.layers = dense_layers(width, outputs, spec.depth, spec.width, 0, random)

    def forward(self, rows: FloatArray) -> Tensor:
        """Of normalised rows, which are encoded as the graph encodes them."""
        return self.layers[-1](self.features(rows))

    def features(self, rows: FloatArray) -> Tensor:
        """``(k, width)``: what the last layer takes."""
        hidden = encode(rows, self._as_it_is, self._encoding)
        for layer in self.layers[:-1]:
            hidden = torch.relu(layer(hidden))
        return hidden


def fitted(
    spec: FitSpec,
    sizes: tuple[int, int],
    draw: Drawn,
    seed: int,
    report: Callable[[float], None],
    scale: float = 1.0,
) -> ScaledPerceptrons:
    """Train a network, then solve its last layer for what those before it give.

    Args:
        spec: of the network and its training.
        sizes: numbers of inputs and of outputs.
        draw: gives the rows of a step.
        seed: of first weights and of what is drawn.
        report: takes the share of the steps that is done.
        scale: factor of the trained outputs.
    """
    torch.set_num_threads(1)
    network = EncodedPerceptron(spec, *sizes, seed)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([seed, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        rows, wanted, _ = draw(random)
        adam.zero_grad()
        loss = ((network(rows) - torch.from_numpy(np.float32(wanted))) ** 2).mean()
        torch.autograd.backward(loss)
        adam.step()
        report((step + 1) / spec.steps)
    perceptron = SkipPerceptron(
        Encoding.octaves(spec.octaves).width(sizes[0]), spec.width, sizes[1], spec.depth, None
    )
    perceptron.pts_linears = nn.ModuleList(network.layers[:-1])
    weight, bias = _solved(network, draw, random)
    with torch.no_grad():
        perceptron.output_linear.weight.copy_(torch.from_numpy(np.float32(weight.T)))
        perceptron.output_linear.bias.copy_(torch.from_numpy(np.float32(bias)))
    plain, scales = (np.zeros(sizes[0]), np.ones(sizes[0])), (np.full((1, 1), scale), np.zeros((1, 1)))
    return ScaledPerceptrons([perceptron], *plain, *scales, spec.octaves)


def _solved(
    network: EncodedPerceptron, draw: Drawn, random: np.random.Generator
) -> tuple[AnyArray, AnyArray]:
    """Solve the last layer, ``(in, out)`` and ``(out,)``, by weighted least squares over fresh rows."""
    products: FloatArray = np.zeros(())
    targets: FloatArray = np.zeros(())
    for _ in range(_SOLVED):
        rows, wanted, weights = draw(random)
        with torch.no_grad():
            found = network.features(rows).numpy().astype(np.float64)
        features = np.concatenate([found, np.ones((len(found), 1))], axis=1)
        weighted = features * weights[:, None]
        products, targets = products + weighted.T @ features, targets + weighted.T @ wanted
    ridge = _RIDGE * float(np.trace(products)) / len(products)
    last = np.linalg.solve(products + ridge * np.eye(len(products)), targets)
    return last[:-1], last[-1]


_UNIFORM = 0.5
"""Share of bins that are drawn anywhere; the others where sounds have their energy, at less weight each."""


class SpectrumRows:
    """Bins of spectra of trained nodes, drawn at random."""

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
        """that the network's outputs are divided by."""

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
        (SPECTRUM_INPUTS, SPECTRUM_OUTPUTS),
        rows,
        STRIKE_SEED,
        lambda share: report("audio: training 1.0's network", share),
        rows.scale,
    )
    taken, given = spectrum_pair()
    doc = "A bin of a strike's spectrum, as in 1.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()


class ColourRows:
    """Pixels of pictures of upright presses at the places to learn from, drawn at random."""

    def __init__(self, bench: TouchBench, batch: int) -> None:
        self._batch, places = batch, bench.places
        normals, nothing = smooth_normals(places.mesh, places.nodes.points), np.zeros(len(places.nodes))
        presses = Presses(places.nodes.points, normals, nothing + MIDDLE, nothing, nothing, nothing)
        reference = reference_maps(places.raster, presses, places.sensor, places.skirt)
        chosen = np.flatnonzero(reference.possible)
        low, high = places.mesh.bounds
        self._places = (places.nodes.points[chosen] - low) / (high - low)
        pictures = np.stack([bench.picture(each) for each in reference.maps[chosen]])
        self._colours = pictures.reshape(len(chosen), -1, CHANNELS)
        self._pixels = pixel_places((places.sensor.rows, places.sensor.columns))

    def __call__(self, random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        """``(batch, 5)`` inputs, ``(batch, 3)`` colours of -1 .. 1, and even weights."""
        place = random.integers(len(self._places), size=self._batch)
        pixel = random.integers(len(self._pixels), size=self._batch)
        rows = np.concatenate([self._places[place], self._pixels[pixel]], axis=1)
        return rows, self._colours[place, pixel] / 127.5 - 1.0, np.ones(self._batch)


def train_colours(bench: TouchBench, spec: FitSpec, report: Report) -> bytes:
    """The graph of the trained network."""
    rows = ColourRows(bench, spec.batch)
    network = fitted(
        spec,
        (COLOUR_INPUTS, CHANNELS),
        rows,
        PRESS_SEED,
        lambda share: report("touch: training 1.0's network", share),
    )
    taken, given = colours_pair()
    doc = "A pixel of a press, as in 1.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()


FIELD_SEED = 0
_AS_IT_IS = Normaliser(np.zeros(3), np.ones(3))
_STRETCH = 1.2
_SPACE = 1 << 18
"""Places of the ball that are drawn, within the object and outside."""

_STEEP = 400.0
"""Density, in one over the ball's radius, of a raw density of 1: a hundredth of the radius lets 2 % pass."""


class OsfField(nn.Module):
    """Place, view and light to raw colour and a logit of being within the object."""

    def __init__(self, spec: FieldSpec) -> None:
        super().__init__()
        random = np.random.default_rng([FIELD_SEED, 4])
        self._places, self._turns = Encoding.octaves(spec.octaves), Encoding.octaves(spec.turns)
        width, turned = spec.width, self._turns.width(3)
        self.trunk = dense_layers(self._places.width(3), width + 1, spec.depth, width, 0, random)
        self.direction, self.colour = dense_layers(width + 2 * turned, 3, 1, width // 2, 0, random)

    def forward(self, points: FloatArray, views: FloatArray, lights: FloatArray) -> tuple[Tensor, Tensor]:
        """``(n, 3)`` and ``(n,)``."""
        both = self._hidden(points)
        directions = [encode(each, _AS_IT_IS, self._turns) for each in (views, lights)]
        hidden = torch.relu(self.direction(torch.cat([both[:, :-1], *directions], dim=1)))
        return self.colour(hidden), both[:, -1]

    def within(self, points: FloatArray) -> Tensor:
        """``(n,)`` logits of places alone."""
        return self._hidden(points)[:, -1]

    def _hidden(self, points: FloatArray) -> Tensor:
        hidden = encode(points, _AS_IT_IS, self._places)
        for number, layer in enumerate(self.trunk):
            hidden = layer(hidden)
            if number < len(self.trunk) - 1:
                hidden = torch.relu(hidden)
        return hidden

    def to_published(self, spec: FieldSpec) -> Osf:
        """Convert to the published layout, the density's logit as a density."""
        width, turned = spec.width, spec.width // 2
        network = Osf(width, turned, spec.depth, None, (spec.octaves, spec.turns))
        network.pts_linears = nn.ModuleList(self.trunk[:-1])
        network.views_lights_linears = nn.ModuleList([self.direction])
        network.rgb_linear = self.colour
        both = self.trunk[-1].state_dict()
        network.bottleneck_linear.load_state_dict({name: rows[:-1] for name, rows in both.items()})
        network.alpha_linear.load_state_dict({name: _STEEP * rows[-1:] for name, rows in both.items()})
        return network


@dataclass(frozen=True, eq=False)
class FieldRows:
    """What a field learns from, in the frame of the ball."""

    lessons: Lessons  #: places beside the surface, under lamps of their own.
    points: FloatArray  #: ``(n, 3)`` of these.
    shown: AnyArray  #: ``(n, 3)`` their colours as shown, 0 to 1.
    space: FloatArray  #: ``(m, 3)`` places of the whole ball.
    inside: BoolArray  #: ``(m,)`` whether the object is there.

    @classmethod
    def drawn(cls, bench: ViewBench, spec: FieldSpec) -> "FieldRows":
        """Of the object of a bench, clear of its views."""
        mesh = bench.lit.appearance.mesh
        middle, radius = ball_of(mesh)
        lessons, _ = draw_for(
            "osf", bench.lit, spec.places, 2.0 * radius / spec.samples, FIELD_SEED, bench.views
        )
        random = np.random.default_rng([FIELD_SEED, 77])
        space = sphere(_SPACE, random) * random.random((_SPACE, 1)) ** (1.0 / 3.0)
        shown = bytes_from_linear(lessons.colours.astype(np.float64)) / 255.0
        inside = is_within(bench.lit.rays, middle + radius * space, mesh.face_normals, random)
        return cls(lessons, (lessons.points - middle) / radius, shown, space, inside)


def train_field(bench: ViewBench, spec: FieldSpec, report: Report) -> bytes:
    """The graph of the trained network."""
    torch.set_num_threads(1)
    rows, network = FieldRows.drawn(bench, spec), OsfField(spec)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([FIELD_SEED, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        adam.zero_grad()
        torch.autograd.backward(_loss(network, rows, spec, random))
        adam.step()
        report("vision: training 1.0's field", (step + 1) / spec.steps)
    inputs, outputs = osf_tensors(REACH)
    doc = "A place, a view and a light to raw colour and density, as in 1.0."
    return exported_graph(network.to_published(spec), inputs, outputs, doc).SerializeToString()


def _loss(network: OsfField, rows: FieldRows, spec: FieldSpec, random: np.random.Generator) -> Tensor:
    """Squared error of colours where they count, and cross entropy of being within the object."""
    at, away = (
        random.integers(len(rows.points), size=spec.batch),
        random.integers(_SPACE, size=spec.batch // 2),
    )
    lessons = rows.lessons
    raw, logits = network(rows.points[at], lessons.views[at], lessons.lamps[at])
    wanted = torch.from_numpy(np.float32(rows.shown[at]))
    wrong = ((0.5 + 0.5 * _STRETCH * torch.tanh(0.5 * raw) - wanted) ** 2).mean(dim=1)
    weight = torch.from_numpy(lessons.weight[at])
    inside = np.concatenate([lessons.depth[at] > 0.0, rows.inside[away]])
    every = torch.cat([logits, network.within(rows.space[away])])
    entropy = nn.functional.binary_cross_entropy_with_logits(every, torch.from_numpy(np.float32(inside)))
    return (wrong * weight).mean() + spec.opacity * entropy


def train_audionet(bench: StrikeBench, spec: PerceptronSpec, report: Report) -> bytes:
    """The graph of 2.0's AudioNet, trained at the nodes that strikes are not at."""
    training = AudioTraining(spec, bench.modes, bench.split.trained, STRIKE_SEED)
    _trained(training, spec.epochs, report)
    found = training.finish()
    return audio_graph(found.branches, found.normaliser, found.scales, found.encoding).SerializeToString()


def train_touchnet(bench: TouchBench, spec: TouchPerceptronSpec, report: Report) -> bytes:
    """The graph of 2.0's TouchNet, trained on presses at other places than the bench's."""
    training = TouchTraining(spec, learned_from(bench.places, spec.presses, STRIKE_SEED), STRIKE_SEED)
    _trained(training, spec.epochs, report)
    return training.finish().graph.SerializeToString()


def _trained(training: Resumable, epochs: int, report: Report) -> None:
    torch.set_num_threads(1)
    with TemporaryDirectory() as folder:
        train(training, epochs, Path(folder) / "training.npz", report)
