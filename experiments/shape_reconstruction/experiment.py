"""Shape reconstruction as an experiment: what does an object never seen look like?"""

from experiments.shape_reconstruction.answer import ShapeAnswering
from experiments.shape_reconstruction.cells import CHOICES, MESHES, ShapeCell
from experiments.shape_reconstruction.explore.explorer import performer, plan, smallest_error, steps_of
from experiments.shape_reconstruction.methods import KNOBS
from experiments.shape_reconstruction.report import create_report
from experiments.shape_reconstruction.result import lines_of, result_of
from experiments.shape_reconstruction.section import ShapeRun
from harness.experiment.experiment import Experiment
from harness.experiment.measuring import MeasuredCondition, Measurement
from harness.skills.exploring.exploration import PLAN_KEY

NAME = "shape-reconstruction"


class ShapeMeasurement(Measurement):
    """Measurement of shape reconstruction."""

    cell = ShapeCell
    conditions = (MeasuredCondition("choose", CHOICES, ("planned",), ("planned",)),)
    counts = (9, 17, 33)
    gross = 10.0e-3
    subjects = MESHES


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
    report=create_report,
    count_steps=steps_of,
    measurement=ShapeMeasurement,
    plan_key=PLAN_KEY,
    assumed={"sensors": {"camera": True, "touch": True}},
    error_key="until",
    smallest_error=smallest_error,
    measured="the shape and the place of the object are what this run measures",
)
