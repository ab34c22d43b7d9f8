"""A teacher's training: from the surface's own answers, resumed exactly."""

from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from harness.authoring.adam_state import load_training, save_training
from harness.authoring.checkpoint import Progress
from harness.authoring.vision.lessons import Lessons
from harness.authoring.vision.teacher_network import Teacher
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.store import digest
from harness.objectfile.vision_tensors import EXTRAS

VERSION = 1
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""

_FAINT = 1e-3
"""Linear light added under the root."""

_AT_ONCE = 1 << 15
"""Places that are asked together."""

_WARM = 0.02
"""Share of the steps over which the rate rises."""


class TeacherTraining:
    """A training that can stop after any epoch and go on from its checkpoint, bit for bit on one thread.

    Nothing random has a state: places and lamps of an epoch are drawn from the seed and its number.

    Args:
        spec: of the network.
        low: ``(3,)`` m, least corner of the lattice.
        extent: m, its longest side.
        lessons: what it learns from.
        lamps: ``(m, 3)`` float32, drawn anew at every step for a teacher that is told visibility and
            normal; ``(0, 3)`` where each lesson has a lamp of its own.
        seed: of first weights, and of what is drawn.
        device: of torch; None for a GPU where there is one.

    Attributes:
        network: that is trained.
        device: of torch.
        identity: a digest of all that the training depends on.
        epoch: that were trained.
        losses: of each.
    """

    def __init__(
        self,
        spec: TeacherSpec,
        low: FloatArray,
        extent: float,
        lessons: Lessons,
        lamps: AnyArray,
        seed: int,
        device: str | None = None,
    ) -> None:
        self._spec, self._seed, self._low, self._extent = spec, seed, low, extent
        self.device = torch.device(device or ("cuda" if torch.cuda.is_available() else "cpu"))
        self._lessons = _Tensors(lessons, self.local(lessons.points), lamps, self.device)
        self.network = Teacher(spec, seed).to(self.device)
        self._adam = adam_of(self.network)
        self.epoch = 0
        self.losses: list[float] = []
        # What it is finished by comes later, and changes nothing of this.
        sizes = [value for name, value in asdict(spec).items() if name != "finish"]
        self.identity = digest(
            [
                *("vision teacher", VERSION, sizes, seed, low, extent, lessons.points),
                *(lessons.normals, lessons.colours, lessons.lamps, lamps),
            ]
        )

    @property
    def epochs(self) -> int:
        """That it takes."""
        return self._spec.epochs

    @property
    def done(self) -> bool:
        """Whether all epochs were trained."""
        return self.epoch >= self._spec.epochs

    def step_epoch(self) -> float:
        """Train one epoch; root mean square of colours' errors on the way, as roots of linear light."""
        spec, random = self._spec, np.random.default_rng([self._seed, 79, self.epoch])
        first = self.epoch * spec.steps // spec.epochs
        last = (self.epoch + 1) * spec.steps // spec.epochs
        total = torch.zeros((), device=self.device)
        for step in range(first, last):
            set_rate(self._adam, spec, step / spec.steps)
            total += self._step(random)
        self.epoch += 1
        self.losses.append(float((total / (last - first)).sqrt()))
        return self.losses[-1]

    def ask(
        self, points: FloatArray, views: AnyArray, lights: AnyArray, extras: AnyArray
    ) -> tuple[AnyArray, AnyArray]:
        """What it answers: ``(n,)`` density, -1 to 1 as ``Lessons.depth``, and ``(n, 3)`` linear colour.

        Args:
            points: ``(n, 3)`` m, object frame.
            views: ``(n, 3)`` unit, from the camera.
            lights: ``(n, 3)`` unit, towards the lamp.
            extras: ``(n, 4)`` visibility and normal; ``(n, 0)`` of a kind that is not told.
        """
        density, colour = np.empty(len(points), np.float32), np.empty((len(points), 3), np.float32)
        places = self.local(points)
        with torch.no_grad():
            for begin in range(0, len(points), _AT_ONCE):
                at = slice(begin, begin + _AT_ONCE)
                told = [tensor_of(each[at], self.device) for each in (places, views, lights, extras)]
                raw, logits = self.network(*told)
                density[at], colour[at] = raw.cpu().numpy(), torch.sigmoid(logits).cpu().numpy()
        return density, colour

    def save(self, path: Path) -> None:
        """Write a checkpoint (``adam_state.save_training``)."""
        save_training(path, self.identity, Progress(self.epoch, self.losses), self.network, self._adam)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, data or seed.
        """
        progress = load_training(path, self.identity, self.network, self._adam)
        self.epoch, self.losses = progress.epoch, progress.losses

    def _local(self, points: FloatArray) -> AnyArray:
        return np.asarray((points - self._low) / self._extent, np.float32)

    def lesson_loss(self, random: np.random.Generator) -> tuple[Tensor, Tensor]:
        """Of a batch of places: the mean square of the colours' errors, and what is made less.

        Args:
            random: that draws it.
        """
        spec = self._spec
        drawn = self._lessons.drawn(random, spec)
        raw, logits = self.network(drawn.places, drawn.views, drawn.lights, drawn.extras)
        error = root_of(torch.sigmoid(logits)) - root_of(drawn.wanted)
        of_colour = (drawn.weight[:, None] * error**2).mean()
        return of_colour, of_colour + spec.opacity * _depth_error(raw, drawn.depth).mean()

    def local(self, points: FloatArray) -> AnyArray:
        """``(n, 3)`` float32 of places in metres: 0 to 1 along the lattice."""
        return np.asarray((points - self._low) / self._extent, np.float32)

    def _step(self, random: np.random.Generator) -> Tensor:
        """One step; the mean square of the colours' errors before it."""
        of_colour, loss = self.lesson_loss(random)
        stepped(self._adam, loss)
        return of_colour.detach()


