"""Contacts: travel, touch, press, read, retreat; strike where sound is asked for.

Everything a step needs is in its parameters, planned and rehearsed before the first one moves.

``first_touch`` finds where on its way the gel first touched, from the arm's own packets. Where the arm stops
tells little: the stop comes some packets late, the threshold is met by the noise of one packet, and zeroing
takes one packet's noise as its zero. On a soft contact these move the stop by tenths of a millimetre from one
press to the next. The mean force of the free way gives the zero, and a short mean over packets the moment at
which the force left it.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, MotionEnded, NotTouched
from harness.basics.geometry import transform
from harness.bench.device import HAMMER, Arm, Channel, Reading
from harness.bench.station import PRESS, Bench
from harness.bench.travel import Trajectory, travel
from harness.recording.recording import Recording
from harness.recording.step_file import Step
from harness.skills.strike import (
    FARTHEST,
    READY,
    Ask,
    SearchGuard,
    StrikeMotion,
    meets,
    strike,
    strike_by_hand,
)
from harness.twin.motion import PlannedContact

FRAMES_PER_CONTACT = 3
"""Frames kept of each press: enough to see whether the gel was still."""

SETTLE = 0.3
"""s between the end of the press and the first frame: the gel creeps for about that long."""

After = Callable[[Step, Sequence[Reading]], StrikeMotion | None]
"""Plans a strike on what a contact has just read; None where none is to be made, or none is free."""

STAND_OFF = "base_from_stand_off"
"""Key that the parameters of every planned contact have."""

_ARRAYS = ("start_rad", "travel_rad", STAND_OFF, "axis_in_base")

AVERAGED = 0.02
"""s over which the force is averaged: the noise of ten packets at 500 Hz, and 0.2 mm of the way."""

FREE = 3.0e-3
"""m before the stop up to which the way counts as free: a touch at the search's speed is noticed sooner."""

ZEROED_BY = 10
"""Packets of free way that give a better zero than zeroing did."""


@dataclass(frozen=True, eq=False)
class ContactMotion:
    """One contact, ready to be performed."""

    start: FloatArray  #: ``(6,)`` rad, where the travel was planned to start.
    travel: FloatArray  #: ``(n, 6)`` rad, joint way points from there to the stand-off.
    base_from_stand_off: FloatArray  #: ``(4, 4)`` of the flange.
    axis: FloatArray  #: ``(3,)`` unit in base: the way the gel is pressed.
    search: float  #: m from the stand-off to where the gel would first touch the nominal surface.
    press: float  #: m to press on after the first touch.
    overtravel: float | None = None
    """m beyond ``search`` before a touch is given up; None for that of the performer's speeds."""

    @classmethod
    def planned(
        cls,
        contact: PlannedContact,
        flange_from_gel: FloatArray,
        press: float,
        overtravel: float | None = None,
    ) -> "ContactMotion":
        """The motion of a planned contact whose last ``press`` metres are in the gel."""
        axis = (contact.base_from_stand_off @ flange_from_gel)[:3, 2]
        search = contact.stand_off - press
        return cls(
            contact.start, contact.travel, contact.base_from_stand_off, axis, search, press, overtravel
        )

    def to_parameters(self) -> dict[str, Any]:
        """As JSON values, with the unit in each key."""
        parameters: dict[str, Any] = {
            "start_rad": self.start.tolist(),
            "travel_rad": self.travel.tolist(),
            STAND_OFF: self.base_from_stand_off.tolist(),
            "axis_in_base": self.axis.tolist(),
            "search_m": self.search,
            "press_m": self.press,
        }
        return parameters if self.overtravel is None else {**parameters, "overtravel_m": self.overtravel}

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> "ContactMotion":
        """The motion that ``to_parameters`` wrote."""
        arrays = {name: np.asarray(parameters[name], dtype=np.float64) for name in _ARRAYS}
        return cls(
            arrays["start_rad"],
            arrays["travel_rad"].reshape(-1, 6),
            arrays[STAND_OFF],
            arrays["axis_in_base"],
            float(parameters["search_m"]),
            float(parameters["press_m"]),
            parameters.get("overtravel_m"),
        )

    def longest(self, speeds: "Speeds") -> float:
        """M of the way from the stand-off on where nothing is met."""
        return self.search + (speeds.overtravel if self.overtravel is None else self.overtravel)


