"""The steps of a scale estimation: a look, then contacts planned and rehearsed on what was seen."""

from collections.abc import Iterator, Sequence
from functools import partial

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.dials import KNOBS
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from harness.basics.errors import FitRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.reading import Reading
from harness.bench.scene import SceneFile
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.experiment.experiment import Helpers, Planned
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.skills.look import look
from harness.skills.planning import ContactRequest, RunPlan, plan_run
from harness.skills.press import PressPerformer
from harness.skills.sites import PressLimits
from harness.skills.strike import Ask
from harness.twin.bench_of import twin_of, way_between
from harness.twin.rehearsal import rehearse

PLAN_KEY = "steps"


def plan(scene: SceneFile, station: Station, mesh: Mesh, _seed: int) -> Planned:
    """A look, then so many contacts: where they are is planned when the look has told the size.

    Raises:
        WrongUse: contacts are asked for and no look.
        NotImplementedError: likewise, with sight left out on purpose.
    """
    asked = scene.section(Scale)
    sensors = scene.sensors
    contacts = asked.contacts if sensors.touch or sensors.sound else 0
    if contacts and not sensors.camera:
        raise NotImplementedError(
            "experiments.scale_estimation.explore: contacts on an object of unknown size that the camera has "
            "not seen; set sensors.camera = true"
        )
    if not contacts and not sensors.camera:
        raise WrongUse("nothing is to be read: ask for vision, for contacts, or for both")
    steps = [{"kind": "look"}, *({"kind": "contact"} for _ in range(contacts))]
    bench = twin_of(scene, station, mesh)
    return Planned(steps, rehearse(bench, []), bench)


class ScalePerformer:
    """Looks, then presses and strikes where the object must be, by what was seen.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """

    def __init__(self, run: RunFiles, helpers: Helpers) -> None:
        self._run = run
        self._ask: Ask | None = helpers.ask
        self._say = helpers.say
        self._press: PressPerformer | None = None

    def steps(self, recording: Recording) -> Iterator[Step]:
        """The look if it is not on the disk, then the contacts that are not."""
        planned = recording.header.plan[PLAN_KEY]
        if recording.committed == 0:
            yield Step(0, "look", planned[0])
        if len(planned) < 2:
            return
        self._say("planning the contacts on the object as it was seen, rehearsing every motion")
        parameters = self._contacts(recording, len(planned) - 1)
        for index in range(recording.committed, len(planned)):
            yield Step(index, "press", {**planned[index], **parameters[index - 1]})

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """A look or a contact."""
        if step.kind == "look":
            return look(step.index, bench, self._ask)
        assert self._press is not None
        return self._press.perform(step, bench)

    def _contacts(self, recording: Recording, count: int) -> Sequence[dict[str, object]]:
        made = plan_seen(self._run, recording, count)
        self._press = PressPerformer(partial(way_between, made.bench), ask=self._ask, plan_key=PLAN_KEY)
        return made.parameters()


def plan_seen(run: RunFiles, recording: Recording, count: int) -> RunPlan:
    """Contacts all over the object as the look saw it: as large, where and turned as its best fit.

    Raises:
        FitRefused: the look did not see the object; nothing can be planned on it.
    """
    answering = ScaleAnswering(run, Accuracy.default(KNOBS))
    answering.read(recording.step(0))
    sight = answering.answer().by_sense["vision"]
    if isinstance(sight, FitRefused):
        raise sight
    model: ObjectModel = answering.model
    _, x, y, yaw = sight.fit.unknowns[:4].tolist()
    size = sight.belief.size
    asked = run.scene.section(Scale)
    limits = PressLimits(tilt=asked.tilt, depth=asked.depth)
    wanted = ContactRequest(count, "spread", limits, asked.strikes)
    scene = model.scene_at(size, x, y, yaw)
    return plan_run(scene, run.station, model.mesh_at(size), recording.header.seed, wanted)
