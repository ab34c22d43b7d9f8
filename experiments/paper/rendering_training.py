"""Train the networks that tables 1 and 2 measure beside ours: those of 1.0, and the layers of 2.0."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from experiments.paper.hexahedra import is_within
from experiments.paper.look import REACH, FieldSpec, ViewBench, ball_of
from experiments.paper.rendering import FitSpec
from experiments.paper.sound import (
    ANYWHERE,
    AUDIONET_EPOCHS,
    SPECTRUM_INPUTS,
    SPECTRUM_OUTPUTS,
    STRIKE_SEED,
    SpectrumBasis,
    StrikeBench,
    between_nodes,
    spectrum_pair,
)
from experiments.paper.touch import (
    CHANNELS,
    COLOUR_INPUTS,
    MIDDLE,
    NETWORK_SEED,
    PRESS_INPUTS,
    PRESS_SEED,
    TOUCHNET_PRESSES,
    PressInputs,
    TouchBench,
    colours_pair,
    pixel_places,
    touchnet_pair,
)
from harness.authoring.audio.waves import error_shares, solve_readout
from harness.authoring.published.modules import Osf, ScaledPerceptrons, SkipPerceptron, exported_graph
from harness.authoring.touch.data import pressed, reference_maps, smooth_normals
from harness.authoring.training import Report
from harness.authoring.vision.lessons import Lessons, draw_for
from harness.authoring.vision.places import sphere
from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.objectfile.audio.part import network_tensors
from harness.objectfile.published.look import osf_tensors
from harness.picture.srgb import bytes_from_linear
from harness.sim.gel.press_pose import Presses

Drawn = Callable[[np.random.Generator], tuple[FloatArray, AnyArray, AnyArray]]
"""From a generator to ``(batch, inputs)`` normalised inputs, ``(batch, outputs)`` targets and ``(batch,)``
weights of their squared errors where the last layer is solved."""


_SOLVED = 16
"""Draws of rows that the last layer is solved over."""

_RIDGE = 1e-6
"""Of the mean square of the features."""


def encoded_width(inputs: int, octaves: int) -> int:
    """Numbers that an input of that many becomes."""
    return inputs * (1 + 2 * octaves)


def encode(rows: FloatArray, octaves: int) -> Tensor:
    """Encode normalised rows as ``[v, sin v, cos v, sin 2v, cos 2v, ...]``, in float32."""
    place = np.float32(rows)
    angles = [np.float32(2.0**k) * place for k in range(octaves)]
    parts = [place, *(wave for angle in angles for wave in (np.sin(angle), np.cos(angle)))]
    return torch.from_numpy(np.concatenate(parts, axis=1))


def dense_layers(
    encoded: int, outputs: int, depth: int, width: int, skip: int, random: np.random.Generator
) -> nn.ModuleList:
    """Linear layers that take an encoded input: hidden ones, and the last.

    Weights are normal of variance ``2 / inputs`` (He et al., Delving deep into rectifiers, ICCV 2015),
    biases zero.

    Args:
        encoded: numbers of the encoded input.
        outputs: of the last layer.
        depth: hidden layers.
        width: of each.
        skip: the layer, counted from 0, that takes the encoded input too; 0 for none.
        random: draws the weights.
    """
    layers = nn.ModuleList()
    given = encoded
    for index in range(depth + 1):
        taken = given + (encoded if index and index == skip else 0)
        given = width if index < depth else outputs
        layer = nn.Linear(taken, given)
        weight = random.standard_normal((given, taken)) * np.sqrt(2.0 / taken)
        with torch.no_grad():
            layer.weight.copy_(torch.from_numpy(np.float32(weight)))
            layer.bias.zero_()
        layers.append(layer)
    return layers


def set_rate(adam: torch.optim.Adam, first: float, share: float) -> None:
    """Let the rate fall from its first to zero as half a cosine; ``share`` of the training is over."""
    for group in adam.param_groups:
        group["lr"] = 0.5 * first * (1.0 + np.cos(np.pi * share))


class EncodedPerceptron(nn.Module):
    """Perceptron from ``(k, encoded)`` to ``(k, outputs)``, with ReLU after every layer but the last."""

    def __init__(self, spec: FitSpec, inputs: int, outputs: int, random: np.random.Generator) -> None:
        super().__init__()
        self.spec, self._sizes = spec, (encoded_width(inputs, spec.octaves), outputs)
        self.layers = dense_layers(*self._sizes, spec.depth, spec.width, spec.skip, random)

    def forward(self, encoded: Tensor) -> Tensor:
        """Outputs of encoded rows."""
        return self.layers[-1](self.features(encoded))

    def features(self, encoded: Tensor) -> Tensor:
        """``(k, width)``: what the last layer takes."""
        hidden = encoded
        for index, layer in enumerate(self.layers[:-1]):
            taken = torch.cat([encoded, hidden], dim=1) if index and index == self.spec.skip else hidden
            hidden = torch.relu(layer(taken))
        return hidden

    def set_last(self, weight: AnyArray, bias: AnyArray) -> None:
        """Replace the last layer by ``(in, out)`` and ``(out,)``."""
        last = self.layers[-1]
        assert isinstance(last, nn.Linear)
        with torch.no_grad():
            last.weight.copy_(torch.from_numpy(np.float32(weight.T)))
            last.bias.copy_(torch.from_numpy(np.float32(bias)))

    def to_published(self) -> SkipPerceptron:
        """Convert to the published layout."""
        encoded, outputs = self._sizes
        spec, last = self.spec, self.layers[-1]
        assert isinstance(last, nn.Linear)
        perceptron = SkipPerceptron(encoded, spec.width, outputs, spec.depth, spec.skip or None)
        perceptron.pts_linears = nn.ModuleList(self.layers[:-1])
        perceptron.output_linear = last
        return perceptron


def fitted(
    spec: FitSpec,
    sizes: tuple[int, int],
    draw: Drawn,
    seed: int,
    report: Callable[[float], None],
    scale: float = 1.0,
    solve: bool = True,
) -> ScaledPerceptrons:
    """Train a network, then solve its last layer for what those before it give.

    Args:
        spec: of the network and its training.
        sizes: numbers of inputs and of outputs.
        draw: gives the rows of a step.
        seed: of first weights and of what is drawn.
        report: takes the share of the steps that is done.
        scale: factor of the trained outputs.
        solve: whether to solve the last layer, or leave it as it is trained.
    """
    torch.set_num_threads(1)
    network = EncodedPerceptron(spec, *sizes, np.random.default_rng([seed, 4]))
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([seed, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        rows, wanted, _ = draw(random)
        adam.zero_grad()
        found = network(encode(rows, spec.octaves))
        loss = ((found - torch.from_numpy(np.float32(wanted))) ** 2).mean()
        torch.autograd.backward(loss)
        adam.step()
        report((step + 1) / spec.steps)
    if solve:
        network.set_last(*_solved(network, draw, random))
    plain, scales = (np.zeros(sizes[0]), np.ones(sizes[0])), (np.full((1, 1), scale), np.zeros((1, 1)))
    return ScaledPerceptrons([network.to_published()], *plain, *scales, spec.octaves)


def _solved(
    network: EncodedPerceptron, draw: Drawn, random: np.random.Generator
) -> tuple[AnyArray, AnyArray]:
    """Solve the last layer, ``(in, out)`` and ``(out,)``, by weighted least squares over fresh rows."""
    products: FloatArray = np.zeros(())
    targets: FloatArray = np.zeros(())
    for _ in range(_SOLVED):
        rows, wanted, weights = draw(random)
        with torch.no_grad():
            found = network.features(encode(rows, network.spec.octaves)).numpy().astype(np.float64)
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
        self._octaves, self._turns = spec.octaves, spec.turns
        width, turned = spec.width, encoded_width(3, spec.turns)
        self.trunk = dense_layers(encoded_width(3, spec.octaves), width + 1, spec.depth, width, 0, random)
        self.direction, self.colour = dense_layers(width + 2 * turned, 3, 1, width // 2, 0, random)

    def forward(self, points: FloatArray, views: FloatArray, lights: FloatArray) -> tuple[Tensor, Tensor]:
        """``(n, 3)`` and ``(n,)``."""
        both = self._hidden(points)
        directions = [encode(each, self._turns) for each in (views, lights)]
        hidden = torch.relu(self.direction(torch.cat([both[:, :-1], *directions], dim=1)))
        return self.colour(hidden), both[:, -1]

    def within(self, points: FloatArray) -> Tensor:
        """``(n,)`` logits of places alone."""
        return self._hidden(points)[:, -1]

    def _hidden(self, points: FloatArray) -> Tensor:
        hidden = encode(points, self._octaves)
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
        at = random.integers(len(rows.points), size=spec.batch)
        away = random.integers(_SPACE, size=spec.batch // 2)
        lessons = rows.lessons
        raw, logits = network(rows.points[at], lessons.views[at], lessons.lamps[at])
        wanted = torch.from_numpy(np.float32(rows.shown[at]))
        wrong = ((0.5 + 0.5 * _STRETCH * torch.tanh(0.5 * raw) - wanted) ** 2).mean(dim=1)
        weight = torch.from_numpy(lessons.weight[at])
        inside = np.concatenate([lessons.depth[at] > 0.0, rows.inside[away]])
        every = torch.cat([logits, network.within(rows.space[away])])
        # Squared error of colours where they count, and cross entropy of being within the object.
        entropy = nn.functional.binary_cross_entropy_with_logits(every, torch.from_numpy(np.float32(inside)))
        torch.autograd.backward((wrong * weight).mean() + spec.opacity * entropy)
        adam.step()
        report("vision: training 1.0's field", (step + 1) / spec.steps)
    inputs, outputs = osf_tensors(REACH)
    doc = "A place, a view and a light to raw colour and density, as in 1.0."
    return exported_graph(network.to_published(spec), inputs, outputs, doc).SerializeToString()


_CHUNK = 4096
"""Places of which the features of the last layer are computed at once."""


def train_audionet(bench: StrikeBench, spec: FitSpec, report: Report) -> bytes:
    """The graph of 2.0's AudioNet, trained at the nodes that strikes are not at.

    Three perceptrons, for forces along x, y and z, learn together with the squared relative error, at nodes
    and between them. Their last layers are then solved for what those before them give.
    """
    torch.set_num_threads(1)
    modes, trained = bench.modes, bench.split.trained
    random = np.random.default_rng([STRIKE_SEED, 4])
    branches = [EncodedPerceptron(spec, 3, len(modes.frequencies), random) for _ in range(3)]
    low, high = modes.points.min(axis=0), modes.points.max(axis=0)
    shift, factor = low, 1.0 / (high - low)

    def encoded(points: FloatArray) -> Tensor:
        return encode((points - shift) * factor, spec.octaves)

    nodes, wanted = modes.points[trained], modes.shapes[trained]
    levels = np.sqrt((wanted**2).mean(axis=0))
    levels[levels == 0.0] = 1.0
    scales = torch.from_numpy(np.float32(levels))
    allowed = np.zeros(len(modes.points), dtype=np.bool_)
    allowed[trained] = True
    adam = torch.optim.Adam([each for branch in branches for each in branch.parameters()], lr=spec.rate)
    for epoch in range(AUDIONET_EPOCHS):
        extra = between_nodes(modes, allowed, 1, STRIKE_SEED + 1000 * epoch)
        points, shapes = np.concatenate([nodes, extra.points]), np.concatenate([wanted, extra.shapes])
        shares = error_shares(shapes.reshape(len(shapes), -1))
        order = np.random.default_rng([STRIKE_SEED, 5, epoch]).permutation(len(points))
        batches = np.array_split(order, max(1, len(order) // spec.batch))
        for number, batch in enumerate(batches):
            set_rate(adam, spec.rate, (epoch + number / len(batches)) / AUDIONET_EPOCHS)
            targets = torch.from_numpy(np.float32(shapes[batch] * shares[batch, None, None]))
            weights = scales * torch.from_numpy(np.float32(shares[batch]))[:, None, None]
            adam.zero_grad()
            rows = encoded(points[batch])
            wrong = torch.stack([branch(rows) for branch in branches], dim=2) * weights - targets
            torch.autograd.backward((wrong**2).sum(dim=(1, 2)).mean())
            adam.step()
        report("audio: training 2.0's network", (epoch + 1) / AUDIONET_EPOCHS)
    shares = error_shares(wanted.reshape(len(wanted), -1))
    for axis, branch in enumerate(branches):

        def features(points: FloatArray, branch: EncodedPerceptron = branch) -> AnyArray:
            starts = range(0, len(points), _CHUNK)
            with torch.no_grad():
                found = [branch.features(encoded(points[at : at + _CHUNK])).numpy() for at in starts]
            return np.concatenate([np.concatenate(found), np.ones((len(points), 1), np.float32)], axis=1)

        solved = solve_readout(features, nodes, wanted[:, :, axis], np.arange(len(nodes)), shares).weights
        branch.set_last(solved[:-1], solved[-1])
    plain = np.ones((3, 1)), np.zeros((3, 1))
    network = ScaledPerceptrons(
        [branch.to_published() for branch in branches], shift, factor, *plain, spec.octaves
    )
    taken, given = network_tensors(len(modes.frequencies), ANYWHERE)
    doc = "A place to the shapes of the modes there, as in 2.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()


class PressRows:
    """Sampler of training pixels from feasible presses at the training points."""

    def __init__(self, bench: TouchBench, batch: int) -> None:
        self._batch, places = batch, bench.places
        normals = smooth_normals(places.mesh, places.nodes.points)
        at = np.random.default_rng([NETWORK_SEED, 9]).integers(len(places.nodes), size=TOUCHNET_PRESSES)
        drawn = pressed(places.nodes.points[at], normals[at], NETWORK_SEED + 3)
        flat = Presses(
            drawn.points, drawn.normals, drawn.depths, drawn.tilts, drawn.azimuths, np.zeros(len(drawn))
        )
        reference = reference_maps(places.raster, flat, places.sensor, places.skirt)
        possible = np.flatnonzero(reference.possible)
        self._presses, self._inputs = flat[possible], PressInputs.of(places)
        self._maps = reference.maps[possible].reshape(len(possible), -1).astype(np.float32)
        self._scale = np.float32(places.sensor.gel_thickness)

    def __call__(self, random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        """Sample ``(batch, 9)`` inputs, ``(batch, 1)`` depths in gel thicknesses, and uniform weights."""
        which = random.integers(len(self._maps), size=self._batch)
        pixel = random.integers(self._maps.shape[1], size=self._batch)
        rows = self._inputs.rows(self._presses[which], pixel)
        return rows, (self._maps[which, pixel] / self._scale)[:, None], np.ones(self._batch)


def train_touchnet(bench: TouchBench, spec: FitSpec, report: Report) -> bytes:
    """The graph of 2.0's TouchNet, trained on presses at other places than the bench's."""
    network = fitted(
        spec,
        (PRESS_INPUTS, 1),
        PressRows(bench, spec.batch),
        NETWORK_SEED,
        lambda share: report("touch: training 2.0's network", share),
        bench.places.sensor.gel_thickness,
        solve=False,
    )
    taken, given = touchnet_pair()
    doc = "A pixel of a press to the gel's indentation there, as in 2.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()
