"""Scale estimation as an experiment: how big is an object of known shape?"""

from collections.abc import Mapping, Sequence

from experiments.scale_estimation.answer import KNOBS, STARTS, ScaleAnswering
from experiments.scale_estimation.cells import DRAWN, LOOKING, ScaleCell
from experiments.scale_estimation.explorer import performer, plan, smallest_error, steps_of
from experiments.scale_estimation.report import create_report
from experiments.scale_estimation.result import lines_of, result_of
from experiments.scale_estimation.section import Scale
from harness.bench.scene import SceneFile
from harness.effects.accuracy import Accuracy, Setting
from harness.experiment.experiment import Experiment
from harness.experiment.measuring import MeasuredCondition, Measurement
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.exploration import PLAN_KEY

NAME = "scale-estimation"


def _answering(run: RunFiles, accuracy: Accuracy) -> ScaleAnswering:
    answering = ScaleAnswering(run, accuracy)
    answering.load()
    return answering


class ScaleMeasurement(Measurement):
    """Measurement of scale estimation."""

    cell = ScaleCell
    conditions = (
        MeasuredCondition("look", LOOKING, ("yes",), ("yes",)),
        MeasuredCondition("shape", DRAWN, ("known",), ("known",)),
    )
    counts = (4, 11)

    def list_answers(
        self,
        thorough: bool,
        chosen: Mapping[str, Sequence[str]],
        scenes: Mapping[str, SceneFile],
        counts: Sequence[int],
    ) -> list[tuple[int, Setting]]:
        """List the answers of a run; only for known shapes every level of the knob."""
        answers = super().list_answers(thorough, chosen, scenes, counts)
        return [one for one in answers if "known" in chosen["shape"] or one[1][STARTS.name] == STARTS.default]


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
    report=create_report,
    count_steps=steps_of,
    measurement=ScaleMeasurement,
    plan_key=PLAN_KEY,
    gap="unplaced",
    assumed={
        "object": {"scale": "hidden"},
        "sensors": {"camera": True, "sound": True, "touch": True},
    },
    error_key="until",
    smallest_error=smallest_error,
    measured="the size and the place of the object are what this run measures",
)
