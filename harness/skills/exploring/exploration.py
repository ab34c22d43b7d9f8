"""Perform the steps of a run whose contacts are chosen one at a time from what was read before."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any, Protocol

from harness.basics.errors import WrongUse
from harness.bench.device import CAMERA, Reading
from harness.bench.station import BARE, LOOK, Bench
from harness.bench.travel import Trajectory
from harness.recording.observation import BARE_IMAGE, IMAGE
from harness.recording.recording import Recording
from harness.recording.step_file import Step
from harness.skills.press import STAND_OFF, After, PressPerformer, Speeds
from harness.skills.strike import Ask

PLAN_KEY = "steps"
"""Where ``run.json`` keeps what kind each step is."""

SKIPPED = "skip"
"""Kind of a step that was not made, because no way was free."""

SPEEDS = Speeds(approach=0.02)
"""A search may be tens of centimetres long here; at this speed the arm stops within 1.5 mm of a touch."""

MOST_SKIPPED = 3
"""Contacts in a row without a free way, each looked for anew, after which a run makes no more."""

FRAMES = 3
"""Of each: their median has less of the camera's noise."""

_PATIENCE = 5.0


class NextContact(Protocol):
    """Chooses the contacts of a run one at a time, from the readings of the steps before."""

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Return whether the steps before ``index`` determine the answer as well as the scene asks."""

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """Return the parameters of the contact that is step ``index``.

        Raises:
            WrongUse: no place has a collision-free path; nothing was moved.
        """


def kinds(looks: bool, contacts: int) -> list[dict[str, Any]]:
    """The steps of an exploration before anything is read: of each only its kind."""
    return [{"kind": kind} for kind in ["look"] * looks + ["contact"] * contacts]


def press_into_unknown(way: Trajectory, ask: Ask | None, after: After | None = None) -> PressPerformer:
    """Create the performer of presses into the space of an object whose pose or shape is unknown.

    Args:
        way: plans a path around the space that the object may take.
        ask: shows the operator what to do; None without an operator.
        after: plans a strike where a contact met the object; None for no such strikes.
    """
    return PressPerformer(way, SPEEDS, ask=ask, plan_key=PLAN_KEY, explores=True, after=after)


class Exploration:
    """Performs looks, presses and strikes; contacts without planned parameters are chosen one at a time.

    Args:
        chooser: chooses the contacts; None if all are planned.
        press: performs each contact.
        ask: shows the operator what to do; None without an operator.
        say: reports the progress.
        enough: reported when the chooser is sure.
        patience: contacts in a row without a collision-free path, each left out as a step of its own, after
            which no more are made.
    """

    def __init__(
        self,
        chooser: NextContact | None,
        press: PressPerformer,
        ask: Ask | None,
        say: Callable[[str], None],
        enough: str,
        patience: int = MOST_SKIPPED,
    ) -> None:
        self._chooser, self._press, self._ask, self._say = chooser, press, ask, say
        self._enough, self._patience = enough, patience

    def steps(self, recording: Recording) -> Iterator[Step]:
        """Yield the steps that are not on the disk; each contact is chosen from what was read before it."""
        planned = recording.planned(self._press.plan_key)
        skipped = self._skipped_last(recording)
        for index in range(recording.committed, len(planned)):
            if self._chooser is not None and self._chooser.is_sure(recording, index):
                self._say(f"{self._enough}; no more contacts are made")
                return
            if planned[index].get("kind") == "look":
                yield Step(index, "look", planned[index])
                continue
            if self._chooser is None or STAND_OFF in planned[index]:
                yield Step(index, "press", planned[index])
                continue
            if skipped and skipped >= self._patience:
                self._say(f"{skipped} contacts in a row had no free way; no more are made")
                return
            kind = {key: value for key, value in planned[index].items() if key == "kind"}
            try:
                step = Step(index, "press", {**kind, **self._chooser.plan(recording, index)})
            except WrongUse as refusal:
                if self._patience == 0:
                    self._say(f"no more contacts are made than {index}: {refusal}")
                    return
                self._say(f"contact {index + 1} is left out: {refusal}")
                step = Step(index, SKIPPED, {**planned[index], "why": str(refusal)})
            skipped = skipped + 1 if step.kind == SKIPPED else 0
            yield step

    def _skipped_last(self, recording: Recording) -> int:
        for count in range(recording.committed):
            if recording.step(recording.committed - 1 - count).step.kind != SKIPPED:
                return count
        return recording.committed

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """A look, a contact, or nothing where none had a free way."""
        if step.kind == SKIPPED:
            return ()
        if step.kind == "look":
            camera = bench.find(CAMERA)
            if camera is None:
                raise WrongUse(
                    "a look needs the scene camera: set sensors.camera = true, or leave vision out"
                )
            if self._ask is None and bench.lab is None and bench.station.mock is None:
                raise WrongUse(
                    "the camera must see the bench without the object first, and nobody can be asked to "
                    "clear it; run without --json at a terminal"
                )
            readings = []
            for sample, name, request in (
                (BARE, BARE_IMAGE, "take the object off the bench"),
                (LOOK, IMAGE, "put the object where it stood"),
            ):
                if self._ask is not None and bench.station.mock is None:
                    self._ask(f"{request}, then go on")
                bench.mark(step.index, sample)
                reading = camera.read(FRAMES, _PATIENCE)
                readings.append(replace(reading, channel=replace(reading.channel, name=name)))
            return tuple(readings)
        return self._press.perform(step, bench)
