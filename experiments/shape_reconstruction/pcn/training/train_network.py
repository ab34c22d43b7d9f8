"""The network's file and its card: what it learnt from and what it reaches on shapes held out."""

from typing import Any

import numpy as np
import torch

from experiments.shape_reconstruction.pcn.point_frame import GIVEN, TAKEN
from experiments.shape_reconstruction.pcn.training.fit import BATCH, errors, fitted
from experiments.shape_reconstruction.pcn.training.networks import graph
from experiments.shape_reconstruction.pcn.training.profiles import CompletionProfile
from experiments.shape_reconstruction.pcn.training.samples import PRESSES, SIZES, touch_sets
from harness.basics.arrays import FloatArray
from harness.sim.solid.household.families import FAMILIES

HELD_OUT = 0.1


def train_network(amounts: CompletionProfile, seed: int) -> tuple[bytes, dict[str, Any]]:
    """The graph's bytes and its card."""
    torch.set_num_threads(1)  # the same bits whatever the machine has
    sets = touch_sets(amounts.shapes, amounts.sets, seed)
    last = amounts.shapes - round(HELD_OUT * amounts.shapes)
    learnt, held = sets.of(sets.shapes < last), sets.of(sets.shapes >= last)
    module = fitted(learnt, amounts.steps, seed)
    card = {
        "what": f"{GIVEN} points all over an object, from {TAKEN} places that were touched",
        "learnt_from": {
            "families": list(FAMILIES),
            "shapes": last,
            "sets": len(learnt.shapes),
            "presses": list(PRESSES),
            "sizes_m": list(SIZES),
            "steps": amounts.steps,
            "batch": BATCH,
            "seed": seed,
        },
        "fitted": reached(errors(module, learnt.of(np.arange(0, len(learnt.shapes), 8)))),
        "held_out": reached(errors(module, held)),
    }
    return graph(module), card


def reached(found: FloatArray) -> dict[str, float]:
    """Errors of sets in m, as a card says them."""
    return {
        "sets": len(found),
        "mean_chamfer_points_m": round(float(found.mean()), 6),
        "median_chamfer_points_m": round(float(np.median(found)), 6),
    }
