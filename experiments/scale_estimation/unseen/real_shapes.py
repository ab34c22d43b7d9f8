"""By how much real things are off, beyond what networks learnt from families of shapes say of themselves."""

import json
from functools import cache
from importlib.resources import files

WRITTEN = "data/real_shapes.json"


@cache
def shape_sigma(sense: str) -> float:
    """Deviation of the size's logarithm that is added to a sense's answer about an object never drawn.

    It is the one with which scanned things are likeliest that no network and no table has seen;
    ``training.real_shapes`` finds it.
    """
    written = json.loads((files(__package__) / WRITTEN).read_text())
    return float(written[sense]["sigma"])
