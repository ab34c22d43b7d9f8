"""Trains 1.0's field on what leaves places beside the surface, and on where the object is and is not.

1.0 trains by marching through pictures, which takes GPU hours. What it learns from there is regressed
directly: the colour that leaves a place towards a view under a light, and whether a place is within the
object.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from experiments.baselines.look.bench import ViewBench
from experiments.baselines.look.field import REACH, ball_of
from experiments.baselines.settings import FieldSpec
from experiments.baselines.within import is_within
from harness.authoring.perceptron import dense_layers, encode, set_rate
from harness.authoring.published.modules import Osf, exported_graph
from harness.authoring.training import Report
from harness.authoring.vision.lessons import Lessons, draw_for
from harness.authoring.vision.places import sphere
from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.objectfile.graph import Encoding, Normaliser
from harness.objectfile.published.look import osf_tensors
from harness.picture.srgb import bytes_from_linear

SEED = 0
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
        random = np.random.default_rng([SEED, 4])
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
    """What a field learns from, in the frame of the ball.

    Attributes:
        lessons: places beside the surface, under lamps of their own.
        points: ``(n, 3)`` of these.
        shown: ``(n, 3)`` their colours as shown, 0 to 1.
        space: ``(m, 3)`` places of the whole ball.
        inside: ``(m,)`` whether the object is there.
    """

    lessons: Lessons
    points: FloatArray
    shown: AnyArray
    space: FloatArray
    inside: BoolArray

    @classmethod
    def drawn(cls, bench: ViewBench, spec: FieldSpec) -> "FieldRows":
        """Of the object of a bench, clear of its views."""
        mesh = bench.lit.appearance.mesh
        middle, radius = ball_of(mesh)
        lessons, _ = draw_for("osf", bench.lit, spec.places, 2.0 * radius / spec.samples, SEED, bench.views)
        random = np.random.default_rng([SEED, 77])
        space = sphere(_SPACE, random) * random.random((_SPACE, 1)) ** (1.0 / 3.0)
        shown = bytes_from_linear(lessons.colours.astype(np.float64)) / 255.0
        inside = is_within(bench.lit.rays, middle + radius * space, mesh.face_normals, random)
        return cls(lessons, (lessons.points - middle) / radius, shown, space, inside)


def train_field(bench: ViewBench, spec: FieldSpec, report: Report) -> bytes:
    """The graph of the trained network."""
    torch.set_num_threads(1)
    rows, network = FieldRows.drawn(bench, spec), OsfField(spec)
    adam = torch.optim.Adam(network.parameters(), lr=spec.rate)
    random = np.random.default_rng([SEED, 5])
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