def adam_of(network: Teacher) -> torch.optim.Adam:
    """That trains a teacher's tables and layers, each at a rate of its own."""
    tables = list(network.features.parameters())
    layers = [each for name, each in network.named_parameters() if not name.startswith("features")]
    return torch.optim.Adam(
        [{"params": tables}, {"params": layers}], betas=(0.9, 0.99), eps=1e-10, fused=True
    )


def set_rate(adam: torch.optim.Adam, spec: TeacherSpec, over: float, share: float = 1.0) -> None:
    """The rates of tables and layers where so much of all steps is over: half a cosine, after a rise.

    Args:
        adam: of ``adam_of``.
        spec: of the network.
        over: share of the steps.
        share: of the rates of the spec.
    """
    now = share * 0.5 * (1.0 + np.cos(np.pi * over)) * min(1.0, (over + 1e-3) / _WARM)
    for group, rate in zip(adam.param_groups, (spec.table_rate, spec.rate), strict=True):
        group["lr"] = float(rate * now)


def stepped(adam: torch.optim.Adam, loss: Tensor) -> None:
    """Make a loss less by one step."""
    adam.zero_grad()
    torch.autograd.backward(loss)
    adam.step()


def root_of(light: Tensor) -> Tensor:
    """Linear light as it is compared: near to how a screen shows it."""
    return torch.sqrt(light + _FAINT)


class _Drawn:
    """A batch: what is told, and what is to be answered."""

    def __init__(self, *tensors: Tensor) -> None:
        self.places, self.views, self.lights, self.extras, self.wanted, self.weight, self.depth = tensors


class _Tensors:
    """Lessons on a device."""

    def __init__(self, lessons: Lessons, places: AnyArray, lamps: AnyArray, device: torch.device) -> None:
        self._device, self._count = device, len(lessons)
        self._places, self._lamps = tensor_of(places, device), tensor_of(lamps, device)
        names = ("views", "normals", "colours", "weight", "depth", "lamps")
        self._of = {name: tensor_of(getattr(lessons, name), device) for name in names}

    def drawn(self, random: np.random.Generator, spec: TeacherSpec) -> _Drawn:
        at = tensor_of(random.integers(self._count, size=spec.batch), self._device)
        views, normals, wanted, weight, depth, lights = (each[at] for each in self._of.values())
        extras = normals[:, :0]
        if len(self._lamps):
            lights, seen, cosine = self._lit_anew(random, spec, normals)
            extras = torch.cat([seen[:, None], normals], dim=1) if EXTRAS[spec.kind] else extras
            wanted = wanted * (seen * cosine)[:, None]
        return _Drawn(self._places[at], views, lights, extras, wanted, weight, depth)

    def _lit_anew(
        self, random: np.random.Generator, spec: TeacherSpec, normals: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Lamps on the side of places, or hidden ones from anywhere; whether seen; cosines."""
        which = tensor_of(random.integers(len(self._lamps), size=spec.batch), self._device)
        seen = tensor_of(random.random(spec.batch) >= spec.hidden, self._device)
        lamps = self._lamps[which]
        cosine = (lamps * normals).sum(dim=1)
        turned = torch.where(seen & (cosine < 0.0), -1.0, 1.0)
        return turned[:, None] * lamps, seen.float(), (turned * cosine).clamp(min=0.0)


def _depth_error(raw: Tensor, depth: Tensor) -> Tensor:
    """Square of it; deeper than opaque and emptier than empty are no errors."""
    error = raw - depth
    done = ((depth >= 1.0) & (error > 0.0)) | ((depth <= -1.0) & (error < 0.0))
    return torch.where(done, 0.0, error) ** 2


def tensor_of(array: AnyArray, device: torch.device) -> Tensor:
    """An array on a device."""
    return torch.from_numpy(np.ascontiguousarray(array)).to(device)
