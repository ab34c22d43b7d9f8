"""Train the networks that tables 1 and 2 measure beside ours: those of 1.0, and the layers of 2.0."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from experiments.paper.hexahedra import is_within
from experiments.paper.look import REACH, ViewBench, ball_of
from experiments.paper.rendering import FieldSpec, FitSpec, grid_points
from experiments.paper.sound import (
    ANYWHERE,
    AUDIONET_EPOCHS,
    STRIKE_SEED,
    SpectrumBasis,
    StrikeBench,
    between_nodes,
    spectrum_pair,
)
from experiments.paper.touch import (
    MIDDLE,
    NETWORK_SEED,
    PRESS_SEED,
    TOUCHNET_PRESSES,
    PressInputs,
    TouchBench,
    colours_pair,
    touchnet_pair,
)
from harness.authoring.audio.waves import error_shares, solve_readout
from harness.authoring.published.modules import Osf, ScaledPerceptrons, SkipPerceptron, exported_graph
from harness.authoring.touch.data import pressed, reference_maps, smooth_normals
from harness.authoring.training import Report
from harness.authoring.vision.lessons import draw_for
from harness.authoring.vision.places import sphere
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile import entries
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
    """Return the number of encoded values for a number of inputs."""
    return inputs * (1 + 2 * octaves)


def encode(rows: FloatArray, octaves: int) -> Tensor:
    """Encode normalised rows as ``[v, sin v, cos v, sin 2v, cos 2v, ...]``, in float32."""
    place = np.float32(rows)
    angles = [np.float32(2.0**k) * place for k in range(octaves)]
    parts = [place, *(wave for angle in angles for wave in (np.sin(angle), np.cos(angle)))]
    return torch.from_numpy(np.concatenate(parts, axis=1))


def initialise(layers: Iterable[nn.Module], random: np.random.Generator) -> None:
    """Sample weights of variance ``2 / inputs`` (He et al., Delving deep into rectifiers, ICCV 2015)."""
    for layer in layers:
        weight = random.standard_normal(tuple(layer.weight.shape)) * np.sqrt(2.0 / layer.in_features)
        with torch.no_grad():
            layer.weight.copy_(torch.from_numpy(np.float32(weight)))
            layer.bias.zero_()


def set_rate(adam: torch.optim.Adam, first: float, share: float) -> None:
    """Let the rate fall from its first to zero as half a cosine; ``share`` of the training is over."""
    for group in adam.param_groups:
        group["lr"] = 0.5 * first * (1.0 + np.cos(np.pi * share))


def make_perceptron(spec: FitSpec, inputs: int, outputs: int, random: np.random.Generator) -> SkipPerceptron:
    """Create an untrained perceptron in the published layout."""
    encoded = encoded_width(inputs, spec.octaves)
    network = SkipPerceptron(encoded, spec.width, outputs, spec.depth, spec.skip or None)
    initialise([*network.pts_linears, network.output_linear], random)
    return network


def set_last(network: SkipPerceptron, solved: AnyArray) -> None:
    """Replace the last layer by ``(in + 1, out)`` weights, the offsets in the last row."""
    with torch.no_grad():
        network.output_linear.weight.copy_(torch.from_numpy(np.float32(solved[:-1].T)))
        network.output_linear.bias.copy_(torch.from_numpy(np.float32(solved[-1])))


def train_graph(
    spec: FitSpec,
    pair: tuple[entries.Input, entries.Tensor],
    doc: str,
    draw: Drawn,
    seed: int,
    report: Callable[[float], None],
    scale: float = 1.0,
    solve: bool = True,
) -> bytes:
    """Train a network, solve its last layer for the features before it, and export it.

    Args:
        spec: the network and its training.
        pair: its input and its output tensor.
        doc: description that the graph stores.
        draw: function that samples the rows of a step.
        seed: random seed of the first weights and of the rows.
        report: function of the completed fraction of the steps.
        scale: factor of the trained outputs.
        solve: whether to solve the last layer or leave it as trained.
    """
    torch.set_num_threads(1)
    inputs, outputs = (int(tensor.shape[1]) for tensor in pair)
    network = make_perceptron(spec, inputs, outputs, np.random.default_rng([seed, 4]))
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
        # Weighted least squares over fresh rows.
        products: FloatArray = np.zeros(())
        targets: FloatArray = np.zeros(())
        for _ in range(_SOLVED):
            rows, wanted, weights = draw(random)
            with torch.no_grad():
                hidden = network.features(encode(rows, spec.octaves)).numpy().astype(np.float64)
            features = np.concatenate([hidden, np.ones((len(hidden), 1))], axis=1)
            weighted = features * weights[:, None]
            products, targets = products + weighted.T @ features, targets + weighted.T @ wanted
        ridge = _RIDGE * float(np.trace(products)) / len(products)
        set_last(network, np.linalg.solve(products + ridge * np.eye(len(products)), targets))
    plain, scales = (np.zeros(inputs), np.ones(inputs)), (np.full((1, 1), scale), np.zeros((1, 1)))
    scaled = ScaledPerceptrons([network], *plain, *scales, spec.octaves)
    return exported_graph(scaled, pair[:1], pair[1:], doc).SerializeToString()


_UNIFORM = 0.5
"""Share of bins that are drawn anywhere; the others where sounds have their energy, at less weight each."""


def train_spectrogram(bench: StrikeBench, spec: FitSpec, report: Report) -> bytes:
    """Train 1.0's network of sound on bins of the spectra of trained nodes, sampled at random."""
    basis, trained = SpectrumBasis.of(bench), bench.split.trained
    low, high = bench.mesh.bounds
    places = (bench.modes.points[trained] - low) / (high - low)
    gains = bench.modes.shapes[trained][:, basis.modes]
    flat = basis.spectra.reshape(len(basis.modes), -1)
    bins = np.ascontiguousarray(flat.T)
    levels = (gains**2).mean(axis=(0, 2))
    energy = (np.abs(flat) ** 2 * levels[:, None]).sum(axis=0)
    shares = _UNIFORM / len(energy) + (1.0 - _UNIFORM) * energy / energy.sum()
    cumulated = np.cumsum(shares)
    scale = float(np.sqrt((shares * energy).sum()))

    def draw(random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        node = random.integers(len(places), size=spec.batch)
        at = np.searchsorted(cumulated, random.random(spec.batch) * cumulated[-1], side="right")
        at = np.minimum(at, len(cumulated) - 1)
        values = np.einsum("km,kmd->kd", bins[at], gains[node]) / scale
        rows = np.concatenate([places[node], basis.places[at]], axis=1)
        even = 1.0 / (len(shares) * shares[at])  # undoes how bins are sampled
        return rows, np.concatenate([values.real, values.imag], axis=1), even

    doc = "A bin of a strike's spectrum, as in 1.0."
    progress = partial(report, "audio: training 1.0's network")
    return train_graph(spec, spectrum_pair(), doc, draw, STRIKE_SEED, progress, scale)


def train_colours(bench: TouchBench, spec: FitSpec, report: Report) -> bytes:
    """Train 1.0's network of touch on pixels of upright presses at the training points."""
    places = bench.places
    normals, nothing = smooth_normals(places.mesh, places.nodes.points), np.zeros(len(places.nodes))
    presses = Presses(places.nodes.points, normals, nothing + MIDDLE, nothing, nothing, nothing)
    reference = reference_maps(places.raster, presses, places.sensor, places.skirt)
    chosen = np.flatnonzero(reference.possible)
    low, high = places.mesh.bounds
    points = (places.nodes.points[chosen] - low) / (high - low)
    pictures = np.stack([bench.picture(each) for each in reference.maps[chosen]])
    colours = pictures.reshape(len(chosen), -1, 3)
    pixels = grid_points(-1.0, (places.sensor.rows, places.sensor.columns))

    def draw(random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        place = random.integers(len(points), size=spec.batch)
        pixel = random.integers(len(pixels), size=spec.batch)
        rows = np.concatenate([points[place], pixels[pixel]], axis=1)
        return rows, colours[place, pixel] / 127.5 - 1.0, np.ones(spec.batch)

    doc, progress = "A pixel of a press, as in 1.0.", partial(report, "touch: training 1.0's network")
    return train_graph(spec, colours_pair(), doc, draw, PRESS_SEED, progress)


FIELD_SEED = 0
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
        widths = [encoded_width(3, spec.octaves), *[width] * spec.depth, width + 1]
        self.trunk = nn.ModuleList(nn.Linear(*sizes) for sizes in pairwise(widths))
        self.direction, self.colour = nn.Linear(width + 2 * turned, width // 2), nn.Linear(width // 2, 3)
        initialise([*self.trunk, self.direction, self.colour], random)

    def forward(self, points: FloatArray, views: FloatArray, lights: FloatArray) -> tuple[Tensor, Tensor]:
        """``(n, 3)`` and ``(n,)``."""
        both = self.hidden(points)
        directions = [encode(each, self._turns) for each in (views, lights)]
        hidden = torch.relu(self.direction(torch.cat([both[:, :-1], *directions], dim=1)))
        return self.colour(hidden), both[:, -1]

    def hidden(self, points: FloatArray) -> Tensor:
        """Return ``(n, width + 1)``: the inputs of the colour, and the logits of the density at points."""
        hidden = encode(points, self._octaves)
        for layer in self.trunk[:-1]:
            hidden = torch.relu(layer(hidden))
        return self.trunk[-1](hidden)

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


def train_field(bench: ViewBench, spec: FieldSpec, report: Report) -> bytes:
    """Train 1.0's network of vision in the frame of the ball, on points away from the bench's views."""
    torch.set_num_threads(1)
    mesh = bench.lit.appearance.mesh
    middle, radius = ball_of(mesh)
    finest = 2.0 * radius / spec.samples
    lessons, _ = draw_for("osf", bench.lit, spec.places, finest, FIELD_SEED, bench.views)
    random = np.random.default_rng([FIELD_SEED, 77])
    space = sphere(_SPACE, random) * random.random((_SPACE, 1)) ** (1.0 / 3.0)
    shown = bytes_from_linear(lessons.colours.astype(np.float64)) / 255.0
    within = is_within(bench.lit.rays, middle + radius * space, mesh.face_normals, random)
    points, network = (lessons.points - middle) / radius, OsfField(spec)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([FIELD_SEED, 5])
    for step in range(spec.steps):
        set_rate(adam, spec.rate, step / spec.steps)
        adam.zero_grad()
        at = random.integers(len(points), size=spec.batch)
        away = random.integers(_SPACE, size=spec.batch // 2)
        raw, logits = network(points[at], lessons.views[at], lessons.lamps[at])
        wanted = torch.from_numpy(np.float32(shown[at]))
        wrong = ((0.5 + 0.6 * torch.tanh(0.5 * raw) - wanted) ** 2).mean(dim=1)
        weight = torch.from_numpy(lessons.weight[at])
        inside = np.concatenate([lessons.depth[at] > 0.0, within[away]])
        every = torch.cat([logits, network.hidden(space[away])[:, -1]])
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
    branches = [make_perceptron(spec, 3, len(modes.frequencies), random) for _ in range(3)]
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

        def features(points: FloatArray, branch: SkipPerceptron = branch) -> AnyArray:
            starts = range(0, len(points), _CHUNK)
            with torch.no_grad():
                found = [branch.features(encoded(points[at : at + _CHUNK])).numpy() for at in starts]
            return np.concatenate([np.concatenate(found), np.ones((len(points), 1), np.float32)], axis=1)

        solved = solve_readout(features, nodes, wanted[:, :, axis], np.arange(len(nodes)), shares).weights
        set_last(branch, solved)
    network = ScaledPerceptrons(branches, shift, factor, np.ones((3, 1)), np.zeros((3, 1)), spec.octaves)
    taken, given = network_tensors(len(modes.frequencies), ANYWHERE)
    doc = "A place to the shapes of the modes there, as in 2.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()


def train_touchnet(bench: TouchBench, spec: FitSpec, report: Report) -> bytes:
    """Train 2.0's TouchNet on pixels of feasible presses at the training points."""
    places = bench.places
    normals = smooth_normals(places.mesh, places.nodes.points)
    at = np.random.default_rng([NETWORK_SEED, 9]).integers(len(places.nodes), size=TOUCHNET_PRESSES)
    drawn = pressed(places.nodes.points[at], normals[at], NETWORK_SEED + 3)
    flat = replace(drawn, yaws=np.zeros(len(drawn)))
    reference = reference_maps(places.raster, flat, places.sensor, places.skirt)
    possible = np.flatnonzero(reference.possible)
    presses, inputs = flat[possible], PressInputs.of(places)
    maps = reference.maps[possible].reshape(len(possible), -1).astype(np.float32)
    thickness = places.sensor.gel_thickness  # the unit of the trained outputs

    def draw(random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        which = random.integers(len(maps), size=spec.batch)
        pixel = random.integers(maps.shape[1], size=spec.batch)
        depths = (maps[which, pixel] / np.float32(thickness))[:, None]
        return inputs.rows(presses[which], pixel), depths, np.ones(spec.batch)

    doc = "A pixel of a press to the gel's indentation there, as in 2.0."
    progress = partial(report, "touch: training 2.0's network")
    return train_graph(spec, touchnet_pair(), doc, draw, NETWORK_SEED, progress, thickness, solve=False)
