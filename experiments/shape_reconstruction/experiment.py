"""Shape reconstruction as an experiment."""

from experiments.shape_reconstruction.explore import PLAN_KEY, ShapePerformer, plan
from experiments.shape_reconstruction.readings import ShapeReadings
from experiments.shape_reconstruction.section import ShapeRun
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of
from harness.experiment.experiment import Experiment

NAME = "shape-reconstruction"

EXPERIMENT = Experiment(
    name=NAME,
    title="Shape reconstruction",
    step="step",
    section=ShapeRun,
    knobs=knobs_of(EFFECTS),
    plan=plan,
    performer=ShapePerformer,
    answering=lambda run, _: ShapeReadings(run),
    result=lambda _: {},
    lines=lambda _: [],
    sources=lambda _: {},
    gives=(),
    plan_key=PLAN_KEY,
    observe=(),
    assumed={"sensors": {"camera": True, "touch": True}},
)
