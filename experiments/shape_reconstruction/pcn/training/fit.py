"""Fit the point completion network to sets of touches."""

import sys
import time

import numpy as np
import torch
from torch import Tensor

from experiments.shape_reconstruction.pcn.training.networks import CompletionNetwork
from experiments.shape_reconstruction.pcn.training.samples import TouchSets
from harness.basics.arrays import FloatArray

RATE = 1.0e-3
BATCH = 12
COMPARED = 768
"""Of the points all over a shape, that an answer is compared with at a step."""

SHOWN = 384
"""Of the touched points, at a step: what is greatest over all is greatest over nearly all of them."""

_SAID_EVERY = 20.0


def fitted(sets: TouchSets, steps: int, seed: int) -> CompletionNetwork:
    """A network, its rate falling as half a cosine; every set turned and mirrored anew at each step."""
    torch.manual_seed(seed)
    draw = torch.Generator().manual_seed(seed)
    module = CompletionNetwork()
    adam = torch.optim.Adam(module.parameters(), lr=RATE)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
    touched, whole = torch.from_numpy(sets.touched), torch.from_numpy(sets.whole)
    began = said = time.perf_counter()
    for step in range(steps):
        rows = torch.randint(len(touched), (BATCH,), generator=draw)
        some = torch.randperm(whole.shape[1], generator=draw)[:COMPARED]
        shown = torch.randperm(touched.shape[1], generator=draw)[:SHOWN]
        given, wanted = turned(touched[rows][:, shown], whole[rows][:, some], draw)
        loss = chamfer(module(given), wanted).mean()
        adam.zero_grad()
        loss.backward()
        adam.step()
        falling.step()
        if (now := time.perf_counter()) - said > _SAID_EVERY:
            said = now
            left = (now - began) / (step + 1) * (steps - step - 1)
            sys.stderr.write(f"step {step + 1} of {steps}: {float(loss.detach()):.4f}, {left:.0f} s left\n")
    module.eval()
    return module


def turned(touched: Tensor, whole: Tensor, draw: torch.Generator) -> tuple[Tensor, Tensor]:
    """Both, each set by its own angle about the vertical, half of them mirrored; in their frame as it was."""
    angle = 2.0 * np.pi * torch.rand((len(touched), 1), generator=draw)
    mirror = torch.where(torch.rand((len(touched), 1), generator=draw) < 0.5, 1.0, -1.0)
    c, s = torch.cos(angle), torch.sin(angle)
    return _framed(_turned(touched, c, s, mirror), _turned(whole, c, s, mirror))


def _turned(points: Tensor, c: Tensor, s: Tensor, mirror: Tensor) -> Tensor:
    x, y = points[..., 0], mirror * points[..., 1]
    return torch.stack([c * x - s * y, s * x + c * y, points[..., 2]], dim=-1)


def _framed(touched: Tensor, whole: Tensor) -> tuple[Tensor, Tensor]:
    """In the frame of what is touched as it is now: a turned box has another middle and longest side."""
    low, high = touched.amin(dim=1), touched.amax(dim=1)
    middle = 0.5 * (low + high)
    middle[:, 2] = 0.0
    sides = torch.stack([high[:, 0] - low[:, 0], high[:, 1] - low[:, 1], high[:, 2]])
    reach = sides.amax(dim=0)[:, None, None]
    return (touched - middle[:, None]) / reach, (whole - middle[:, None]) / reach


def chamfer(found: Tensor, wanted: Tensor) -> Tensor:
    """``(n,)`` half the sum of the mean distances both ways, of ``(n, a, 3)`` and ``(n, b, 3)`` points."""
    # By the nearest of squares, then its root: a root of every pair costs more than all the rest.
    with torch.no_grad():
        apart = torch.cdist(found, wanted)
        there, back = apart.argmin(dim=2), apart.argmin(dim=1)
    nearest = torch.gather(wanted, 1, there[..., None].expand(-1, -1, 3))
    reached = torch.gather(found, 1, back[..., None].expand(-1, -1, 3))
    return 0.5 * (_lengths(found - nearest).mean(dim=1) + _lengths(wanted - reached).mean(dim=1))


def _lengths(between: Tensor) -> Tensor:
    return torch.sqrt((between**2).sum(dim=-1) + 1e-12)


def errors(module: CompletionNetwork, sets: TouchSets) -> FloatArray:
    """``(n,)`` m: Chamfer-L1 between the points given and those all over each shape."""
    found = []
    with torch.no_grad():
        for first in range(0, len(sets.touched), BATCH):
            rows = slice(first, first + BATCH)
            given = module(torch.from_numpy(sets.touched[rows]))
            found.append(chamfer(given, torch.from_numpy(sets.whole[rows])).numpy())
    return np.asarray(np.concatenate(found) * sets.reach)
