"""Contact localization as an experiment: which point of the object's surface was touched?"""

from collections.abc import Mapping, Sequence
from functools import partial

from experiments.contact_localization.accuracy.benchmark_runs import Cell, cells, performed, preparations
from experiments.contact_localization.accuracy.budget import BUDGETS
from experiments.contact_localization.accuracy.dials import KNOBS, setting_name, settings, settings_by_count
from experiments.contact_localization.accuracy.solving import ESTIMATOR, PROGRAM
from experiments.contact_localization.accuracy.table import HEARD, METHODS, PAPER_CM, run_cell
from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.next_contact import ChosenContacts
from experiments.contact_localization.plan import plan
from experiments.contact_localization.report.report import GIVES, sources, write
from experiments.contact_localization.report.result import answer_lines, result_of
from experiments.contact_localization.section import Localization
from harness.bench.scene import SceneFile
from harness.bench.station import Bench
from harness.effects.accuracy import Setting
from harness.effects.file_levels import networks_of
from harness.effects.scene_object import named_file
from harness.experiment.experiment import Experiment, Helpers, MeasuredCondition, Measurement
from harness.objectfile.entries import Modality
from harness.recording.run_folder import RunFiles
from harness.recording.session import StepPerformer
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between

PLAN_KEY = "contacts"


def _performer(run: RunFiles, helpers: Helpers) -> StepPerformer[Bench]:
    press = PressPerformer(partial(way_between, helpers.twin), ask=helpers.ask, plan_key=PLAN_KEY)
    if run.scene.section(Localization).choose == "planned":
        return press
    return ChosenContacts(run, helpers.twin, press, helpers.say)


def _cells(objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]) -> list[Cell]:
    heard = _heard(chosen)
    return cells(objects, seeds, chosen["spacing"], chosen["gap"], chosen["yaw"], heard, chosen["choose"])


def _heard(chosen: Mapping[str, Sequence[str]]) -> bool:
    return "both" in chosen["sense"]


def _settings(
    thorough: bool, chosen: Mapping[str, Sequence[str]], scenes: Mapping[str, SceneFile]
) -> Sequence[Setting]:
    networks = frozenset.intersection(*(_networks(scene) for scene in scenes.values()))
    return settings(thorough, _heard(chosen), networks)


def _networks(scene: SceneFile) -> frozenset[Modality]:
    named = scene.object.objectfile is not None
    return networks_of(named_file(scene).description) if named else frozenset()


MEASUREMENT = Measurement(
    estimator=ESTIMATOR,
    conditions=(
        MeasuredCondition("spacing", ("close", "spread"), ("close", "spread")),
        MeasuredCondition("yaw", ("known", "unknown"), ("known",), ("known", "unknown")),
        MeasuredCondition("choose", ("planned", "active"), ("planned",), ("planned",)),
        MeasuredCondition("sense", ("touch", "both"), ("both",)),
    ),
    cells=_cells,
    run_cell=run_cell,
    methods=(*METHODS, *HEARD),
    performed=performed,
    settings=_settings,
    setting_name=setting_name,
    fewer=lambda chosen: settings_by_count(_heard(chosen)),
    counts=(2, 4, 6),
    regions=("touch", "audio", "both"),
    notes=preparations,
    published=PAPER_CM,
)

EXPERIMENT = Experiment(
    name=PROGRAM,
    title="Contact localization",
    step="contact",
    section=Localization,
    knobs=KNOBS,
    plan=plan,
    performer=_performer,
    answering=ContactAnswering,
    result=result_of,
    lines=answer_lines,
    sources=sources,
    gives=GIVES,
    report=write,
    budgets=BUDGETS,
    measurement=MEASUREMENT,
    plan_key=PLAN_KEY,
)
