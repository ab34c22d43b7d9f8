"""The steps of a scale estimation: a look, then contacts planned one by one on what is known by then."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from experiments.scale_estimation.answer import SKIPPED
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.next_contact import Explorer
from experiments.scale_estimation.section import Scale
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.reading import Reading
from harness.bench.scene import SceneFile
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.experiment.experiment import Helpers, Planned
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.skills.look import look
from harness.skills.press import PressPerformer, Speeds
from harness.skills.strike import Ask
from harness.twin.rehearsal import rehearse

PLAN_KEY = "steps"

SPEEDS = Speeds(approach=0.02)
"""A search may be tens of centimetres long here; at this speed the arm stops within 1.5 mm of a touch."""

MOST_SKIPPED = 3
"""Contacts in a row without a free way, each looked for anew, after which a run makes no more."""


def steps_of(scene: SceneFile) -> int:
    """How many steps a run of a scene has, if it is not surer before."""
    return len(_kinds(scene))


def _kinds(scene: SceneFile) -> list[str]:
    sensors = scene.sensors
    contacts = scene.section(Scale).contacts if sensors.touch or sensors.sound else 0
    return ["look"] * sensors.camera + ["contact"] * contacts


def plan(scene: SceneFile, station: Station, mesh: Mesh, _seed: int) -> Planned:
    """A look where there is a camera, then so many contacts; each is planned once those before are read.

    Raises:
        WrongUse: nothing is to be read, or the scene names networks that only a table uses.
    """
    if scene.section(Scale).paper_networks is not None:
        raise WrongUse(
            "[scale] paper_networks adds rows to a table and is not used by a run; leave it out of the "
            "scene, or measure with: touchstone tables scale-estimation --set paper_networks=FOLDER"
        )
    steps = [{"kind": kind} for kind in _kinds(scene)]
    if not steps:
        raise WrongUse("nothing is to be read: ask for vision, for contacts, or for both")
    model = ObjectModel(mesh, scene, station)
    bench = model.twin_around(model.nowhere)
    return Planned(steps, rehearse(bench, []), bench)


class ScalePerformer:
    """Looks, then presses and strikes where the object must be, by what is known so far.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """

    def __init__(self, run: RunFiles, helpers: Helpers) -> None:
        self._ask: Ask | None = helpers.ask
        self._say = helpers.say
        self._explorer = Explorer(run)
        self._press = PressPerformer(
            self._explorer.way,
            SPEEDS,
            ask=helpers.ask,
            plan_key=PLAN_KEY,
            explores=True,
            after=self._explorer.strike,
        )

    def steps(self, recording: Recording) -> Iterator[Step]:
        """Those that are not on the disk; each contact is planned on what was read before it."""
        planned = recording.header.plan[PLAN_KEY]
        for index in range(recording.committed, len(planned)):
            if self._explorer.is_sure(recording, index):
                self._say("the size is known as well as was asked; no more contacts are made")
                return
            if planned[index]["kind"] == "look":
                yield Step(index, "look", planned[index])
                continue
            if self._explorer.skipped(recording, index) >= MOST_SKIPPED:
                self._say(f"{MOST_SKIPPED} contacts in a row had no free way; no more are made")
                return
            yield self._contact(recording, planned[index], index)

    def _contact(self, recording: Recording, planned: Mapping[str, Any], index: int) -> Step:
        """The next contact; a step without readings where none has a free way: the run goes on without it."""
        try:
            return Step(index, "press", {**planned, **self._explorer.plan(recording, index)})
        except WrongUse as refusal:
            self._say(f"contact {index + 1} is left out: {refusal}")
            return Step(index, SKIPPED, {**planned, "why": str(refusal)})

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """A look, a contact, or nothing where none had a free way."""
        if step.kind == SKIPPED:
            return ()
        if step.kind == "look":
            return look(step.index, bench, self._ask)
        return self._press.perform(step, bench)
