"""Fit networks to samples, and find how wide their answers must be on shapes that were held out."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

from experiments.scale_estimation.unseen.network import BINS, MIDDLES
from experiments.scale_estimation.unseen.training.networks import MODULES, SizeModule
from experiments.scale_estimation.unseen.training.samples import SizeSamples
from harness.basics.arrays import FloatArray

RATE = 2.0e-3
DECAY = 1.0e-2
BATCH = 256
BLUR = 0.06
"""Of the logarithm: how far about its true size a sample counts."""


Augment = Callable[[dict[str, Tensor], torch.Generator], dict[str, Tensor]]


def fitted(
    sense: str, samples: SizeSamples, epochs: int, seed: int, augment: Augment | None = None
) -> SizeModule:
    """One network, its rate falling as half a cosine."""
    torch.manual_seed(seed)
    draw = torch.Generator().manual_seed(seed)
    module: SizeModule = MODULES[sense]()
    names = list(samples.inputs)
    inputs = {name: torch.from_numpy(np.float32(samples.inputs[name])) for name in names}
    shares = np.exp(-0.5 * ((MIDDLES - np.log(samples.sizes)[:, None]) / BLUR) ** 2)
    targets = torch.from_numpy(np.float32(shares / shares.sum(axis=1, keepdims=True)))
    adam = torch.optim.AdamW(module.parameters(), lr=RATE, weight_decay=DECAY)
    steps = epochs * -(-len(targets) // BATCH)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
    module.train()
    for _ in range(epochs):
        for rows in torch.randperm(len(targets), generator=draw).split(BATCH):
            given = {name: inputs[name][rows] for name in names}
            given = given if augment is None else augment(given, draw)
            loss = torch.nn.functional.cross_entropy(module(*given.values()), targets[rows])
            adam.zero_grad()
            loss.backward()
            adam.step()
            falling.step()
    module.eval()
    return module


def turned(given: dict[str, Tensor], draw: torch.Generator) -> dict[str, Tensor]:
    """Contacts turned about the vertical, each set by another angle."""
    ways = given["ways"].clone()
    angle = 2.0 * np.pi * torch.rand((len(ways), 1), generator=draw)
    c, s = torch.cos(angle), torch.sin(angle)
    for first in (0, 3, 6, 9):
        x, y = given["ways"][..., first], given["ways"][..., first + 1]
        ways[..., first], ways[..., first + 1] = c * x - s * y, s * x + c * y
    return {**given, "ways": ways}


def outputs_of(modules: Sequence[SizeModule], samples: SizeSamples) -> tuple[FloatArray, FloatArray]:
    """``(n, members, BINS)`` logits and ``(n, members, CODE)`` codes."""
    given = [torch.from_numpy(np.float32(value)) for value in samples.inputs.values()]
    logits, codes = [], []
    for module in modules:
        inputs: list[Tensor] = []
        hook = module.last.register_forward_hook(lambda _m, taken, _g, inputs=inputs: inputs.append(taken[0]))
        with torch.no_grad():
            logits.append(module(*given).numpy())
        hook.remove()
        codes.append(inputs[0].numpy())
    return np.stack(logits, axis=1).astype(np.float64), np.stack(codes, axis=1).astype(np.float64)


def densities(logits: FloatArray, temperature: float) -> FloatArray:
    """``(n, BINS)`` shares, mean over the members."""
    warm = logits / temperature
    warm = warm - warm.max(axis=-1, keepdims=True)
    shares = np.exp(warm)
    return np.asarray((shares / shares.sum(axis=-1, keepdims=True)).mean(axis=1))


def medians(shares: FloatArray) -> FloatArray:
    """``(n,)`` m, within the bins as if each share were spread evenly over its own."""
    step = MIDDLES[1] - MIDDLES[0]
    edges = np.append(MIDDLES - 0.5 * step, MIDDLES[-1] + 0.5 * step)
    below = np.concatenate([np.zeros((len(shares), 1)), np.cumsum(shares, axis=1)], axis=1)
    return np.exp([np.interp(0.5 * row[-1], row, edges) for row in below])


def held(shares: FloatArray, sizes: FloatArray) -> float:
    """Share of the samples whose size is among the likeliest nine tenths of the density."""
    step = MIDDLES[1] - MIDDLES[0]
    bins = np.clip(np.round((np.log(sizes) - MIDDLES[0]) / step).astype(int), 0, BINS - 1)
    own = shares[np.arange(len(shares)), bins]
    above = np.where(shares > own[:, None], shares, 0.0).sum(axis=1) + 0.5 * own
    return float((above <= 0.9).mean())


def temperature_of(logits: FloatArray, sizes: FloatArray) -> float:
    """The least at which nine tenths of the samples are held."""
    for temperature in np.geomspace(0.7, 4.0, 40):
        if held(densities(logits, float(temperature)), sizes) >= 0.9:
            return float(temperature)
    return 4.0


def family_of(codes: FloatArray, others: FloatArray) -> dict[str, object]:
    """Middle and whitening of ``(n, members, CODE)`` codes, and the usual distance of ``others``."""
    middle = codes.mean(axis=0)
    whitening = []
    for member in range(codes.shape[1]):
        covariance = np.cov(codes[:, member].T) + 1e-3 * np.eye(codes.shape[2])
        values, vectors = np.linalg.eigh(covariance)
        whitening.append((vectors / np.sqrt(values)).T)
    apart = np.einsum("mij,nmj->nmi", np.array(whitening), others - middle)
    usual = float(np.quantile(np.linalg.norm(apart, axis=2).mean(axis=1), 0.99))
    return {
        "middle": middle.round(6).tolist(),
        "whitening": np.array(whitening).round(6).tolist(),
        "usual": usual,
    }
