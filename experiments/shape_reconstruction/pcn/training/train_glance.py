"""The network of a glance: samples, fit, card."""

from typing import Any

import numpy as np
import torch

from experiments.shape_reconstruction.pcn.point_frame import GIVEN
from experiments.shape_reconstruction.pcn.training.glance import GlanceNetwork
from experiments.shape_reconstruction.pcn.training.profiles import CompletionProfile
from experiments.shape_reconstruction.pcn.training.samples import SIZES
from experiments.shape_reconstruction.pcn.training.sense_fit import completion_errors, fitted_completion
from experiments.shape_reconstruction.pcn.training.sense_samples import sense_samples
from experiments.shape_reconstruction.pcn.training.train_network import HELD_OUT, reached
from experiments.shape_reconstruction.pcn.window import SIDE
from harness.sim.solid.household.families import FAMILIES


def train_glance(
    amounts: CompletionProfile, seed: int, processes: int, device: str
) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card."""
    torch.set_num_threads(1)  # the same bits whatever the machine has
    samples = sense_samples("picture", amounts.shapes, amounts.sets, seed, processes)
    last = amounts.shapes - round(HELD_OUT * amounts.shapes)
    learnt, held = samples.of(samples.shapes < last), samples.of(samples.shapes >= last)
    module = fitted_completion("glance", GlanceNetwork, learnt, amounts, seed, device)
    fitted = learnt.of(np.arange(0, len(learnt.shapes), 8))
    card = {
        "what": f"{GIVEN} points all over an object, from its silhouette in {SIDE} x {SIDE} pixels",
        "parameters": sum(value.numel() for value in module.parameters()),
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "looks": len(learnt.shapes),
            "sizes_m": list(SIZES),
            "steps": amounts.steps,
            "batch": amounts.batch,
            "seed": seed,
        },
        "fitted": reached(completion_errors(module, fitted, amounts.batch, device)),
        "held_out": reached(completion_errors(module, held, amounts.batch, device)),
        "device": device,
    }
    return module.cpu().graph(), card
