"""Shape reconstruction as an experiment: what does an object never seen look like?"""

from experiments.shape_reconstruction.answer import ShapeAnswering
from experiments.shape_reconstruction.dials import KNOBS, OWN
from experiments.shape_reconstruction.explorer import performer, plan, smallest_error, steps_of
from experiments.shape_reconstruction.report import write
from experiments.shape_reconstruction.result import lines_of, result_of, write_files
from experiments.shape_reconstruction.section import ShapeRun
from experiments.shape_reconstruction.table import MEASUREMENT, NAME
from harness.experiment.experiment import Experiment
from harness.experiment.plain import plain_budgets
from harness.skills.exploring.exploration import PLAN_KEY

EXPERIMENT = Experiment(
    name=NAME,
    title="Shape reconstruction",
    step="step",
    section=ShapeRun,
    knobs=KNOBS,
    plan=plan,
    performer=performer,
    answering=ShapeAnswering,
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
