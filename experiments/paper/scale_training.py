"""Fits one of the paper's networks of scale: samples, least absolute error of the logarithm, card."""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from experiments.paper.scale_networks import FRAMES, HOP, LINES, SIDE, SIZE_INPUTS, STEPS, WINDOW, SizeAmounts
from experiments.paper.scale_samples import PAPER_MAKERS
from experiments.scale_estimation.unseen import contact_set
from experiments.scale_estimation.unseen.training.samples import SIZES, SizeSamples, gathered
from experiments.scale_estimation.unseen.training.train_network import HELD_OUT, size_errors
from harness.authoring.resnet import ResNet18, written_linear
from harness.basics.arrays import FloatArray
from harness.objectfile.graph import Nodes, float_value
from harness.sim.solid.household.families import FAMILIES

_EACH = 64


class ImprintGru(nn.Module):
    """A layer on each imprint, a gated recurrent unit, a number out of its last state.

    Args:
        usual: logarithm of the size that it begins at.
    """

    def __init__(self, usual: float) -> None:
        super().__init__()
        self.each = nn.Linear(contact_set.IMPRINT, _EACH)
        self.recurrent = nn.GRU(_EACH, _EACH, batch_first=True)
        self.last = nn.Linear(_EACH, 1)
        nn.init.constant_(self.last.bias, usual)

    def forward(self, imprints: Tensor, last: Tensor) -> Tensor:
        """``(n, 1)`` of ``(n, steps, IMPRINT)`` and ``(n, steps)`` 1 at the last that there is."""
        states, _ = self.recurrent(torch.relu(self.each(imprints)))
        return torch.as_tensor(self.last((states * last[..., None]).sum(dim=1)))

    def write(self, nodes: Nodes, imprints: str, last: str) -> str:
        """The same in a graph."""
        matrix = nodes.weight(self.each.weight.detach().numpy().T, "an imprint's layer")
        bias = nodes.weight(self.each.bias.detach().numpy(), "an imprint's layer")
        each = nodes.add("Relu", nodes.add("Add", nodes.add("MatMul", imprints, matrix), bias))
        along = nodes.add("Transpose", each, perm=[1, 0, 2])
        weights = [nodes.weight(value, "a recurrent unit") for value in self._gates()]
        states = nodes.add("GRU", along, *weights, hidden_size=_EACH, linear_before_reset=1)
        back = nodes.add("Transpose", nodes.add("Squeeze", states, _axis(nodes, 1)), perm=[1, 0, 2])
        chosen = nodes.add("Mul", back, nodes.add("Unsqueeze", last, _axis(nodes, 2)))
        return written_linear(nodes, nodes.add("ReduceSum", chosen, _axis(nodes, 1), keepdims=0), self.last)

    def _gates(self) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.float32]], ...]:
        """Weights of the input, of the state, and biases; torch has reset before update, ONNX after it."""
        named = dict(self.recurrent.named_parameters())

        def ordered(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
            reset, update, new = np.split(named[name].detach().numpy(), 3)
            return np.concatenate([update, reset, new])

        biases = np.concatenate([ordered("bias_ih_l0"), ordered("bias_hh_l0")])
        return ordered("weight_ih_l0")[None], ordered("weight_hh_l0")[None], biases[None]


def _axis(nodes: Nodes, axis: int) -> str:
    return nodes.constant(np.array([axis], np.int64))


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
            given = [value[rows] for value in inputs]
            if sense == "picture":  # half of them mirrored: a mirrored object is as large
                (crop,) = given
                mirrored = torch.rand((len(crop), 1, 1, 1), generator=draw) < 0.5
                given = [torch.where(mirrored, crop.flip(3), crop)]
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


def answered_sizes(module: nn.Module, samples: SizeSamples) -> FloatArray:
    """``(n,)`` m."""
    parts = [torch.from_numpy(value).split(_AT_ONCE) for value in samples.inputs.values()]
    with torch.no_grad():
        found = [module(*given).numpy() for given in zip(*parts, strict=True)]
    return np.exp(np.concatenate(found).astype(np.float64))[:, 0]


def paper_graph(sense: str, module: ResNet18 | ImprintGru) -> bytes:
    """The network as a graph: ``log_size`` ``(n, 1)``; weights in half precision, computed in single."""
    nodes = Nodes("float16")
    found = module.eval().write(nodes, *(name for name, _ in SIZE_INPUTS[sense]))
    nodes.add("Identity", found, name="log_size")
    inputs = [float_value(name, ("n", *shape)) for name, shape in SIZE_INPUTS[sense]]
    what = "A reading of an object never drawn to the logarithm of its longest side in m."
    model = nodes.model(sense, inputs, [float_value("log_size", ("n", 1))], what)
    return bytes(model.SerializeToString())


_TAKES = {
    "picture": f"one RGB crop of {SIDE} x {SIDE} pixels about the object, what is behind it black; the "
    "paper does not state its pixels, and ResNet-18 was published for 224 x 224",
    "spectrogram": f"the magnitude spectrogram of one strike, in dB: {LINES} lines of {1.0 / WINDOW:g} Hz, "
    f"{FRAMES} frames {1e3 * HOP:g} ms apart; the material is not stated",
    "imprints": f"extents of up to {STEPS} imprints in the gel in their order, without poses",
}
_LAYERS = {
    "picture": "ResNet-18 (He et al. 2016)",
    "spectrogram": "ResNet-18 (He et al. 2016), one channel in",
    "imprints": "gated recurrent unit (Cho et al. 2014), 64 states",
}


def train_paper_network(
    sense: str, amounts: SizeAmounts, seed: int, processes: int
) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card; held out are the shapes that the shipped networks' cards hold out."""
    make = partial(PAPER_MAKERS[sense], seed, amounts.samples[sense])
    samples = gathered(make, amounts.shapes, processes, sense)
    unused, tested_shapes = (round(share * amounts.shapes) for share in HELD_OUT)
    last = amounts.shapes - unused - tested_shapes
    learnt = samples.of(samples.shapes < last)
    tested = samples.of(samples.shapes >= last + unused)
    torch.set_num_threads(1)  # the same bits whatever the machine has
    began = time.process_time()
    module = fitted_paper(sense, learnt, amounts.epochs[sense], seed)
    card = {
        "what": f"the longest side of an object never drawn, by {sense}: the paper's network",
        "network": _LAYERS[sense],
        "parameters": sum(value.numel() for value in MODULES[sense]().parameters()),
        "takes": _TAKES[sense],
        "gives": "the logarithm of the size in m; no interval, as in the paper",
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "samples": len(learnt.sizes),
            "sizes_m": list(SIZES),
            "epochs": amounts.epochs[sense],
            "seed": seed,
        },
        "fitted": size_errors(answered_sizes(module, learnt), learnt),
        "held_out": size_errors(answered_sizes(module, tested), tested),
        "fit_cpu_seconds": round(time.process_time() - began, 1),
    }
    return paper_graph(sense, module), card
