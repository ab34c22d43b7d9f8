"""One network of a sense: samples, members, temperature, card."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor

from experiments.scale_estimation.unseen.network import BINS, MIDDLES
from experiments.scale_estimation.unseen.train import Profile
from experiments.scale_estimation.unseen.training.networks import MODULES, SizeModule, graph
from experiments.scale_estimation.unseen.training.samples import SIZES, SizeSamples, samples_of
from harness.basics.arrays import FloatArray
from harness.sim.solid.household.families import FAMILIES

RATE = 2.0e-3
DECAY = 1.0e-2
BATCH = 256
BLUR = 0.06
"""Standard deviation of the logarithm of the size over which a sample's target is spread."""


Augment = Callable[[dict[str, Tensor], torch.Generator], dict[str, Tensor]]


HELD_OUT = (0.1, 0.1)
"""Shares of the shapes that the width is found on, and that all is tested on."""

_TAKES = {
    "sound": "spectrograms of one to three strikes over the wave number, and the stated material",
    "imprints": "the extents of up to 16 imprints in the gel, of places that nobody knows",
    "touch": "up to 16 straight ways of the gel: ends, directions, normals of what was met",
}


def train_network(sense: str, amounts: Profile, seed: int, processes: int) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card."""
    each = amounts.strikes if sense == "sound" else amounts.contacts
    samples = samples_of(sense, amounts.shapes, each, seed, processes)
    first, second = (round(share * amounts.shapes) for share in HELD_OUT)
    last = amounts.shapes - first - second
    learnt = samples.of(samples.shapes < last)
    width = samples.of((samples.shapes >= last) & (samples.shapes < last + first))
    tested = samples.of(samples.shapes >= last + first)
    epochs = amounts.epochs[0 if sense == "sound" else 1]
    torch.set_num_threads(1)  # the same bits whatever the machine has
    augment = turned if sense == "touch" else None
    modules = [fitted(sense, learnt, epochs, seed + k, augment) for k in range(amounts.members)]
    logits, codes = outputs_of(modules, width)
    temperature = temperature_of(logits, width.sizes)
    card = {
        "what": f"the longest side of an object never drawn, by {sense}",
        "takes": _TAKES[sense],
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "samples": len(learnt.sizes),
            "sizes_m": list(SIZES),
            "epochs": epochs,
            "seed": seed,
        },
        "fitted": _reached(outputs_of(modules, learnt)[0], learnt, temperature),
        "held_out": _reached(outputs_of(modules, tested)[0], tested, temperature),
        "temperature": temperature,
        "family": family_of(outputs_of(modules, learnt)[1], codes),
    }
    return graph(sense, modules), card


def _reached(logits: FloatArray, samples: SizeSamples, temperature: float) -> dict[str, float]:
    shares = densities(logits, temperature)
    return {**size_errors(medians(shares), samples), "held_90": round(held(shares, samples.sizes), 3)}


def size_errors(found: FloatArray, samples: SizeSamples) -> dict[str, float]:
    """Errors of sizes, and of the middle of the range as an answer, in cm.

    Args:
        found: ``(n,)`` estimated sizes, m.
        samples: readings of the true sizes.
    """
    error = 1e2 * np.abs(found - samples.sizes)
    constant = 1e2 * np.abs(np.sqrt(SIZES[0] * SIZES[1]) - samples.sizes)
    return {
        "samples": len(samples.sizes),
        "mean_error_cm": round(float(error.mean()), 2),
        "median_error_cm": round(float(np.median(error)), 2),
        "constant_mean_error_cm": round(float(constant.mean()), 2),
        "constant_median_error_cm": round(float(np.median(constant)), 2),
    }


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
    """Return the fraction of the samples whose size is within the 90 % highest-density region."""
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
