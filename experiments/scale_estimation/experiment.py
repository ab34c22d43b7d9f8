"""Scale estimation as an experiment: how big is an object of known shape?"""

from collections.abc import Mapping
from typing import Any

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.dials import KNOBS, OWN
from experiments.scale_estimation.explore import PLAN_KEY, ScalePerformer, plan
from experiments.scale_estimation.result import lines_of, result_of
from experiments.scale_estimation.section import Scale
from harness.experiment.experiment import Experiment, Scored
from harness.experiment.plain import plain_measurement


def _sources(_scored: Scored) -> Mapping[str, Any]:
    """Nothing yet: readings are simulated at the drawing's size only."""
    return {}


EXPERIMENT = Experiment(
    name="scale-estimation",
    title="Scale estimation",
    step="step",
    section=Scale,
    knobs=KNOBS,
    plan=plan,
    performer=ScalePerformer,
    answering=ScaleAnswering,
    result=result_of,
    lines=lines_of,
    sources=_sources,
    gives=(),
    measurement=plain_measurement("scale-estimation", *OWN),
    plan_key=PLAN_KEY,
    gap="unplaced",
    observe=(),
    assumed={
        "object": {"scale": "hidden"},
        "sensors": {"camera": True, "sound": True, "touch": True},
    },
    sizes_unknown=True,
)
