"""Estimators of shape by their names: levels of the dial ``shape.method``."""

from collections.abc import Callable, Mapping
from functools import partial

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.estimate import family_estimate
from experiments.shape_reconstruction.family.settings import LEVELS
from experiments.shape_reconstruction.hull import hull_estimate
from experiments.shape_reconstruction.surface import ShapeEstimate

Method = Callable[[ShapeEvidence], ShapeEstimate]

METHODS: Mapping[str, Method] = {
    "hull": hull_estimate,
    "family-coarse": partial(family_estimate, settings=LEVELS["coarse"]),
    "family": family_estimate,
    "family-fine": partial(family_estimate, settings=LEVELS["fine"]),
}
"""From cheap to dear."""

QUICK, TELLING, BEST = "hull", "family-coarse", "family"
"""While the arm waits for the next press; where that goes by which shapes are likely; by default."""

TABLED: Mapping[str, tuple[str, ...]] = {"hull": ("T",), "family": ("T", "V", "TV")}
"""Methods in the table of shapes, from touch alone, the picture alone, and both."""
