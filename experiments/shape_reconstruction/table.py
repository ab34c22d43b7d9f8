"""One cell of the table of shapes: a mocked run in process, answered by every method from parts of it."""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from experiments.shape_reconstruction.dials import OWN
from experiments.shape_reconstruction.pcn.paper.network import paper_completions
from experiments.shape_reconstruction.readings import evidence_of
from experiments.shape_reconstruction.result import true_surface
from experiments.shape_reconstruction.section import ShapeRun
from experiments.shape_reconstruction.table_rows import GROSS, PRESSES, ROW_NAMES, scored_rows
from harness.basics.errors import DataRefused
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.experiment.experiment import Experiment, MeasuredColumn, MeasuredCondition
from harness.experiment.lookup import named
from harness.experiment.plain import PlainPerforms, perform_in_process, plain_measurement
from harness.experiment.truth import read_truth
from harness.recording.run_folder import RunFiles

NAME = "shape-reconstruction"

CHOICES = ("planned", "random", "farthest", "active")
"""Where presses lead."""

PAPER_CM = {
    "V": (0.32, 0.72, 0.74, 0.66, 0.40, 0.99),
    "T32": (0.56, 0.80, 0.61, 0.43, 0.41, 1.11),
    "TV32": (0.25, 0.46, 0.43, 0.32, 0.24, 1.20),
}
"""Chamfer-L1 of six other, real objects from points to points: ObjectFolder 2.0, table 4."""

MORE_OBJECTS = {
    "mustard": ("meshes/ycb_sim/006_mustard_bottle/006_mustard_bottle.obj", "m", "plastic"),
    "bleach": ("meshes/ycb_ocrtoc/bleach_cleanser/textured.obj", "m", "plastic"),
    "coffeemug": ("meshes/contactdb_objects/coffeemug.stl", "m", "ceramic"),
    "banana": ("meshes/ycb_isaac/011_banana/textured.obj", "cm", "plastic"),
    "drill": ("meshes/ycb_sim/035_power_drill/035_power_drill.obj", "m", "plastic"),
    "hammer": ("meshes/contactdb_objects/hammer.stl", "m", "steel"),
    "lightbulb": ("meshes/contactdb_objects/lightbulb.stl", "m", "glass"),
    "fryingpan": ("meshes/contactdb_objects/fryingpan.stl", "m", "steel"),
    "scissors": ("meshes/ycb_ocrtoc/scissors/textured.obj", "m", "steel"),
}
"""Real meshes besides those of every experiment; banana, drill, hammer and scissors are of no class of the
family."""

COLUMNS = (
    MeasuredColumn("chamfer_points_m", "published", "mm"),
    MeasuredColumn("hausdorff95_m", "95 %", "mm"),
    MeasuredColumn("f_score", "F 5 mm", "%"),
    MeasuredColumn("deviation_m", "stated", "mm"),
    MeasuredColumn("within90_truth", "band: truth", "%"),
    MeasuredColumn("within90_answer", "band: answer", "%"),
    MeasuredColumn("gross_unsaid", "gross, bounded", "%"),
)
"""Means beside the error: the published form, which is not zero for the truth itself; what 95 % of both
surfaces are within; the F-score; the deviation that an answer states, and how much of each surface its 90 %
band holds; how many are gross and name nothing that is not bounded."""


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
    """The scene of a table's object, camera and gel asked for.

    It has as many presses as its table of this experiment says, ``PRESSES[-1]`` where it has none.
    """
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["sensors"].update(camera=True, sound=False, touch=True)
    # What only answers changes nothing of a run: recordings do not depend on it.
    own = {"choose": cell.choose, "library": None, "pcn": None}
    tree.setdefault(ShapeRun.table, {"presses": PRESSES[-1]}).update(own)
    return scene_from_json(tree, cell.name)


def run_cell(
    cell: ShapeCell, scene: SceneFile, station: Station, recordings: Path | None = None
) -> dict[str, Any]:
    """Perform and answer one run; the result as JSON values.

    Raises:
        DataRefused: nothing says what is true of the run, or ``[shape] pcn`` has no network that may be run.
    """
    experiment: Experiment = named(NAME)
    here, asked = scene_of(scene, cell), scene.section(ShapeRun)
    networks = {} if asked.pcn is None else paper_completions(Path(asked.pcn))
    with closing(perform_in_process(experiment, cell, here, station, recordings)) as case:
        run = RunFiles(case.run.recording)
        truth = true_surface(run, read_truth(run.recording))
        if truth is None:
            raise DataRefused(
                f"no true surface is beside {run.recording.folder.name}: no instrument read anything in this "
                "run, or its .truth.npz was taken away; take the run away too, and it is performed again"
            )
        evidence = replace(evidence_of(run, run.recording.steps()), library=asked.library)
        rows = scored_rows(evidence, truth, here.section(ShapeRun).presses, networks.values())
        met = [touch.met for touch in evidence.touches]
        return {"schema": 1, "cell": vars(cell), "steps": run.recording.committed, "met": met, "rows": rows}


MEASUREMENT = replace(
    plain_measurement(NAME, *OWN),
    conditions=(MeasuredCondition("choose", CHOICES, ("planned",), ("planned",)),),
    cells=cells,
    run_cell=run_cell,
    methods=ROW_NAMES,
    performed=PlainPerforms(NAME, scene_of),
    counts=(9, 17, 33),
    gross=GROSS,
    published=PAPER_CM,
    subjects=MORE_OBJECTS,
    columns=COLUMNS,
    per_object=("error_m", "chamfer_points_m"),
)
