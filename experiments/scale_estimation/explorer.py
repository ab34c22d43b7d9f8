"""Plan the steps of a run: a camera image, then contacts chosen one by one from what is known by then.

The arm travels around all the space that the object may take, and enters it on straight lines only, slowly,
stopping at a touch. Lines are chosen on the object at its estimated pose. Without an estimate, or without a
known shape, they lead to where the object should be.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from statistics import NormalDist
from typing import Any

import numpy as np

from experiments.scale_estimation.answer import KNOBS, ScaleAnswering, patch_of_contact
from experiments.scale_estimation.contact_planning import (
    aims_unmet,
    blind_envelope,
    contact_on_object,
    seen_envelope,
    strike_met,
)
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import CREDIBLE, SHARED
from experiments.scale_estimation.touch.fit import UNKNOWNS, FreeSpace, Patch, TouchProblem
from experiments.scale_estimation.touch.touch import by_touch
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MotionRefused, PictureRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.device import Reading
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import ErrorBound, Helpers, Planned
from harness.experiment.levels import chosen_levels
from harness.picture.outline import SeenOutline
from harness.recording.observation import observe_step
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step, StepRecord
from harness.skills.exploring.exploration import Exploration, kinds, press_into_unknown
from harness.skills.exploring.lines import (
    LineTarget,
    Surroundings,
    contact_along,
    end_of,
    lines_to,
    unlike_first,
)
from harness.skills.exploring.unknown_space import (
    FLAT,
    SeenThing,
    aims_of_seen,
    aims_unseen,
    seen_thing,
    unknown_space,
)
from harness.skills.planning import HOME
from harness.skills.strike import POSE, READY, StrikeMotion
from harness.twin.bench import TwinBench
from harness.twin.bench_of import way_between
from harness.twin.rehearsal import rehearse


def steps_of(scene: SceneFile) -> int:
    """How many steps a run of a scene has, if it is not surer before."""
    sensors = scene.sensors
    contacts = scene.section(Scale).contacts if sensors.touch or sensors.sound else 0
    return int(sensors.camera) + contacts


def smallest_error(scene: SceneFile, mesh: Mesh) -> ErrorBound:
    """Return the narrowest half interval that an answer can state: every sense shares ``SHARED``."""
    nominal = float((mesh.bounds[1] - mesh.bounds[0]).max())
    low = scene.object.sizes_of(nominal)[0] if scene.object.is_hidden else nominal
    half = NormalDist().inv_cdf(0.5 + 0.5 * CREDIBLE)
    return ErrorBound(
        half * SHARED * low,
        f"half the 90 % interval of an object {1e3 * low:.0f} mm long: all senses share an error of "
        f"{100 * SHARED:g} % of the size, which no contact reduces",
        "or leave it out to make every contact",
    )


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
    looks, count = scene.sensors.camera, steps_of(scene)
    if count == 0:
        raise WrongUse("nothing is to be read: ask for vision, for contacts, or for both")
    model = ObjectModel(mesh, scene, station)
    bench = model.twin_around(model.nowhere)
    steps = kinds(looks, count - looks)
    return Planned(steps, rehearse(bench, []), bench, on_the_way=count - looks)


def performer(run: RunFiles, helpers: Helpers) -> Exploration:
    """Looks, then presses and strikes where the object must be, by what is known so far.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """
    explorer = Explorer(run)
    press = press_into_unknown(explorer.way, helpers.ask, explorer.strike)
    return Exploration(explorer, press, helpers.ask, helpers.say, "the size is known as well as was asked")


LARGEST = 0.999
"""Probability that an object of unknown shape is no larger than travels allow for, by its outline."""

_LOW = 0.8
"""Of the height of the smallest object, up to which lines into the unknown end."""


class Explorer:
    """Plans a run's contacts one at a time."""

    def __init__(self, run: RunFiles) -> None:
        self._run = run
        self._asked = run.scene.section(Scale)
        self._drawn = self._asked.shape == "known"
        self._answering = ScaleAnswering(run, chosen_levels(KNOBS, (), run.network_levels))
        self._model: ObjectModel = self._answering.model
        self._read = 0
        self._joints: FloatArray = HOME
        self._struck = 0
        self._contacts = 0
        self._followed: list[FloatArray] = []
        self._travels: TwinBench | None = None
        self._nothing: TwinBench | None = None
        self._seen: tuple[SeenStand, ...] = ()
        self._thing: SeenThing | None = None

    def way(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """A way around all that the object may take, from where the arm is to the end of a travel."""
        assert self._travels is not None
        return way_between(self._travels, here, planned)

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Whether the steps before one tell the size as well as the scene asks."""
        until = self._asked.until
        if until is None or index == 0:
            return False
        self._take_in(recording, index)
        low, high = self._answering.answer().fused.interval
        return bool(0.5 * (high - low) <= until)

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """The parameters of a contact.

        Raises:
            WrongUse: no free way was found to any place; nothing was moved.
        """
        self._take_in(recording, index)
        here = self._surroundings()
        random = np.random.default_rng((recording.header.seed, index))
        stand = None
        if self._drawn:
            seen = self._seen
            stand = _stand_from_look(self._answering, seen) if seen else _stand_from_contacts(self._answering)
        if stand is not None:
            strikes = bool(seen) and self._strikes_left() > 0
            with suppress(WrongUse, MotionRefused):
                return contact_on_object(here, self._model, self._answering.patches, stand, random, strikes)
        aims, support = self._aims(random), float(self._model.place[2])
        press = float(np.mean(self._asked.depth))
        lines = unlike_first(lines_to(aims, here, support, random), self._followed)
        return contact_along(here, lines, press)

    def strike(self, step: Step, read: Sequence[Reading]) -> StrikeMotion | None:
        """A strike where a contact has just met the object; None where none is left, or none is free.

        Where the object was seen, and its shape is known, strikes are planned on that, with their contacts.
        """
        patch, rotation = self._met(step, read)
        if self._seen or patch is None or self._strikes_left() == 0:
            return None
        here = self._surroundings(end_of(step.parameters))
        return strike_met(here, self._model, patch, rotation)

    def _met(self, step: Step, read: Sequence[Reading]) -> tuple[Patch | None, FloatArray]:
        """What a contact touched, and ``(3, 3)`` the gel's turn in base."""
        run = self._run
        record = StepRecord(step, {reading.channel.name: reading for reading in read}, 0.0)
        seen = observe_step(record, run.station.flange_from_gel, aspect=run.aspect)
        patch = None
        with suppress(PictureRefused):  # the answer names it
            patch = patch_of_contact(seen, run.gel_reader, run.station.gel.sensor.pitch)
        return patch, seen.base_from_gel[:3, :3]

    def _take_in(self, recording: Recording, index: int) -> None:
        for k in range(self._read, index):
            self._take_in_step(recording.step(k))
        self._read = index
        outline = self._answering.outline
        if not isinstance(outline, SeenOutline):
            return
        if self._drawn and not self._seen:
            self._seen = self._answering.stands_seen()
        elif not self._drawn and self._thing is None:
            self._thing = seen_thing(self._model.unknown_stand, outline)

    def _take_in_step(self, record: StepRecord) -> None:
        self._answering.read(record)
        if record.step.kind != "press":
            return
        self._contacts += 1
        base_from_stand_off = np.asarray(record.step.parameters["base_from_stand_off"])
        self._followed.append(base_from_stand_off @ self._run.station.flange_from_gel)
        self._struck += POSE in record.readings and not self._answering.strikes[-1].fault
        if READY in record.readings:
            self._joints = np.asarray(record.readings[READY].values[-1])
        else:
            parameters = record.step.parameters
            self._joints = end_of(parameters["strike"] if POSE in record.readings else parameters)

    def _surroundings(self, joints: FloatArray | None = None) -> Surroundings:
        if self._travels is None or self._nothing is None:
            model = self._model
            self._travels = model.twin_around(self._space())
            self._nothing = model.twin_around(model.nowhere, has_object=False)
        at = self._joints if joints is None else joints
        return Surroundings(self._run.scene, self._run.station, self._travels, self._nothing, at)

    def _space(self) -> Mesh:
        model, outline = self._model, self._answering.outline
        if not self._drawn:
            seen = outline if isinstance(outline, SeenOutline) else None
            return unknown_space(model.unknown_stand, seen, self._largest())
        return seen_envelope(model, self._seen) if self._seen else blind_envelope(model)

    def _largest(self) -> float:
        """M, of an object of unknown shape: as its outline has it, within the range that was asked about."""
        high = self._model.sizes.high
        try:
            belief = self._answering.without_shape()["vision"]().belief
        except FitRefused:
            return high
        return min(high, belief.below(LARGEST))

    def _aims(self, random: np.random.Generator) -> Iterable[LineTarget]:
        model = self._model
        if self._thing is not None:
            return aims_of_seen(self._thing, float(model.place[2]), self._contacts, random)
        if self._drawn and not self._seen and model.height < FLAT * model.nominal:
            return aims_unmet(model, self._answering.patches, self._answering.free, random)
        middle = model.place
        if self._seen:
            middle = middle + np.array([*self._seen[0].unknowns[1:3], 0.0])
        height = model.sizes.low
        if self._drawn:
            height = _LOW * model.height * model.sizes.low / model.nominal
        return aims_unseen(middle, model.place_error, height, self._contacts == 0, random)

    def _strikes_left(self) -> int:
        return self._asked.strikes - self._struck if self._run.scene.sensors.sound else 0


BELIEVED_AFTER = 2
"""Contacts without a look after which the object is believed to stand where they say."""

ALONG_SIGHT = (0.0, 1.0, -1.0, 2.0, -2.0)
"""Standard deviations of its place along the line of sight at which a seen object is thought of."""

SURE_OF_SIZE = 0.1
"""Of the size's logarithm: where contacts fit a seen object farther off than that, it is by chance."""


def _stand_from_contacts(answering: ScaleAnswering) -> FloatArray | None:
    model, patches = answering.model, answering.patches
    if len(patches) < BELIEVED_AFTER:
        return None
    try:
        found = by_touch(model.stand, patches, model.nominal, model.sizes, free=answering.free)
    except FitRefused:
        return None
    return np.asarray(found.unknowns[:4])


def _stand_from_look(answering: ScaleAnswering, seen: Sequence[SeenStand]) -> FloatArray:
    """Of every turn that was seen, and places along the line of sight: what the contacts fit best."""
    model, patches = answering.model, answering.patches
    away = np.array(ALONG_SIGHT)
    starts = np.zeros((len(seen) * len(away), UNKNOWNS))
    for row, (stand, far) in enumerate((stand, far) for stand in seen for far in away):
        starts[row, :4] = stand.unknowns
        starts[row, 1:3] += far * stand.farthest
    costs = 0.5 * np.tile(away, len(seen)) ** 2
    problem = TouchProblem(model.stand, patches, len(patches[0].points) if patches else 1)
    found = starts
    if patches:
        found, misfits = problem.refined(starts, 8, fixed_size=False)
        costs = costs + misfits
    best = int((costs + FreeSpace(model.stand, answering.free).cost(found)).argmin())
    # A few contacts can be fitted by another size: what was seen of it holds.
    kept = found if abs(found[best, 0] - starts[best, 0]) < SURE_OF_SIZE else starts
    return np.asarray(kept[best, :4])
