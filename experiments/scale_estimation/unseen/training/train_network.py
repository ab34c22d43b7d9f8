"""One network of a sense: samples, members, temperature, card."""

from typing import Any

import numpy as np
import torch

from experiments.scale_estimation.unseen.train import Profile
from experiments.scale_estimation.unseen.training.fit import (
    densities,
    family_of,
    fitted,
    held,
    medians,
    outputs_of,
    temperature_of,
    turned,
)
from experiments.scale_estimation.unseen.training.networks import graph
from experiments.scale_estimation.unseen.training.samples import SIZES, SizeSamples, samples_of
from harness.basics.arrays import FloatArray
from harness.sim.solid.household.families import FAMILIES

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
