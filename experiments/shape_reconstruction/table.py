"""One cell of the table of shapes: a mocked run in process, answered by every method from parts of it."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.shape_reconstruction.dials import OWN
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.methods import TABLED, estimated
from experiments.shape_reconstruction.metric import published_chamfer, shape_error
from experiments.shape_reconstruction.readings import evidence_of
from experiments.shape_reconstruction.result import true_surface
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.clock import now
from harness.basics.errors import DataRefused, FitRefused
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.experiment.experiment import Experiment, MeasuredCondition
from harness.experiment.lookup import named
from harness.experiment.plain import PlainPerforms, perform_in_process, plain_measurement
from harness.recording.run_folder import RunFiles

NAME = "shape-reconstruction"

CHOICES = ("planned", "random", "farthest")
"""Where presses lead; ``active`` is left out."""

PRESSES = (8, 16, 32)
"""Of each run, the first so many are answered from; the last is how many are made."""

METHODS_OF_TABLE = tuple(
    f"{method}, {senses}{'' if senses == 'V' else count}"
    for method, given in TABLED.items()
    for senses in given
    for count in (PRESSES if senses != "V" else (0,))
)

PAPER_CM = {
    "V": (0.32, 0.72, 0.74, 0.66, 0.40, 0.99),
    "T32": (0.56, 0.80, 0.61, 0.43, 0.41, 1.11),
    "TV32": (0.25, 0.46, 0.43, 0.32, 0.24, 1.20),
}
"""Chamfer-L1 of six other, real objects from points to points: ObjectFolder 2.0, table 4."""

GROSS = 10.0e-3
"""M: an error beyond is a failure."""


@dataclass(frozen=True)
class ShapeCell:
    """Which run."""

    object: str
    gap: str
    seed: int
    choose: str

    @property
    def name(self) -> str:
        """Of the run's file; a gap may be a path."""
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.choose}-{self.seed}"

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"gap": self.gap, "choose": self.choose}


def cells(
    objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
) -> list[ShapeCell]:
    """All of them, an object's after the other's of one seed."""
    return [
        ShapeCell(name, gap, seed, choose)
        for seed in seeds
        for gap in chosen["gap"]
        for choose in chosen["choose"]
        for name in objects
    ]


def scene_of(scene: SceneFile, cell: ShapeCell) -> SceneFile:
    """The scene of a table's object, camera and gel asked for."""
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["sensors"].update(camera=True, sound=False, touch=True)
    tree.setdefault(ShapeRun.table, {}).update(choose=cell.choose, presses=PRESSES[-1])
    return scene_from_json(tree, cell.name)


def run_cell(
    cell: ShapeCell, scene: SceneFile, station: Station, recordings: Path | None = None
) -> dict[str, Any]:
    """Perform and answer one run; the result as JSON values."""
    experiment: Experiment = named(NAME)
    here = scene_of(scene, cell)
    with closing(perform_in_process(experiment, cell, here, station, recordings)) as case:
        run = RunFiles(case.run.recording)
        truth = true_surface(run)
        if truth is None:
            raise DataRefused("no instrument read anything in this run: no way to the object was free")
        evidence = evidence_of(run, run.recording.steps())
        rows = {name: _row(name, part, truth) for name, part in _parts(evidence)}
        met = [touch.met for touch in evidence.touches]
        return {"schema": 1, "cell": vars(cell), "steps": run.recording.committed, "met": met, "rows": rows}


def _parts(evidence: ShapeEvidence) -> Iterator[tuple[str, ShapeEvidence]]:
    """What each row of the table is answered from."""
    for name in METHODS_OF_TABLE:
        senses = name.rpartition(", ")[2].rstrip("0123456789")
        count = int(name.rpartition(senses)[2] or 0)
        look = evidence.look if "V" in senses else None
        yield name, replace(evidence, touches=evidence.touches[:count], look=look)


def _row(name: str, evidence: ShapeEvidence, truth: Mesh) -> dict[str, Any]:
    """An answer's errors; what is refused counts as far off as the object is large, and says why."""
    began = now()
    try:
        found = estimated(name.partition(",")[0], evidence)
    except FitRefused as refusal:
        size = truth.diagonal
        return {"error_m": size, "seconds": now() - began, "gross": True, "refused": str(refusal)}
    seconds, error = now() - began, shape_error(found.mesh, truth)
    return {
        "error_m": error.chamfer,
        "accuracy_m": error.accuracy,
        "completeness_m": error.completeness,
        "chamfer_points_m": published_chamfer(found.mesh, truth),
        "deviation_m": float(found.deviation.mean()),
        "not_bounded": list(found.not_bounded),
        "gross": bool(error.chamfer > GROSS),
        "seconds": seconds,
    }


MEASUREMENT = replace(
    plain_measurement(NAME, *OWN),
    conditions=(MeasuredCondition("choose", CHOICES, ("planned",), ("planned",)),),
    cells=cells,
    run_cell=run_cell,
    methods=METHODS_OF_TABLE,
    performed=PlainPerforms(NAME, scene_of),
    counts=(9, 17, 33),
    gross=GROSS,
    published=PAPER_CM,
)
