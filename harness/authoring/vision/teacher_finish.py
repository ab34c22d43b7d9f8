"""A teacher's last lessons: pictures, whose pixels are what it sees along their rays; resumed exactly.

The second stage of ObjectFolder 2.0 (Gao et al., CVPR 2022, section 4.1) and of KiloNeRF (Reiser et al., ICCV
2021, section 3.2). Here it follows a first one that knows the surface, which goes on beside it.
"""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from harness.authoring.adam_state import load_training, save_training
from harness.authoring.checkpoint import Progress
from harness.authoring.vision.finish_profiles import TeacherFinish
from harness.authoring.vision.seen import SeenRays
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.authoring.vision.teacher_training import (
    TeacherTraining,
    adam_of,
    root_of,
    set_rate,
    stepped,
    tensor_of,
)
from harness.basics.arrays import AnyArray
from harness.basics.store import digest

VERSION = 1
"""Raised with every change of what training computes, so that no old checkpoint is gone on from."""


class Finishing:
    """A training that can stop after any epoch and go on from its checkpoint, bit for bit on one thread.

    Args:
        taught: by the surface, to its end; its network is finished.
        spec: of the teacher.
        finish: of this stage.
        rays: of the pictures.
        density_scale: 1/m of a density of 1.
        seed: of what is drawn.
    """

    def __init__(
        self,
        taught: TeacherTraining,
        spec: TeacherSpec,
        finish: TeacherFinish,
        rays: SeenRays,
        density_scale: float,
        seed: int,
    ) -> None:
        self._taught, self._spec, self._finish, self._seed = taught, spec, finish, seed
        self._rays = _Rays(rays, taught, density_scale)
        self._adam = adam_of(taught.network)
        self.epoch = 0
        self.losses: list[float] = []
        self._identity = digest(
            [
                *("vision teacher finish", VERSION, taught.identity, list(astuple(finish)), seed),
                *(density_scale, rays.points, rays.lengths, rays.first, rays.views, rays.lights),
                *(rays.extras, rays.wanted, rays.weight),
            ]
        )

    @property
    def epochs(self) -> int:
        """That it takes."""
        return self._finish.epochs

    @property
    def done(self) -> bool:
        """Whether all epochs were trained."""
        return self.epoch >= self.epochs

    def step_epoch(self) -> float:
        """Train one epoch; root mean square of pixels' errors on the way, as roots of linear light."""
        finish, random = self._finish, np.random.default_rng([self._seed, 80, self.epoch])
        first, last = (at * finish.steps // finish.epochs for at in (self.epoch, self.epoch + 1))
        total = torch.zeros((), device=self._taught.device)
        for step in range(first, last):
            set_rate(self._adam, self._spec, step / finish.steps, finish.slower)
            of_pixels = self._rays.loss(random, finish.rays)
            stepped(self._adam, self._taught.lesson_loss(random)[1] + finish.weight * of_pixels)
            total += of_pixels.detach()
        self.epoch += 1
        self.losses.append(float((total / (last - first)).sqrt()))
        return self.losses[-1]

    def save(self, path: Path) -> None:
        """Write a checkpoint (``adam_state.save_training``)."""
        progress = Progress(self.epoch, self.losses)
        save_training(path, self._identity, progress, self._taught.network, self._adam)

    def load(self, path: Path) -> None:
        """Go on from a checkpoint.

        Raises:
            DataRefused: it cannot be read, or is of another network, object, pictures or seed.
        """
        progress = load_training(path, self._identity, self._taught.network, self._adam)
        self.epoch, self.losses = progress.epoch, progress.losses


class _Rays:
    """Rays on a device."""

    def __init__(self, rays: SeenRays, taught: TeacherTraining, density_scale: float) -> None:
        self._network, self._device, self._count = taught.network, taught.device, len(rays)
        self._places = tensor_of(taught.local(rays.points), self._device)
        thickness = (density_scale * rays.lengths.astype(np.float64)).astype(np.float32)
        self._thickness, self._first = tensor_of(thickness, self._device), rays.first
        told = (rays.views, rays.lights, rays.extras, rays.wanted, rays.weight)
        self._told = [tensor_of(each, self._device) for each in told]

    def loss(self, random: np.random.Generator, count: int) -> Tensor:
        """Mean square of pixels' errors, of colours and of what goes through an opaque thing."""
        drawn = random.integers(self._count, size=count)
        begin, every = self._first[drawn], np.diff(self._first)[drawn]
        ray, nth = np.repeat(np.arange(count), every), _counted(every)
        at, of, slot = (tensor_of(each, self._device) for each in (np.repeat(begin, every) + nth, ray, nth))
        views, lights, extras, wanted, weight = (each[tensor_of(drawn, self._device)] for each in self._told)
        raw, logits = self._network(self._places[at], views[of], lights[of], extras[of])
        thick = torch.zeros((count, int(every.max())), device=self._device)
        thick = thick.index_put((of, slot), raw.clamp(min=0.0) * self._thickness[at])
        shares = shares_of(thick)
        colour = torch.zeros((count, 3), device=self._device)
        colour = colour.index_add(0, of, shares[of, slot][:, None] * torch.sigmoid(logits))
        through = 1.0 - shares.sum(dim=1)
        error = ((root_of(colour) - root_of(wanted)) ** 2).mean(dim=1) + through**2
        return (weight * error).mean()


def shares_of(thick: Tensor) -> Tensor:
    """``(r, n)`` what each of n samples takes of a ray's light, of their optical thicknesses, near to far."""
    # Summed before and not subtracted after, which an opaque sample would cancel to nothing.
    before = torch.cumsum(torch.nn.functional.pad(thick, (1, 0))[:, :-1], dim=1)
    return torch.exp(-before) * -torch.expm1(-thick)


def _counted(every: AnyArray) -> AnyArray:
    """0, 1, ... of each."""
    ends = np.cumsum(every)
    counted: AnyArray = np.arange(ends[-1]) - np.repeat(ends - every, every)
    return counted
