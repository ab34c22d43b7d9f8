"""Scale estimation as an experiment: how big is an object of known shape?"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from experiments.scale_estimation.answer import KNOBS, STARTS, ScaleAnswering
from experiments.scale_estimation.cells import DRAWN, LOOKING, cells, scene_of
from experiments.scale_estimation.explorer import performer, plan, smallest_error, steps_of
from experiments.scale_estimation.report import write
from experiments.scale_estimation.result import lines_of, result_of
from experiments.scale_estimation.section import Scale
from harness.effects.accuracy import Accuracy, Setting
from harness.experiment.experiment import Experiment, MeasuredCondition
from harness.experiment.plain import measure_by_knobs, plain_budgets
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.exploration import PLAN_KEY

NAME = "scale-estimation"


def _answering(run: RunFiles, accuracy: Accuracy) -> ScaleAnswering:
    answering = ScaleAnswering(run, accuracy)
    answering.load()
    return answering


_ALL_DIALS = measure_by_knobs(NAME, cells, scene_of, STARTS)


def _settings(thorough: bool, chosen: Mapping[str, Sequence[str]], scenes: Any) -> tuple[Setting, ...]:
    """Every level of the dial where the shape is known; its default alone where it is not."""
    settings = _ALL_DIALS.settings(thorough, chosen, scenes)
    known = "known" in chosen["shape"]
    return tuple(each for each in settings if known or each[STARTS.name] == STARTS.default)


MEASUREMENT = replace(
    _ALL_DIALS,
    conditions=(
        MeasuredCondition("look", LOOKING, ("yes",), ("yes",)),
        MeasuredCondition("shape", DRAWN, ("known",), ("known",)),
    ),
    settings=_settings,
    counts=(4, 11),
)

EXPERIMENT = Experiment(
    name=NAME,
    title="Scale estimation",
    step="step",
    section=Scale,
    knobs=KNOBS,
    plan=plan,
    performer=performer,
    answering=_answering,
    estimate=ScaleAnswering.answer,
    result=result_of,
    lines=lines_of,
    sources=lambda _scored: {},  # readings are simulated at the CAD model's size only
    gives=(),
    report=write,
    measurement=MEASUREMENT,
    plan_key=PLAN_KEY,
    gap="unplaced",
    observe=(),
    assumed={
        "object": {"scale": "hidden"},
        "sensors": {"camera": True, "sound": True, "touch": True},
    },
    error_key="until",
    smallest_error=smallest_error,
    budgets=plain_budgets(NAME, steps_of, STARTS),
    sizes_unknown=True,
    measured="the size and the place of the object are what this run measures",
)
