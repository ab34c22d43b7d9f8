"""Senses about an object never drawn, put together: they err alike where its shape is unusual.

Their densities are multiplied, each raised to a power (a logarithmic opinion pool; Genest and Zidek,
Statistical Science 1, 1986). Powers of one would be right for errors of their own; here a shape that looks
smaller than it is may feel so too, and a sense may be surer than it is right beside another. The powers are
those with which shapes that nothing was learnt from are likeliest.
"""

import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import numpy as np

from experiments.scale_estimation.size import FLOOR, Belief

POWERS = "data/powers.json"


def pooled(beliefs: Mapping[str, Belief], powers: Mapping[str, float] | None = None) -> Belief:
    """What several senses say of one object never drawn.

    Args:
        beliefs: by sense, one or more, about one range.
        powers: by sense; those that came with the program, for these senses together, where None.
    """
    if len(beliefs) == 1:
        return next(iter(beliefs.values()))
    given = shipped_powers()[key_of(beliefs)] if powers is None else powers
    weighed = [given[sense] * one.doubted(FLOOR).log_density for sense, one in beliefs.items()]
    return Belief.of(next(iter(beliefs.values())).range, np.sum(weighed, axis=0))


def key_of(senses: Mapping[str, object]) -> str:
    """Of so many senses, in the file of powers."""
    return "+".join(sorted(senses))


@cache
def shipped_powers() -> Mapping[str, Mapping[str, float]]:
    """Those that came with the program, by the senses that answered."""
    found: dict[str, dict[str, float]] = json.loads((files(__package__) / POWERS).read_text())["powers"]
    return found
