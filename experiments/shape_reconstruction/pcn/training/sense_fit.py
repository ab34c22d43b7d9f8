"""Fit a network of one sense or both, on a graphics processor where there is one."""

import sys
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.pcn.training.fit import chamfer
from experiments.shape_reconstruction.pcn.training.profiles import CompletionProfile
from experiments.shape_reconstruction.pcn.training.sense_samples import SenseSamples
from harness.basics.arrays import FloatArray

RATE = 5.0e-4
DECAY = 1.0e-2

_COARSELY = 1024
"""Points all over the shape that the coarse clouds are compared with."""

_SAID_EVERY = 20.0

Module = TypeVar("Module", bound=nn.Module)


def fitted_completion(
    name: str,
    make: Callable[[], Module],
    samples: SenseSamples,
    amounts: CompletionProfile,
    seed: int,
    device: str,
) -> Module:
    """A network, its rate rising for a hundredth of the steps and then falling as half a cosine.

    Args:
        name: of the network, for progress.
        make: it, with its first weights.
        samples: to learn from.
        amounts: of the fit.
        seed: of the first weights and of the order of samples.
        device: ``"cpu"`` or ``"cuda"``; sums on the latter are in no fixed order.
    """
    torch.manual_seed(seed)
    torch.set_float32_matmul_precision("high")
    draw = torch.Generator().manual_seed(seed)
    module, steps = make().to(device), amounts.steps
    adam = torch.optim.AdamW(module.parameters(), lr=RATE, weight_decay=DECAY)
    falling = torch.optim.lr_scheduler.OneCycleLR(adam, RATE, total_steps=steps + 1, pct_start=0.01)
    inputs = [torch.from_numpy(value).to(device) for value in samples.inputs.values()]
    whole = torch.from_numpy(samples.whole).to(device)
    module.train()
    began = said = time.perf_counter()
    for step in range(steps):
        rows = torch.randint(len(whole), (amounts.batch,), generator=draw).to(device)
        given, wanted = _mirrored([value[rows] for value in inputs], whole[rows], draw)
        loss = _loss(module, given, wanted, amounts.compared, draw)
        adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(module.parameters(), 1.0)
        adam.step()
        falling.step()
        if (now := time.perf_counter()) - said > _SAID_EVERY:
            said = now
            left = (now - began) / (step + 1) * (steps - step - 1)
            sys.stderr.write(
                f"{name}: step {step + 1} of {steps}: {float(loss.detach()):.4f}, {left:.0f} s left\n"
            )
    return module.eval()


def _loss(
    module: nn.Module, given: list[Tensor], whole: Tensor, compared: int, draw: torch.Generator
) -> Tensor:
    """Of every cloud alike: what is folded can be no better than what it is folded from."""
    coarse, dense = module(*given)

    def some(points: Tensor, count: int) -> Tensor:
        return points[:, torch.randperm(points.shape[1], generator=draw)[:count].to(points.device)]

    found, few = chamfer(some(dense, compared), some(whole, compared)).mean(), some(whole, _COARSELY)
    return torch.stack([found, *(chamfer(cloud, few).mean() for cloud in coarse)]).sum()


def _mirrored(given: list[Tensor], whole: Tensor, draw: torch.Generator) -> tuple[list[Tensor], Tensor]:
    """Half of the samples in a mirror that holds the camera and the vertical; windows as float32."""
    flips = (torch.rand(len(whole), generator=draw) < 0.5).to(whole.device)
    mirror = torch.where(flips, -1.0, 1.0)[:, None]

    def points(value: Tensor) -> Tensor:
        return torch.stack([value[..., 0], value[..., 1] * mirror, value[..., 2]], dim=-1)

    def one(value: Tensor) -> Tensor:
        if value.ndim == 3:
            return points(value)
        window = value.to(torch.float32)
        return torch.where(flips[:, None, None, None], window.flip(3), window)

    return [one(value) for value in given], points(whole)


def completion_errors(module: nn.Module, samples: SenseSamples, batch: int, device: str) -> FloatArray:
    """``(n,)`` m: Chamfer-L1 from the dense cloud to the points all over each shape and back."""
    found = []
    with torch.no_grad():
        for first in range(0, len(samples.whole), batch):
            part = samples.of(np.arange(len(samples.whole))[first : first + batch])
            given = [torch.from_numpy(np.asarray(value)).to(device) for value in part.inputs.values()]
            dense = module(*(value.to(torch.float32) for value in given))[1]
            found.append(chamfer(dense, torch.from_numpy(part.whole).to(device)).cpu().numpy())
    return np.asarray(np.concatenate(found) * samples.reach)
