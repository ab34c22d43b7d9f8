"""The paper's table of shapes: a mocked run in process, answered by every method from its readings."""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from experiments.paper.shape_baselines import by_average, by_hull, by_visual_hull, glance_points
from experiments.paper.shape_network import SENSES, PaperCompletion, paper_completions
from experiments.paper.shape_retrieval import LibraryShape, by_retrieval, household_library, library_of
from experiments.shape_reconstruction.answer import evidence_of
from experiments.shape_reconstruction.cells import PRESSES
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.experiment import ShapeMeasurement
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import METHODS, estimated
from experiments.shape_reconstruction.metric import (
    PUBLISHED_POINTS,
    ShapeError,
    band_held,
    published_chamfer,
    published_points_chamfer,
    surfaces_apart,
)
from experiments.shape_reconstruction.result import true_surface
from experiments.shape_reconstruction.section import MOST_PRESSES, ShapeRun
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import DataRefused, FitRefused, OutOfDomain
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.in_process import RunCell, open_run
from harness.experiment.measuring import MeasuredColumn
from harness.experiment.truth import read_truth
from harness.sim.solid.surface_samples import random_points

PAPER_CM = {
    "V": (0.32, 0.72, 0.74, 0.66, 0.40, 0.99),
    "T32": (0.56, 0.80, 0.61, 0.43, 0.41, 1.11),
    "TV32": (0.25, 0.46, 0.43, 0.32, 0.24, 1.20),
}
"""Chamfer-L1 of six other, real objects from points to points: ObjectFolder 2.0, table 4."""

COLUMNS = (
    MeasuredColumn("chamfer_points_m", "published", "mm", by_object=True),
    MeasuredColumn("hausdorff95_m", "95 %", "mm"),
    MeasuredColumn("f_score", "F 5 mm", "%"),
    MeasuredColumn("deviation_m", "stated", "mm"),
    MeasuredColumn("within90_truth", "band: truth", "%"),
    MeasuredColumn("within90_answer", "band: answer", "%"),
    MeasuredColumn("gross_unsaid", "gross, bounded", "%"),
)
"""Means beside the error: the published form, which is not zero for the truth itself; what 95 % of both
surfaces are within; the F-score; the stated deviation, and the fractions of both surfaces that its 90 % band
holds; the fraction of gross errors whose answer names no extent as not bounded."""

FEW = (2, 4, 6)
"""Numbers of presses that the best method is answered from too, together with a picture."""

FLOOR, AVERAGE = "the truth itself", "average"
"""Rows that read nothing: the true surface as an answer, whose published form is the floor of all others; and
one shape for every object."""

_NONE = (0,)

TABLED: Mapping[str, Mapping[str, tuple[int, ...]]] = {
    "hull": {"T": PRESSES},
    "visual-hull": {"V": _NONE, "TV": PRESSES},
    "glance": {"V": _NONE},
    "retrieval": {"T": (8, 32), "TV": (8, 32)},
    "rbf": {"T": PRESSES, "TV": PRESSES},
    "family": {"T": PRESSES, "V": _NONE, "TV": (*FEW, *PRESSES)},
}
"""Numbers of presses that each method is answered from, by touch alone, the picture alone, or both."""

PUBLISHED = "pcn as published"
"""Method of the rows of the paper's own networks, whose folder ``[shape] pcn`` names."""

_PUBLISHED: Mapping[str, tuple[int, ...]] = {"T": PRESSES, "V": _NONE, "TV": (*FEW, *PRESSES)}

SAMPLES = 6000
"""Samples on each surface: mean distances are then known to 0.04 mm."""


@dataclass(frozen=True)
class ShapeRow:
    """A row: a method, and the part of the readings that it uses."""

    method: str  #: key of ``TABLED``, or ``PUBLISHED``.
    senses: str  #: ``"T"``, ``"V"`` or ``"TV"``.
    presses: int  #: number of presses, the first of the run.

    @property
    def name(self) -> str:
        """``"family, TV8"``."""
        return f"{self.method}, {self.senses}{self.presses or ''}"

    def part(self, evidence: ShapeEvidence) -> ShapeEvidence:
        """Select the readings that the row may use."""
        look = evidence.look if "V" in self.senses else None
        return replace(evidence, touches=evidence.touches[: self.presses], look=look)


