"""Shape reconstruction as an experiment: what does an object never seen look like?"""

from dataclasses import replace

from experiments.shape_reconstruction.answer import ShapeAnswering
from experiments.shape_reconstruction.cells import CHOICES, MORE_OBJECTS, cells, scene_of
from experiments.shape_reconstruction.explore.explorer import performer, plan, smallest_error, steps_of
from experiments.shape_reconstruction.methods import KNOBS, OWN
from experiments.shape_reconstruction.report import write
from experiments.shape_reconstruction.result import lines_of, result_of, write_files
from experiments.shape_reconstruction.section import ShapeRun
from harness.experiment.experiment import Experiment, MeasuredCondition
from harness.experiment.plain import measure_by_knobs, plain_budgets
from harness.skills.exploring.exploration import PLAN_KEY

NAME = "shape-reconstruction"

MEASUREMENT = replace(
    measure_by_knobs(NAME, cells, scene_of, *OWN),
    conditions=(MeasuredCondition("choose", CHOICES, ("planned",), ("planned",)),),
    counts=(9, 17, 33),
    gross=10.0e-3,
    subjects=MORE_OBJECTS,
)

EXPERIMENT = Experiment(
    name=NAME,
    title="Shape reconstruction",
    step="step",
    section=ShapeRun,
    knobs=KNOBS,
    plan=plan,
    performer=performer,
    answering=ShapeAnswering,
    estimate=ShapeAnswering.answer,
    result=result_of,
    lines=lines_of,
    sources=lambda _scored: {},  # readings are simulated on an object that is known
    gives=(),
    report=write,
    files=write_files,
    measurement=MEASUREMENT,
    plan_key=PLAN_KEY,
    observe=(),
    assumed={"sensors": {"camera": True, "touch": True}},
    error_key="until",
    smallest_error=smallest_error,
    budgets=plain_budgets(NAME, steps_of, *OWN),
    measured="the shape and the place of the object are what this run measures",
)
