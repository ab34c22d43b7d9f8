"""The rows of the table of shapes: what each is answered from, by which method, and how it is scored."""

from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from experiments.shape_reconstruction.estimators.average import by_average
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.methods import POINTS, estimated, pointed
from experiments.shape_reconstruction.metric import (
    ShapeError,
    band_held,
    points_error,
    published_chamfer,
    published_floor,
    published_from_points,
    surfaces_apart,
)
from experiments.shape_reconstruction.pcn.paper.network import SENSES, PaperCompletion
from experiments.shape_reconstruction.section import MOST_PRESSES
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.clock import now
from harness.basics.errors import FitRefused
from harness.basics.mesh import Mesh

PRESSES = (8, 16, 32)
"""Of each run, the first so many are answered from; the last is how many are made."""

FEW = (2, 4, 6)
"""As PRESSES, of a picture and touch by the best method: how soon a shape is known."""

FLOOR, AVERAGE = "the truth itself", "average"
"""Rows that read nothing: the true surface as an answer, whose published form is the floor of all others; and
one shape for every object."""

_NONE = (0,)

TABLED: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "raw points": {"T": PRESSES},
    "box": {"T": PRESSES},
    "ellipsoid": {"T": PRESSES},
    "hull": {"T": PRESSES},
    "visual-hull": {"V": _NONE, "TV": PRESSES},
    "glance": {"V": _NONE},
    "pcn": {"T": PRESSES},
    "retrieval": {"T": (8, 32), "TV": (8, 32)},
    "rbf": {"T": PRESSES, "TV": PRESSES},
    "family": {"T": PRESSES, "V": _NONE, "TV": (*FEW, *PRESSES)},
}
"""By method, from touch alone, the picture alone, or both: after how many presses."""

PUBLISHED = "pcn as published"
"""Method of the rows by the paper's own networks, which a table is given the folder of."""

_PUBLISHED: Mapping[str, tuple[int, ...]] = {"T": PRESSES, "V": _NONE, "TV": (*FEW, *PRESSES)}

SAMPLES = 6000
"""On each surface: means are then known to 0.04 mm, in a quarter of the time."""

GROSS = 10.0e-3
"""M: an error beyond is a failure."""


@dataclass(frozen=True)
class ShapeRow:
    """What a row is answered from."""

    method: str  #: of ``METHODS`` or ``POINTS``.
    senses: str  #: ``"T"``, ``"V"`` or ``"TV"``.
    presses: int  #: of the run, the first so many.

    @property
    def name(self) -> str:
        """``"family, TV8"``."""
        return f"{self.method}, {self.senses}{self.presses or ''}"

    def part(self, evidence: ShapeEvidence) -> ShapeEvidence:
        """Of a run's evidence, what the row may use."""
        look = evidence.look if "V" in self.senses else None
        return replace(evidence, touches=evidence.touches[: self.presses], look=look)


def rows_after(presses: int, published: Container[str] = ()) -> list[ShapeRow]:
    """Of a run of so many presses: after the counts that are tabled, and after all of them.

    Args:
        presses: of the run.
        published: senses of which the paper's own network is there.
    """
    own = {senses: counts for senses, counts in _PUBLISHED.items() if senses in published}
    found = []
    for method, by_senses in {**TABLED, PUBLISHED: own}.items():
        for senses, counts in by_senses.items():
            made = [count for count in counts if count < presses] + [presses]
            used = made if "T" in senses else _NONE
            found += [ShapeRow(method, senses, count) for count in used if count or senses == "V"]
    return found


ROW_NAMES = (
    FLOOR,
    AVERAGE,
    *(
        ShapeRow(method, senses, count).name
        for method, by_senses in {**TABLED, PUBLISHED: _PUBLISHED}.items()
        for senses in by_senses
        for count in (range(1, MOST_PRESSES + 1) if "T" in senses else _NONE)
    ),
)
"""Of all rows that a run of any number of presses may have, in the order of a table."""


def scored_rows(
    evidence: ShapeEvidence, truth: Mesh, presses: int, networks: Iterable[PaperCompletion] = ()
) -> dict[str, dict[str, Any]]:
    """Every row of a run, as JSON values by its name.

    Args:
        evidence: of the whole run.
        truth: m in ``stand``.
        presses: that the run was to make; it may have ended sooner.
        networks: the paper's own, for rows beside ours.
    """
    published = {SENSES[network.sense]: network for network in networks}
    rows = {FLOOR: _floor(truth), AVERAGE: _surface_row(by_average(evidence), truth)}
    for row in rows_after(presses, published):
        answer = published[row.senses].answered if row.method == PUBLISHED else partial(_by, row.method)
        rows[row.name] = _answered(answer, row.part(evidence), truth)
    return rows


def _floor(truth: Mesh) -> dict[str, Any]:
    error = surfaces_apart(truth, truth, SAMPLES).error
    return {**_errors(error), "chamfer_points_m": published_floor(truth), "seconds": 0.0}


_Found = PointEstimate | ShapeEstimate


def _by(method: str, part: ShapeEvidence) -> _Found:
    return pointed(method, part) if method in POINTS else estimated(method, part)


def _answered(answer: Callable[[ShapeEvidence], _Found], part: ShapeEvidence, truth: Mesh) -> dict[str, Any]:
    """An answer's errors; what is refused counts as far off as the object is large, and says why."""
    began = now()
    try:
        found = answer(part)
    except FitRefused as refusal:
        size = truth.diagonal
        return {"error_m": size, "seconds": now() - began, "gross": True, "refused": str(refusal)}
    seconds = now() - began
    scored = _points_row(found, truth) if isinstance(found, PointEstimate) else _surface_row(found, truth)
    return {**scored, "seconds": seconds}


def _points_row(found: PointEstimate, truth: Mesh) -> dict[str, Any]:
    return {
        **_errors(points_error(found.points, truth, SAMPLES)),
        "chamfer_points_m": published_from_points(found.points, truth),
    }


def _surface_row(found: ShapeEstimate, truth: Mesh) -> dict[str, Any]:
    apart = surfaces_apart(found.mesh, truth, SAMPLES)
    held, errors = band_held(found, apart), _errors(apart.error)
    return {
        **errors,
        "chamfer_points_m": published_chamfer(found.mesh, truth),
        "deviation_m": float(found.deviation.mean()),
        "within90_truth": held.truth,
        "within90_answer": held.answer,
        "not_bounded": list(found.not_bounded),
        "gross_unsaid": bool(errors["gross"] and not found.not_bounded),
        "seconds": found.seconds,
    }


def _errors(error: ShapeError) -> dict[str, Any]:
    return {
        "error_m": error.chamfer,
        "accuracy_m": error.accuracy,
        "completeness_m": error.completeness,
        "f_score": error.f_score,
        "hausdorff95_m": error.hausdorff95,
        "gross": bool(error.chamfer > GROSS),
    }
