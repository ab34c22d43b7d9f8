"""Contact localization as an experiment: which point of the object's surface was touched?"""

from functools import partial

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.answer import PROGRAM, ContactAnswering
from experiments.contact_localization.next_contact import ContactChooser
from experiments.contact_localization.plan import plan
from experiments.contact_localization.report.report import GIVES, create_report, sources
from experiments.contact_localization.report.result import answer_lines, result_of
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import KNOBS
from harness.bench.station import Bench
from harness.experiment.experiment import Experiment, Helpers
from harness.recording.run_folder import RunFiles
from harness.recording.session import StepPerformer
from harness.skills.exploring.exploration import Exploration
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between

PLAN_KEY = "contacts"


def _performer(run: RunFiles, helpers: Helpers) -> StepPerformer[Bench]:
    press = PressPerformer(partial(way_between, helpers.twin), ask=helpers.ask, plan_key=PLAN_KEY)
    chooser = None
    if run.scene.section(Localization).choose == "active":
        chooser = ContactChooser(run, helpers.twin, helpers.say)
    enough = "the contact's place is known as well as was asked"
    return Exploration(chooser, press, helpers.ask, helpers.say, enough, patience=0)


EXPERIMENT = Experiment(
    name=PROGRAM,
    title="Contact localization",
    step="contact",
    section=Localization,
    knobs=KNOBS,
    plan=plan,
    performer=_performer,
    answering=ContactAnswering,
    estimate=ContactAnswering.answer,
    result=result_of,
    lines=answer_lines,
    sources=sources,
    gives=GIVES,
    report=create_report,
    count_steps=lambda scene: scene.section(Localization).contacts,
    measurement=ContactMeasurement,
    plan_key=PLAN_KEY,
)
