"""The steps of a localization run: travel, touch, press, read, retreat.

Everything a step needs is in its parameters, planned and rehearsed before the first one moves.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.arrays import FloatArray
from harness.clock import now
from harness.device import Arm
from harness.errors import NotTouched
from harness.geometry import transform, translation
from harness.reading import Reading
from harness.recording import Recording
from harness.station import Bench
from harness.step_file import Step

FRAMES_PER_CONTACT = 3
"""Frames kept of each press: enough to see whether the gel was still."""

SETTLE = 0.3
"""s between the end of the press and the first frame: the gel creeps for about that long."""


@dataclass(frozen=True)
class ContactMotion:
    """One contact, ready to be performed.

    Attributes:
        travel: ``(n, 6)`` rad, joint way points from the step before to the stand-off.
        base_from_flange: ``(4, 4)`` at the stand-off.
        stand_off: m between the gel and the nominal surface at the stand-off.
        depth: m to press on after the first touch.
    """

    travel: FloatArray
    base_from_flange: FloatArray
    stand_off: float
    depth: float

    def to_parameters(self) -> dict[str, Any]:
        """As JSON values, with the unit in each key."""
        return {
            "travel_rad": self.travel.tolist(),
            "base_from_flange": self.base_from_flange.tolist(),
            "stand_off_m": self.stand_off,
            "depth_m": self.depth,
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> "ContactMotion":
        """The motion that ``to_parameters`` wrote."""
        return cls(
            np.asarray(parameters["travel_rad"], dtype=np.float64).reshape(-1, 6),
            np.asarray(parameters["base_from_flange"], dtype=np.float64),
            float(parameters["stand_off_m"]),
            float(parameters["depth_m"]),
        )


@dataclass(frozen=True)
class Speeds:
    """How fast the arm may go in each phase of a contact (SI).

    Attributes:
        travel: rad/s of the fastest joint between contacts.
        travel_acceleration: rad/s^2.
        approach: m/s within reach of the object.
        press: m/s once the gel touches.
        retreat: m/s away from the object.
        acceleration: m/s^2 of every straight line.
        touch_force: N at which the gel counts as touching.
        overtravel: m beyond the nominal surface before a touch is given up.
    """

    travel: float = 0.9
    travel_acceleration: float = 1.2
    approach: float = 0.010
    press: float = 0.005
    retreat: float = 0.040
    acceleration: float = 0.2
    touch_force: float = 0.4
    overtravel: float = 0.008


class ContactLocalization:
    """Presses the gel where the plan says, and hands on what was read there."""

    def __init__(self, speeds: Speeds | None = None) -> None:
        self.speeds = speeds or Speeds()

    def steps(self, recording: Recording) -> Iterator[Step]:
        """The planned contacts that are not yet on the disk."""
        for index, parameters in enumerate(recording.header.plan["contacts"]):
            if index >= recording.committed:
                yield Step(index, "press", parameters)

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """One contact; the arm ends at the stand-off it approached from."""
        motion = ContactMotion.from_parameters(step.parameters)
        bench.mark(step.index, -1)
        for joints in motion.travel:
            bench.arm.move_joints(joints, self.speeds.travel, self.speeds.travel_acceleration)
        began = now()
        self._touch(step, motion, bench.arm)
        self._press(motion, bench.arm)
        bench.pause(SETTLE)
        bench.mark(step.index, 0)
        image = bench.gel.read(FRAMES_PER_CONTACT, timeout=3.0)
        arm = bench.arm.history(now() - began)
        self._line(bench.arm, motion.base_from_flange, self.speeds.retreat)
        return (image, *arm)

    def _touch(self, step: Step, motion: ContactMotion, arm: Arm) -> None:
        travel = motion.stand_off + self.speeds.overtravel
        arm.zero_force()
        axis = motion.base_from_flange[:3, 2]
        if arm.move_until_contact(axis, self.speeds.approach, self.speeds.touch_force, travel):
            return
        self._line(arm, motion.base_from_flange, self.speeds.retreat)
        raise NotTouched(
            f"contact {step.index + 1}: the gel travelled {travel * 1e3:.0f} mm and met nothing "
            f"({self.speeds.touch_force} N would have been a touch); check that the object stands where the "
            "scene's [object.pose] says, then resume the run"
        )

    def _press(self, motion: ContactMotion, arm: Arm) -> None:
        touched = arm.state().base_from_flange
        # The attitude is the planned one: a measured attitude would carry its noise into the press.
        target = transform(motion.base_from_flange[:3, :3], touched[:3, 3])
        self._line(arm, target @ translation(np.array([0.0, 0.0, motion.depth])), self.speeds.press)

    def _line(self, arm: Arm, base_from_flange: FloatArray, speed: float) -> None:
        arm.move_line(base_from_flange, speed, self.speeds.acceleration)
