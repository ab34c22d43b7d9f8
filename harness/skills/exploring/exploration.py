"""The steps of an exploration: a look, then contacts planned one by one on what is known by then."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.bench.device import CAMERA
from harness.bench.reading import Reading
from harness.bench.station import BARE, LOOK, Bench
from harness.recording.observation import BARE_IMAGE, IMAGE
from harness.recording.recording import Recording
from harness.recording.step_file import Step
from harness.skills.press import After, PressPerformer, Speeds
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
    """Plans the contacts of a run one at a time, on what the steps before have read."""

    def way(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """``(n, 6)`` rad: around all that the object may take, from where the arm is to a travel's end."""

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Whether the steps before one tell as much as the scene asks."""

    def skipped(self, recording: Recording, index: int) -> int:
        """How many steps right before one were not made."""

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """The parameters of a contact.

        Raises:
            WrongUse: no free way was found to any place; nothing was moved.
        """


def kinds(looks: bool, contacts: int) -> list[dict[str, Any]]:
    """The steps of an exploration before anything is read: of each only its kind."""
    return [{"kind": kind} for kind in ["look"] * looks + ["contact"] * contacts]


class Exploration:
    """Looks, then presses, and strikes where that is asked, where the object must be by what is known so far.

    Args:
        explorer: plans the contacts.
        ask: shows a person what to do; None where nobody is there.
        say: tells how it goes.
        enough: what is said where the explorer is sure.
        after: plans a strike where a contact met the object; None for no such strikes.
    """

    def __init__(
        self,
        explorer: NextContact,
        ask: Ask | None,
        say: Callable[[str], None],
        enough: str,
        after: After | None = None,
    ) -> None:
        self._explorer, self._ask, self._say, self._enough = explorer, ask, say, enough
        self._press = PressPerformer(
            explorer.way, SPEEDS, ask=ask, plan_key=PLAN_KEY, explores=True, after=after
        )

    def steps(self, recording: Recording) -> Iterator[Step]:
        """Those that are not on the disk; each contact is planned on what was read before it."""
        planned = recording.planned(PLAN_KEY)
        for index in range(recording.committed, len(planned)):
            if self._explorer.is_sure(recording, index):
                self._say(f"{self._enough}; no more contacts are made")
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