def rows_after(presses: int, published: Container[str] = ()) -> list[ShapeRow]:
    """List the rows of a run: after each tabled number of presses, and after all of them.

    Args:
        presses: number of presses of the run.
        published: senses that the paper's own networks are available for.
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
"""All rows that a run of any number of presses may have, in the order of a table."""


def scored_rows(
    evidence: ShapeEvidence,
    truth: Mesh,
    presses: int,
    networks: Iterable[PaperCompletion] = (),
    library: Sequence[LibraryShape] = (),
) -> dict[str, dict[str, Any]]:
    """Compute every row of a run, as JSON values by its name.

    Args:
        evidence: readings of the whole run.
        truth: true surface in ``stand``, m.
        presses: number of presses that the run was to make; it may have ended sooner.
        networks: the paper's own networks, for rows beside ours.
        library: shapes that retrieval chooses among; household shapes if empty.
    """
    published = {SENSES[network.sense]: network.complete for network in networks}
    surfaces = {
        **METHODS,
        "hull": by_hull,
        "visual-hull": by_visual_hull,
        "retrieval": lambda part: by_retrieval(part, library or household_library()),
    }
    floor = surfaces_apart(truth, truth, SAMPLES).error
    rows = {
        FLOOR: {**_errors(floor), "chamfer_points_m": published_chamfer(truth, truth), "seconds": 0.0},
        AVERAGE: _surface_row(by_average(evidence), truth),
    }
    for row in rows_after(presses, published):
        answer: Callable[[ShapeEvidence], FloatArray | ShapeEstimate] = partial(
            estimated, row.method, methods=surfaces
        )
        if row.method == PUBLISHED:
            answer = published[row.senses]
        elif row.method == "glance":
            answer = glance_points
        part, began = row.part(evidence), now()
        try:
            found = answer(part)
        except (FitRefused, OutOfDomain) as refusal:
            # A refusal counts as an error of the object's size.
            refused = {"gross": True, "refused": str(refusal)}
            rows[row.name] = {"error_m": truth.diagonal, "seconds": now() - began, **refused}
            continue
        seconds = now() - began
        if isinstance(found, ShapeEstimate):
            scored = _surface_row(found, truth)
        else:
            sampled = random_points(truth, PUBLISHED_POINTS, np.random.default_rng(0))[0]
            published_m = published_points_chamfer(found, sampled)
            scored = {**_errors(points_error(found, truth, SAMPLES)), "chamfer_points_m": published_m}
        rows[row.name] = {**scored, "seconds": seconds}
    return rows


def points_error(points: FloatArray, truth: Mesh, samples: int) -> ShapeError:
    """Measure ``(n, 3)`` points against the truth: points to its surface, its samples to the points, m."""
    sampled = random_points(truth, samples, np.random.default_rng(0))[0]
    return ShapeError.of(
        NearestSurface(truth).distances(points), np.asarray(cKDTree(points).query(sampled)[0])
    )


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
        "gross": bool(error.chamfer > ShapeMeasurement.gross),
    }


class ShapeTable(ShapeMeasurement):
    """The paper's table of shapes."""

    methods = ROW_NAMES
    published = PAPER_CM
    columns = COLUMNS

    def run_cell(
        self, cell: RunCell, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> dict[str, Any]:
        """Perform a run, or open it in ``recordings``, and answer it by every method.

        Raises:
            DataRefused: the true surface is unknown, or ``[shape] pcn`` has no network that may be run.
            WrongUse: ``[shape] library`` is no folder, or contains no usable shape.
        """
        section = scene.section(ShapeRun)
        networks = [] if section.pcn is None else paper_completions(Path(section.pcn))
        shapes, left_out = ([], []) if section.library is None else library_of(Path(section.library))
        own = cell.create_scene(scene)
        with open_run(self.experiment, cell, own, station, recordings) as run:
            truth = true_surface(run, read_truth(run.recording))
            if truth is None:
                raise DataRefused(
                    f"no true surface is next to {run.recording.folder.name}: the run has no readings, or "
                    "its .truth.npz was removed; remove the run too, and it is performed again"
                )
            evidence = evidence_of(run, run.recording.steps())
            presses = run.scene.section(ShapeRun).presses
            return {
                "schema": 1,
                "cell": vars(cell),
                "steps": run.recording.committed,
                "met": [touch.met for touch in evidence.touches],
                "left_out": left_out,
                "rows": scored_rows(evidence, truth, presses, networks, shapes),
            }
