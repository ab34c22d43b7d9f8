"""The network of the glance in torch, its graph, and the fit that all completion networks share.

The network is of the paper's kind with a thirtieth of its work: four residual blocks in place of the eight
of a ResNet-18, each a fourth to a half as wide, and no folding.
"""

import sys
import time
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from experiments.shape_reconstruction.prior.network import POINTS_GIVEN, SIDE
from experiments.shape_reconstruction.prior.samples import (
    SIZES,
    CompletionProfile,
    CompletionSamples,
    look_samples,
)
from harness.authoring.resnet import Convolution, ResidualBlock
from harness.basics.arrays import FloatArray
from harness.objectfile.graph import Nodes, float_value
from harness.sim.solid.household.families import FAMILIES

CHANNELS = (1, 32, 64, 96, 128)
"""Channels before and after each residual block; each halves the window."""

NARROW, CODE = 32, 512
"""Channels that are flattened, and width of the layers after them."""

_LAST = SIDE >> (len(CHANNELS) - 1)


class PriorNetwork(nn.Module):
    """From ``(n, 1, SIDE, SIDE)`` to ``(n, POINTS_GIVEN, 3)``."""

    def __init__(self) -> None:
        super().__init__()
        self.blocks = nn.ModuleList([ResidualBlock(*widths, 2) for widths in pairwise(CHANNELS)])
        self.narrow = Convolution(CHANNELS[-1], NARROW, 1, 1)
        self.decoder = nn.ModuleList(
            [nn.Linear(NARROW * _LAST**2, CODE), nn.Linear(CODE, CODE), nn.Linear(CODE, 3 * POINTS_GIVEN)]
        )

    def forward(self, window: Tensor) -> tuple[list[Tensor], Tensor]:
        """Return no coarse cloud, and ``(n, POINTS_GIVEN, 3)``."""
        found = window
        for block in self.blocks:
            found = block(found)
        hidden = torch.relu(self.narrow(found)).flatten(1)
        for layer in list(self.decoder)[:-1]:
            hidden = torch.relu(layer(hidden))
        return [], self.decoder[-1](hidden).reshape(-1, POINTS_GIVEN, 3)

    def graph(self) -> bytes:
        """Write the network as a graph from ``window`` to ``completed``."""
        nodes, found = Nodes("float16"), "window"  # of the weights; computed in float32
        for block in self.blocks:
            found = block.write(nodes, found)
        found = nodes.add("Relu", self.narrow.write(nodes, found))
        hidden = nodes.add("Flatten", found, axis=1)
        for layer in list(self.decoder)[:-1]:
            hidden = nodes.add("Relu", linear(nodes, hidden, layer))
        flat = linear(nodes, hidden, self.decoder[-1])
        nodes.add(
            "Reshape", flat, nodes.constant(np.array([-1, POINTS_GIVEN, 3], np.int64)), name="completed"
        )
        inputs = [float_value("window", ("n", 1, SIDE, SIDE))]
        outputs = [float_value("completed", ("n", POINTS_GIVEN, 3))]
        what = "The silhouette of an object to points all over it."
        return bytes(nodes.model("glance", inputs, outputs, what).SerializeToString())


def linear(nodes: Nodes, value: str, layer: Any) -> str:
    """Write a linear layer over the last axis to a graph."""
    weight = nodes.weight(layer.weight.detach().numpy().T, "a layer")
    product = nodes.add("MatMul", value, weight)
    if layer.bias is None:
        return product
    return nodes.add("Add", product, nodes.weight(layer.bias.detach().numpy(), "a bias"))


def train_prior(
    amounts: CompletionProfile, seed: int, processes: int, device: str
) -> tuple[bytes, dict[str, Any]]:
    """Train the network of the glance; return the bytes of its graph, and its card."""
    torch.set_num_threads(1)  # the same bits on every machine
    samples = look_samples(amounts.shapes, amounts.sets, seed, processes)
    what = f"{POINTS_GIVEN} points all over an object, from its silhouette in {SIDE} x {SIDE} pixels"
    return train_completion("glance", PriorNetwork, samples, amounts, seed, device, {"what": what})


HELD_OUT = 0.1
"""Fraction of the shapes that is held out."""


