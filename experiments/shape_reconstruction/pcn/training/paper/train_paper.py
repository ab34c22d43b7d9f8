"""One network of the paper's completion: samples, fit, card."""

from functools import partial
from typing import Any

import numpy as np
import torch

from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS
from experiments.shape_reconstruction.pcn.paper.network import DENSE
from experiments.shape_reconstruction.pcn.point_frame import TAKEN
from experiments.shape_reconstruction.pcn.training.paper.networks import COARSE, PaperCompletionNetwork
from experiments.shape_reconstruction.pcn.training.profiles import CompletionProfile
from experiments.shape_reconstruction.pcn.training.samples import PRESSES, SIZES
from experiments.shape_reconstruction.pcn.training.sense_fit import completion_errors, fitted_completion
from experiments.shape_reconstruction.pcn.training.sense_samples import sense_samples
from experiments.shape_reconstruction.pcn.training.train_network import HELD_OUT, reached
from experiments.shape_reconstruction.pcn.window import SIDE
from harness.sim.solid.household.families import FAMILIES

_TAKES = {
    "touched": f"{TAKEN} places that were touched",
    "window": f"the silhouette in {SIDE} x {SIDE} pixels",
}


def train_paper_completion(
    sense: str, amounts: CompletionProfile, seed: int, processes: int, device: str
) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card."""
    samples = sense_samples(sense, amounts.shapes, amounts.sets, seed, processes)
    last = amounts.shapes - round(HELD_OUT * amounts.shapes)
    learnt, held = samples.of(samples.shapes < last), samples.of(samples.shapes >= last)
    module = fitted_completion(sense, partial(PaperCompletionNetwork, sense), learnt, amounts, seed, device)
    fitted = learnt.of(np.arange(0, len(learnt.shapes), 8))
    takes = " and ".join(_TAKES[name] for name, _ in INPUTS[sense])
    card = {
        "what": f"{DENSE} points all over an object, from {takes}",
        "network": "PCN (Yuan et al. 2018) as in ObjectFolder 2.0, the picture by ResNet-18",
        "parameters": sum(value.numel() for value in module.parameters()),
        "coarse_points": COARSE[sense],
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "sets": len(learnt.shapes),
            "presses": list(PRESSES),
            "sizes_m": list(SIZES),
            "steps": amounts.steps,
            "batch": amounts.batch,
            "seed": seed,
        },
        "fitted": reached(completion_errors(module, fitted, amounts.batch, device)),
        "held_out": reached(completion_errors(module, held, amounts.batch, device)),
        "device": torch.cuda.get_device_name() if device == "cuda" else "cpu",
    }
    return module.cpu().graph(), card
