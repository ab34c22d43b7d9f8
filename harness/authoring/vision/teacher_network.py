"""One network of an object's whole look, in torch: features of places, then a small perceptron.

Object scattering functions (Guo et al., 2020; Gao et al., ObjectFolder 2.0, CVPR 2022, section 4.1): a place,
the way the light travels to the camera and the way to the lamp become a density and the fraction of the
lamp's light that is scattered towards the camera. Places are encoded by features learned at the corners of
cubes of several sizes (Mueller et al., Instant Neural Graphics Primitives, SIGGRAPH 2022, section 3).
"""

from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from harness.authoring.perceptron import dense_layer
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.objectfile.vision_tensors import EXTRAS

_PRIMES = (1, 2_654_435_761, 805_459_861)
"""Of the hash, as in the source."""

_FIRST = 1e-4
"""Features to begin with are uniform to this, as in the source."""

_DARK = -1.0
"""Of colours' logits, to begin with."""


class Features(nn.Module):
    """``(n, 3)`` places, 0 to 1 along the lattice, to ``(n, levels * features)``.

    A level whose corners fit into its table has a row for each; of a finer one corners share rows.
    """

    def __init__(self, spec: TeacherSpec, random: np.random.Generator) -> None:
        super().__init__()
        self._sides = spec.resolutions
        self._slots = [min((side + 1) ** 3, 1 << spec.slots) for side in self._sides]
        tables = (random.uniform(-_FIRST, _FIRST, (slots, spec.features)) for slots in self._slots)
        self.tables = nn.ParameterList(
            [nn.Parameter(torch.from_numpy(np.float32(table))) for table in tables]
        )

    def forward(self, places: Tensor) -> Tensor:
        """Features, linear between corners."""
        return torch.cat([self._level(k, places) for k in range(len(self._sides))], dim=1)

    def _level(self, level: int, places: Tensor) -> Tensor:
        side, table = self._sides[level], self.tables[level]
        scaled = places.clamp(0.0, 1.0) * side
        corner = scaled.detach().floor().clamp(max=side - 1)
        rows = self._rows(level, corner.long())
        above = scaled - corner
        shares = torch.stack([1.0 - above, above], dim=2)
        weights = shares[:, 0, :, None, None] * shares[:, 1, None, :, None] * shares[:, 2, None, None, :]
        found = table.index_select(0, rows.reshape(-1)).reshape(len(places), 8, -1)
        return (found * weights.reshape(len(places), 8, 1)).sum(dim=1)

    def _rows(self, level: int, corner: Tensor) -> Tensor:
        """``(n, 2, 2, 2)`` rows of a cube's corners."""
        both = torch.stack([corner, corner + 1], dim=2)
        side, slots = self._sides[level] + 1, self._slots[level]
        if side**3 == slots:
            x, y, z = both[:, 0], both[:, 1] * side, both[:, 2] * side**2
            return x[:, :, None, None] + y[:, None, :, None] + z[:, None, None, :]
        x, y, z = (both[:, axis] * _PRIMES[axis] for axis in range(3))
        return (x[:, :, None, None] ^ y[:, None, :, None] ^ z[:, None, None, :]) & (slots - 1)


class Teacher(nn.Module):
    """Places, views, lights and what else its kind is told, to densities and colours' logits."""

    def __init__(self, spec: TeacherSpec, seed: int) -> None:
        super().__init__()
        random = np.random.default_rng([seed, 78])
        self._turns, self._told = spec.turns, EXTRAS[spec.kind]
        self.features = Features(spec, random)
        wide, given = spec.width, 3 + spec.levels * spec.features
        more = self._told + 1 if self._told else wide
        seen = wide + 2 * spec.direction + more
        self.basis = _layers((spec.direction, wide, wide), random) if not self._told else nn.ModuleList()
        self.trunk = _layers((given, wide, wide), random)
        self.density = _layers((wide, 1), random)
        self.scatter = _layers((seen, *(wide,) * spec.deep, 3), random)
        with torch.no_grad():
            self.scatter[-1].bias.fill_(_DARK)

    def forward(self, places: Tensor, views: Tensor, lights: Tensor, extras: Tensor) -> tuple[Tensor, Tensor]:
        """Densities ``(n,)``, below zero where it is empty, and logits ``(n, 3)`` of what is scattered.

        Args:
            places: ``(n, 3)``, 0 to 1 along the lattice.
            views: ``(n, 3)`` unit, from the camera.
            lights: ``(n, 3)`` unit, towards the lamp.
            extras: ``(n, 4)`` visibility and normal; ``(n, 0)`` of a kind that is not told.
        """
        hidden = torch.cat([2.0 * places - 1.0, self.features(places)], dim=1)
        for layer in self.trunk:
            hidden = torch.relu(layer(hidden))
        density = self.density[0](hidden)[:, 0]
        towards = _waves(lights, self._turns)
        more = self._lit(lights, extras) if self._told else [hidden * self._of_lamp(towards)]
        hidden = torch.cat([hidden, _waves(views, self._turns), towards, *more], dim=1)
        for layer in self.scatter[:-1]:
            hidden = torch.relu(layer(hidden))
        return density, self.scatter[-1](hidden)

    def _lit(self, lights: Tensor, extras: Tensor) -> list[Tensor]:
        """What a matt white surface would scatter, beside what it follows from."""
        cosine = (lights * extras[:, 1:]).sum(dim=1, keepdim=True)
        return [extras, extras[:, :1] * cosine.clamp(min=0.0)]

    def _of_lamp(self, towards: Tensor) -> Tensor:
        """``(n, width)`` by which a place's numbers are multiplied.

        Light is so transferred by what a place is and what a lamp is (Sloan et al., Precomputed Radiance
        Transfer, SIGGRAPH 2002), both learned.
        """
        return self.basis[1](torch.relu(self.basis[0](towards)))


def _layers(sizes: tuple[int, ...], random: np.random.Generator) -> nn.ModuleList:
    return nn.ModuleList([dense_layer(taken, given, random) for taken, given in pairwise(sizes)])


def _waves(directions: Tensor, turns: int) -> Tensor:
    """``vision_plain.encoded`` of them."""
    angles = [2.0**k * directions for k in range(turns)]
    waves = [wave(angle) for angle in angles for wave in (torch.sin, torch.cos)]
    return torch.cat([directions, *waves], dim=1)
