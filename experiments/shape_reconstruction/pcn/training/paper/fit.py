"""Fit the paper's completion, on a graphics processor where there is one."""

import sys
import time

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.pcn.training.fit import chamfer
from experiments.shape_reconstruction.pcn.training.paper.networks import PaperNetwork
from experiments.shape_reconstruction.pcn.training.paper.samples import SenseSamples
from harness.basics.arrays import FloatArray

RATE = 5.0e-4
DECAY = 1.0e-2

COMPARED = 4096
"""Points of the dense cloud at a step, of as many all over the shape."""

_COARSELY = 1024
"""Points all over the shape that the coarse clouds are compared with."""

_SAID_EVERY = 20.0


def fitted_completion(
    sense: str, samples: SenseSamples, steps: int, batch: int, seed: int, device: str
) -> PaperNetwork:
    """A network, its rate rising for a hundredth of the steps and then falling as half a cosine.

    Args:
        sense: of ``INPUTS``.
        samples: to learn from.
        steps: of the fit.
        batch: samples a step.
        seed: of the first weights and of the order of samples.
        device: ``"cpu"`` or ``"cuda"``; sums on the latter are in no fixed order.
    """
    torch.manual_seed(seed)
    torch.set_float32_matmul_precision("high")
    draw = torch.Generator().manual_seed(seed)
    module = PaperNetwork(sense).to(device)
    adam = torch.optim.AdamW(module.parameters(), lr=RATE, weight_decay=DECAY)
    falling = torch.optim.lr_scheduler.OneCycleLR(adam, RATE, total_steps=steps + 1, pct_start=0.01)
    inputs = [torch.from_numpy(value).to(device) for value in samples.inputs.values()]
    whole = torch.from_numpy(samples.whole).to(device)
    module.train()
    began = said = time.perf_counter()
    for step in range(steps):
        rows = torch.randint(len(whole), (batch,), generator=draw).to(device)
        loss = _loss(module, *_mirrored([value[rows] for value in inputs], whole[rows], draw), draw)
        adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(module.parameters(), 1.0)
        adam.step()
        falling.step()
        if (now := time.perf_counter()) - said > _SAID_EVERY:
            said = now
            left = (now - began) / (step + 1) * (steps - step - 1)
            sys.stderr.write(
                f"{sense}: step {step + 1} of {steps}: {float(loss.detach()):.4f}, {left:.0f} s left\n"
            )
    return module.eval()


def _loss(module: PaperNetwork, given: list[Tensor], whole: Tensor, draw: torch.Generator) -> Tensor:
    """Of every cloud alike: what is folded can be no better than what it is folded from."""
    coarse, dense = module(*given)
    some = torch.randperm(dense.shape[1], generator=draw)[:COMPARED].to(dense.device)
    few = torch.randperm(whole.shape[1], generator=draw)[:_COARSELY].to(dense.device)
    found = chamfer(dense[:, some], whole).mean()
    return torch.stack([found, *(chamfer(cloud, whole[:, few]).mean() for cloud in coarse)]).sum()


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


def completion_errors(module: PaperNetwork, samples: SenseSamples, batch: int, device: str) -> FloatArray:
    """``(n,)`` m: Chamfer-L1 from the dense cloud to the points all over each shape and back."""
    found = []
    with torch.no_grad():
        for first in range(0, len(samples.whole), batch):
            part = samples.of(np.arange(len(samples.whole))[first : first + batch])
            given = [torch.from_numpy(np.asarray(value)).to(device) for value in part.inputs.values()]
            dense = module(*(value.to(torch.float32) for value in given))[1]
            found.append(chamfer(dense, torch.from_numpy(part.whole).to(device)).cpu().numpy())
    return np.asarray(np.concatenate(found) * samples.reach)
