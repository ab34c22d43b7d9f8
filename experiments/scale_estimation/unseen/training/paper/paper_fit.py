"""Fit a paper's network to samples: the least absolute error of the logarithm of the size."""

import sys
import time
from collections.abc import Callable

import numpy as np
import torch
from torch import Tensor, nn

from experiments.scale_estimation.unseen.paper.inputs import INPUTS
from experiments.scale_estimation.unseen.training.paper.recurrent import ImprintGru
from experiments.scale_estimation.unseen.training.samples import SIZES, SizeSamples
from harness.authoring.resnet import ResNet18
from harness.basics.arrays import FloatArray
from harness.objectfile.graph import Nodes, float_value

RATE = 1.0e-3
DECAY = 1.0e-2
BATCH = 64

USUAL = float(np.log(SIZES).mean())
"""Logarithm of the size that a network begins at: the middle of the range."""

MODULES: dict[str, Callable[[], ResNet18 | ImprintGru]] = {
    "picture": lambda: _residual(3),
    "spectrogram": lambda: _residual(1),
    "imprints": lambda: ImprintGru(USUAL),
}

_AT_ONCE = 256


def _residual(channels: int) -> ResNet18:
    """One number out, the logarithm of a size in m, which begins at the usual one."""
    module = ResNet18(channels, 1)
    nn.init.constant_(module.last.bias, USUAL)
    return module


def fitted_paper(sense: str, samples: SizeSamples, epochs: int, seed: int) -> ResNet18 | ImprintGru:
    """One network, its rate falling as half a cosine.

    The absolute error is least at the median, which is the same size on any scale: fitted to logarithms,
    whose errors are alike from 5 to 60 cm, it is best in cm too.
    """
    torch.manual_seed(seed)
    draw = torch.Generator().manual_seed(seed)
    module = MODULES[sense]()
    inputs = [torch.from_numpy(value) for value in samples.inputs.values()]
    targets = torch.from_numpy(np.float32(np.log(samples.sizes)))[:, None]
    adam = torch.optim.AdamW(module.parameters(), lr=RATE, weight_decay=DECAY)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, epochs * -(-len(targets) // BATCH))
    module.train()
    for epoch in range(epochs):
        began, total = time.perf_counter(), 0.0
        for rows in torch.randperm(len(targets), generator=draw).split(BATCH):
            given = _varied(sense, [value[rows] for value in inputs], draw)
            loss = nn.functional.l1_loss(module(*given), targets[rows])
            adam.zero_grad()
            loss.backward()
            adam.step()
            falling.step()
            total += float(loss.detach()) * len(rows)
        sys.stderr.write(
            f"{sense}: epoch {epoch + 1} of {epochs}, error {100.0 * total / len(targets):.1f} % of the "
            f"size, {time.perf_counter() - began:.0f} s\n"
        )
    module.eval()
    return module


def _varied(sense: str, given: list[Tensor], draw: torch.Generator) -> list[Tensor]:
    """Half of the pictures mirrored: a mirrored object is as large."""
    if sense != "picture":
        return given
    (crop,) = given
    mirrored = torch.rand((len(crop), 1, 1, 1), generator=draw) < 0.5
    return [torch.where(mirrored, crop.flip(3), crop)]


def answered_sizes(module: nn.Module, samples: SizeSamples) -> FloatArray:
    """``(n,)`` m."""
    parts = [torch.from_numpy(value).split(_AT_ONCE) for value in samples.inputs.values()]
    with torch.no_grad():
        found = [module(*given).numpy() for given in zip(*parts, strict=True)]
    return np.exp(np.concatenate(found).astype(np.float64))[:, 0]


def paper_graph(sense: str, module: ResNet18 | ImprintGru) -> bytes:
    """The network as a graph: ``log_size`` ``(n, 1)``; weights in half precision, computed in single."""
    nodes = Nodes("float16")
    found = module.eval().write(nodes, *(name for name, _ in INPUTS[sense]))
    nodes.add("Identity", found, name="log_size")
    inputs = [float_value(name, ("n", *shape)) for name, shape in INPUTS[sense]]
    what = "A reading of an object never drawn to the logarithm of its longest side in m."
    model = nodes.model(sense, inputs, [float_value("log_size", ("n", 1))], what)
    return bytes(model.SerializeToString())