@dataclass(frozen=True)
class Speeds:
    """How fast the arm may go in each phase of a contact (SI)."""

    travel: float = 0.9  #: rad/s of the fastest joint between contacts.
    travel_acceleration: float = 1.2  #: rad/s^2.
    approach: float = 0.010  #: m/s within reach of the object.
    press: float = 0.005  #: m/s once the gel touches.
    retreat: float = 0.040  #: m/s away from the object.
    acceleration: float = 0.2  #: m/s^2 of every straight line.
    touch_force: float = 0.3  #: N that end the search; the press is measured from where half of it was met.
    press_force: float = 7.0
    """N that end a press into what nobody knows: the housing may have met it, not the gel, which resists less
    at any depth that is asked for."""
    overtravel: float = 0.008  #: m beyond the nominal surface before a touch is given up.


class PressPerformer:
    """Presses the gel where the plan says, and hands on what was read there.

    Args:
        way: used where the arm is not where a step's travel was planned from: at the start of a
            session, and when a run is resumed.
        speeds: of the motions.
        ask: shows a person what to do, where the station has one strike; None where nobody is there.
        plan_key: where ``run.json`` keeps the planned contacts.
        explores: whether nobody knows where the object is: a search that meets nothing is a reading too,
            and a place that was met elsewhere than planned is not struck as it was planned.
        after: plans a strike where a contact without one met the object; None for no such strikes.
    """

    def __init__(
        self,
        way: Trajectory,
        speeds: Speeds | None = None,
        ask: Ask | None = None,
        plan_key: str = "contacts",
        explores: bool = False,
        after: After | None = None,
    ) -> None:
        self._explores = explores
        self._after = after
        self._met: FloatArray | None = None
        self.plan_key = plan_key
        self.way = way
        self.speeds = speeds or Speeds()
        self.ask = ask

    def steps(self, recording: Recording) -> Iterator[Step]:
        """The planned contacts that are not yet on the disk."""
        for index, parameters in enumerate(recording.planned(self.plan_key)):
            if index >= recording.committed:
                yield Step(index, "press", parameters)

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """One contact; the arm ends at the stand-off it approached from, or where its strike began."""
        motion = ContactMotion.from_parameters(step.parameters)
        arm = bench.arm
        bench.mark(step.index, -1)
        self._travel(motion, bench)
        arm.zero_force()
        began = arm.state().time
        image, moved = self._contact(step, motion, bench, began)
        history = arm.history(arm.state().time - began)
        self._line(arm, motion.base_from_stand_off, "retreat")
        read = (image, *history)
        return (*read, *self._strike(step, moved, read, bench))

    def _strike(self, step: Step, moved: float, read: Sequence[Reading], bench: Bench) -> tuple[Reading, ...]:
        """The hammer where the gel was; nothing where the scene asks for no sound."""
        if HAMMER not in bench.instruments:
            return ()
        planned = step.parameters.get("strike")
        if planned is None and not self._explores:
            return strike_by_hand(step.index, bench, self.ask)
        if planned is None or (self._explores and abs(moved) > FARTHEST):
            return self._strike_met(step, read, bench) if math.isfinite(moved) else ()
        motion = StrikeMotion.from_parameters(planned)
        self._travel(motion, bench)
        return strike(motion, step.index, moved, bench)

    def _strike_met(self, step: Step, read: Sequence[Reading], bench: Bench) -> tuple[Reading, ...]:
        """The hammer where the gel has met an object that nobody knows: its way stops at a touch."""
        motion = None if self._after is None else self._after(step, read)
        if motion is None:
            return ()
        self._travel(motion, bench)
        guard = SearchGuard(self.speeds.approach, self.speeds.touch_force)
        ready = motion.travel[-1] if len(motion.travel) else motion.start
        return (
            Reading(Channel(READY, "rad", (6,), "float64"), np.array([bench.arm.state().time]), ready[None]),
            *strike(motion, step.index, 0.0, bench, guard=guard),
        )

    def _travel(self, motion: ContactMotion | StrikeMotion, bench: Bench) -> None:
        speeds = self.speeds
        travel(
            bench,
            motion.start,
            motion.travel,
            self.way,
            speeds.travel,
            speeds.travel_acceleration,
            self._met,
        )

    def _press(self, motion: ContactMotion, arm: Arm, began: float) -> float:
        """On to the planned depth behind the first touch, wherever the search came to rest.

        Into what nobody knows until something resists firmly, if that is sooner: a housing that met a rim
        is not driven into it.

        Returns:
            m by which the touch was farther than planned.
        """
        state = arm.state()
        search = arm.history(state.time - began)
        touched = first_touch(search, motion.axis, 0.5 * self.speeds.touch_force)
        further = motion.press - (float(state.base_from_flange[:3, 3] @ motion.axis) - touched)
        if self._explores and further > 0.0:
            arm.move_until_contact(motion.axis, self.speeds.press, self.speeds.press_force, further)
        else:
            pressed = transform(
                motion.base_from_stand_off[:3, :3], state.base_from_flange[:3, 3] + (further * motion.axis)
            )
            self._line(arm, pressed, "press")
        return touched - float(motion.base_from_stand_off[:3, 3] @ motion.axis) - motion.search

    def _contact(
        self, step: Step, motion: ContactMotion, bench: Bench, began: float
    ) -> tuple[Reading, float]:
        """Touch, press and read; the frames, and m by which the touch was farther than planned."""
        with self._retreat_after(MotionEnded, motion, bench.arm):
            met = self._touch(step, motion, bench)
            moved = self._press(motion, bench.arm, began) if met else math.inf
        bench.pause(SETTLE)
        bench.mark(step.index, PRESS)
        with self._retreat_after(BenchFault, motion, bench.arm):
            return bench.gel.read(FRAMES_PER_CONTACT, timeout=3.0), moved

    @contextmanager
    def _retreat_after(self, failure: type[BenchFault], motion: ContactMotion, arm: Arm) -> Iterator[None]:
        """Where the camera fails the arm is well, and does not stay pressed on the object."""
        try:
            yield
        except failure:
            self._line(arm, motion.base_from_stand_off, "retreat")
            raise

    def _touch(self, step: Step, motion: ContactMotion, bench: Bench) -> bool:
        travel = motion.longest(self.speeds)
        if meets(bench, motion.axis, travel, SearchGuard(self.speeds.approach, self.speeds.touch_force)):
            self._met = bench.arm.state().base_from_flange[:3, 3]
            return True
        if self._explores:
            return False
        self._line(bench.arm, motion.base_from_stand_off, "retreat")
        raise NotTouched(
            f"contact {step.index + 1}: the gel travelled {travel * 1e3:.0f} mm and met nothing "
            f"({self.speeds.touch_force} N would have been a touch); check that the object stands where the "
            "scene's [object.pose] says, then resume the run"
        )

    def _line(self, arm: Arm, base_from_flange: FloatArray, phase: Literal["press", "retreat"]) -> None:
        speed = self.speeds.press if phase == "press" else self.speeds.retreat
        arm.move_line(base_from_flange, speed, self.speeds.acceleration)


