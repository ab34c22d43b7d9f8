"""One of the paper's networks: samples, fit, card."""

import time
from typing import Any

import numpy as np
import torch

from experiments.scale_estimation.unseen.paper.inputs import FRAMES, HOP, LINES, SIDE, STEPS, WINDOW
from experiments.scale_estimation.unseen.training.paper.paper_fit import (
    MODULES,
    answered_sizes,
    fitted_paper,
    paper_graph,
)
from experiments.scale_estimation.unseen.training.paper.paper_profiles import PaperAmounts
from experiments.scale_estimation.unseen.training.paper.paper_samples import paper_maker
from experiments.scale_estimation.unseen.training.samples import SIZES, SizeSamples, gathered
from experiments.scale_estimation.unseen.training.train_network import HELD_OUT
from harness.basics.arrays import FloatArray
from harness.sim.solid.household.families import FAMILIES

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
    sense: str, amounts: PaperAmounts, seed: int, processes: int
) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card; held out are the shapes that the shipped networks' cards hold out."""
    samples = gathered(paper_maker(sense, seed, amounts.samples[sense]), amounts.shapes, processes, sense)
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
        "fitted": _errors(answered_sizes(module, learnt), learnt),
        "held_out": _errors(answered_sizes(module, tested), tested),
        "fit_cpu_seconds": round(time.process_time() - began, 1),
    }
    return paper_graph(sense, module), card


def _errors(found: FloatArray, samples: SizeSamples) -> dict[str, float]:
    """In cm, and those of the middle of the range."""
    error = 1e2 * np.abs(found - samples.sizes)
    constant = 1e2 * np.abs(np.sqrt(SIZES[0] * SIZES[1]) - samples.sizes)
    return {
        "samples": len(samples.sizes),
        "mean_error_cm": round(float(error.mean()), 2),
        "median_error_cm": round(float(np.median(error)), 2),
        "constant_mean_error_cm": round(float(constant.mean()), 2),
        "constant_median_error_cm": round(float(np.median(constant)), 2),
    }