def train_completion(
    name: str,
    make: Callable[[], Any],
    samples: CompletionSamples,
    amounts: CompletionProfile,
    seed: int,
    device: str,
    described: Mapping[str, object],
) -> tuple[bytes, dict[str, Any]]:
    """Fit a completion network and measure it on held-out shapes; return its graph's bytes and its card.

    Args:
        name: name of the network, for progress.
        make: creates the network, with ``graph()``.
        samples: samples of all shapes.
        amounts: profile of the samples and of the fit.
        seed: seed of the first weights and of the order of samples.
        device: ``"cpu"`` or ``"cuda"``.
        described: first entries of the card.
    """
    last = amounts.shapes - round(HELD_OUT * amounts.shapes)
    learnt, held = samples.of(samples.shapes < last), samples.of(samples.shapes >= last)
    module = _fit_completion(name, make, learnt, amounts, seed, device)
    card = {
        **described,
        "parameters": sum(value.numel() for value in module.parameters()),
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "samples": len(learnt.shapes),
            "sizes_m": list(SIZES),
            "steps": amounts.steps,
            "batch": amounts.batch,
            "seed": seed,
        },
        "fitted": _errors(module, learnt.of(np.arange(0, len(learnt.shapes), 8)), amounts.batch, device),
        "held_out": _errors(module, held, amounts.batch, device),
        "device": torch.cuda.get_device_name() if device == "cuda" else device,
    }
    return module.cpu().graph(), card


RATE = 5.0e-4
DECAY = 1.0e-2

_COARSE_COMPARED = 1024
"""Points of the shape that the coarse clouds are compared with."""

_SECONDS_BETWEEN_LINES = 20.0


def _fit_completion(
    name: str,
    make: Callable[[], Any],
    samples: CompletionSamples,
    amounts: CompletionProfile,
    seed: int,
    device: str,
) -> Any:
    """Fit a network; its rate rises for a hundredth of the steps, then falls as half a cosine."""
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
        if (now := time.perf_counter()) - said > _SECONDS_BETWEEN_LINES:
            said = now
            left = (now - began) / (step + 1) * (steps - step - 1)
            sys.stderr.write(
                f"{name}: step {step + 1} of {steps}: {float(loss.detach()):.4f}, {left:.0f} s left\n"
            )
    return module.eval()


def _loss(
    module: nn.Module, given: list[Tensor], whole: Tensor, compared: int, draw: torch.Generator
) -> Tensor:
    """Sum the Chamfer distances of all clouds: a folded cloud is no better than the one it is folded from."""
    coarse, dense = module(*given)

    def some(points: Tensor, count: int) -> Tensor:
        return points[:, torch.randperm(points.shape[1], generator=draw)[:count].to(points.device)]

    found, few = chamfer(some(dense, compared), some(whole, compared)).mean(), some(whole, _COARSE_COMPARED)
    return torch.stack([found, *(chamfer(cloud, few).mean() for cloud in coarse)]).sum()


def _mirrored(given: list[Tensor], whole: Tensor, draw: torch.Generator) -> tuple[list[Tensor], Tensor]:
    """Mirror half of the samples in the plane of the camera and the vertical; windows become float32."""
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


def chamfer(found: Tensor, wanted: Tensor) -> Tensor:
    """Compute the ``(n,)`` Chamfer-L1 distances between ``(n, a, 3)`` and ``(n, b, 3)`` points."""
    # The root is taken of the nearest squares alone: a root of every pair costs more than all the rest.
    with torch.no_grad():
        apart = torch.cdist(found, wanted)
        there, back = apart.argmin(dim=2), apart.argmin(dim=1)
    nearest = torch.gather(wanted, 1, there[..., None].expand(-1, -1, 3))
    reached = torch.gather(found, 1, back[..., None].expand(-1, -1, 3))
    lengths = [torch.sqrt((d**2).sum(dim=-1) + 1e-12) for d in (found - nearest, wanted - reached)]
    return 0.5 * (lengths[0].mean(dim=1) + lengths[1].mean(dim=1))


def _errors(module: nn.Module, samples: CompletionSamples, batch: int, device: str) -> dict[str, float]:
    """Chamfer-L1 distance of the dense cloud to the points all over each shape, for a card."""
    found = []
    with torch.no_grad():
        for first in range(0, len(samples.whole), batch):
            part = samples.of(np.arange(len(samples.whole))[first : first + batch])
            given = [torch.from_numpy(np.asarray(value)).to(device) for value in part.inputs.values()]
            dense = module(*(value.to(torch.float32) for value in given))[1]
            found.append(chamfer(dense, torch.from_numpy(part.whole).to(device)).cpu().numpy())
    errors: FloatArray = np.asarray(np.concatenate(found) * samples.reach)
    return {
        "sets": len(errors),
        "mean_chamfer_points_m": round(float(errors.mean()), 6),
        "median_chamfer_points_m": round(float(np.median(errors)), 6),
    }
