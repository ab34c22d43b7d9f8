"""Retrieval among a folder of meshes, or among the household shapes that come with the program."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.retrieval.library import LibraryShape, library_of
from experiments.shape_reconstruction.retrieval.retrieve import by_retrieval
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.sim.solid.household.families import FAMILIES, draw

EACH = 4
"""Shapes of every family: the more there are, the nearer the best of them, and the dearer the answer."""

_SEED = 30_000


def by_known_shapes(evidence: ShapeEvidence) -> ShapeEstimate:
    """The known shape that fits best, of the folder that the evidence names, else of the household library.

    Raises:
        FitRefused: no touch met the object.
        WrongUse: no such folder, or no shape in it that can be used.
    """
    folder = evidence.library
    shapes, left_out = (household_library(), ()) if folder is None else _in_folder(folder)
    found = by_retrieval(evidence, shapes)
    named = {"library": "household" if folder is None else folder, "left_out": list(left_out)}
    return replace(found, details={**found.details, **named})


@cache
def household_library() -> tuple[LibraryShape, ...]:
    """``EACH`` shapes of every family, none of them a test object: ``"cup 1"``, ``"cup 2"``, ..."""
    random = np.random.default_rng(_SEED)
    return tuple(
        LibraryShape.of(f"{name} {number}", draw(name, random).surface)
        for name in FAMILIES
        for number in range(1, EACH + 1)
    )


@cache
def _in_folder(folder: str) -> tuple[Sequence[LibraryShape], Sequence[str]]:
    """Read once: a run is answered by each sense."""
    return library_of(Path(folder))