def first_touch(history: Sequence[Reading], axis: FloatArray, force: float) -> float:
    """Metres along ``axis`` from the base's origin to where the flange was when the gel touched.

    Args:
        history: packets of the search, from its start to its stop.
        axis: ``(3,)`` unit in base: the way of the search.
        force: N of mean resistance that is a touch; half of what stopped the search.

    Raises:
        BenchFault: the arm's packets have no poses or no forces.
    """
    named = {reading.channel.name: reading for reading in history}
    try:
        poses, wrenches = named["arm.base_from_flange"], named["arm.wrench"]
    except KeyError as missing:
        raise BenchFault(f"arm: its packets have no {missing}; check the recipe of its stream") from missing
    along = poses.values[:, :3] @ axis
    resistance = -(wrenches.values[:, :3] @ axis)
    free = along < along[-1] - FREE
    if np.count_nonzero(free) >= ZEROED_BY:
        resistance = resistance - resistance[free].mean()
    seconds = float(poses.times[-1] - poses.times[0])
    count = max(1, round(AVERAGED * (len(along) - 1) / seconds)) if seconds > AVERAGED else 1
    window = np.full(count, 1.0 / count)
    way, mean = (np.convolve(values, window, mode="valid") for values in (along, resistance))
    met = np.flatnonzero(mean >= force)
    if len(met) == 0 or met[0] == 0:
        return float(along[-1])
    after = int(met[0])
    share = (force - mean[after - 1]) / (mean[after] - mean[after - 1])
    return float(way[after - 1] + share * (way[after] - way[after - 1]))
