"""By how much real things are off, beyond what networks learnt from families of shapes say of themselves."""

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from experiments.scale_estimation.size import Belief, fused

WRITTEN = "data/real_shapes.json"


SHAPE_SENSES = ("touch", "vision")
"""Those that err alike: a thing whose depth is unlike a family's is misjudged by both."""


def shape_sigma(sense: str) -> float:
    """Deviation of the size's logarithm that is added to a sense's answer about an object never drawn.

    It is the one with which scanned things are likeliest that no network and no table has seen;
    ``training.real_shapes`` finds it.
    """
    return float(_written()[sense]["sigma"])


def fused_alone(beliefs: Mapping[str, Belief], power: float | None = None) -> Belief:
    """What several senses say of an object never drawn: their product, those that err alike being less sure.

    Args:
        beliefs: by sense, one or more, about one range.
        power: to which those of ``SHAPE_SENSES`` are raised where both answer (a logarithmic opinion pool;
            Genest and Zidek, Statistical Science 1, 1986); that of scanned things where None.
    """
    if not set(SHAPE_SENSES) <= set(beliefs):
        return fused(list(beliefs.values()))
    given = float(_written()["together"]["power"]) if power is None else power
    return fused([one.raised(given) if sense in SHAPE_SENSES else one for sense, one in beliefs.items()])


@cache
def _written() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((files(__package__) / WRITTEN).read_text())
    return found
