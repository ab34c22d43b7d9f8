"""From a wanted contact to motions the arm can make: reach, approach, press, retreat."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, frame_facing, inverse, transform, translation
from harness.bench import kinematics
from harness.twin.bench import TwinBench
from harness.twin.rehearsal import NEARLY_SINGULAR, SAME, Segment, contact_point
from harness.twin.ways import connect, line_poses, line_postures, sweep_postures

STAND_OFF: Final = 0.03  # m between the gel and the place where it is fully pressed
SEARCHED: Final = 2  # branches for which a way is searched where no natural one is free
GREATEST_TURN: Final = 0.6  # rad of a joint from the stand-off to the press
GREATEST_TURN_OF_LONG: Final = 1.2  # rad, of a line that leads through all that an object may take
FARTHEST: Final = 0.4  # m of a stand-off: no line of this arm about an object is longer
_FARTHER: Final = 0.02


@dataclass(frozen=True, eq=False)
class Approach:
    """One branch that reaches a contact."""

    base_from_gel: FloatArray  #: ``(4, 4)``, fully pressed.
    stand_off_joints: FloatArray  #: ``(6,)`` rad, before the approach.
    pressed_joints: FloatArray  #: ``(6,)`` rad.


@dataclass(frozen=True, eq=False)
class _Planned:
    """The travel to a contact or a strike, as planned."""

    travelling: ClassVar[str]  #: name of the travel's segments.

    start: FloatArray  #: ``(6,)`` rad, where the travel starts.
    travel: FloatArray  #: ``(n, 6)`` rad, joint motions; the last is the stand-off. Empty if it starts there.

    @property
    def stand_off_joints(self) -> FloatArray:
        """Joints ``(6,)`` in rad at which the contact or the strike begins and ends."""
        return self.travel[-1] if len(self.travel) else self.start

    def travels(self, step: int) -> tuple[Segment, ...]:
        """Return the joint motions to the stand-off."""
        stations = [self.start, *self.travel]
        return tuple(Segment(step, self.travelling, "joint", a, b) for a, b in itertools.pairwise(stations))


@dataclass(frozen=True, eq=False)
class PlannedContact(_Planned):
    """A contact with every motion to and from it."""

    travelling = "travel"

    base_from_stand_off: FloatArray  #: ``(4, 4)`` of the flange.
    base_from_pressed: FloatArray  #: ``(4, 4)`` of the flange.
    pressed_joints: FloatArray  #: ``(6,)`` rad.
    stand_off: float  #: m from there to the press.

    def segments(self, step: int) -> tuple[Segment, ...]:
        """Return the motions of the arm for this contact, to be rehearsed."""
        return (*self.travels(step), *self.lines(step))

    def searched(self, step: int, beyond: float, axis: FloatArray) -> Segment:
        """The line to the press and so many metres beyond, where the object may be met later or not at all.

        Args:
            step: of the experiment.
            beyond: m.
            axis: ``(3,)`` unit in base, the way of the press.
        """
        end = translation(beyond * axis) @ self.base_from_pressed
        return Segment(step, "search", "line", self.stand_off_joints, end, touches=True)

    def lines(self, step: int, press: bool = True) -> tuple[Segment, Segment]:
        """There and back along the gel's axis.

        Args:
            step: of the experiment.
            press: whether the object is where the line ends.
        """
        there = self.stand_off_joints
        return (
            Segment(step, "press", "line", there, self.base_from_pressed, touches=True, press=press),
            Segment(step, "retreat", "line", self.pressed_joints, self.base_from_stand_off, touches=True),
        )


def reachable(
    bench: TwinBench,
    base_from_gel: FloatArray,
    stand_off: float = STAND_OFF,
    travels: TwinBench | None = None,
) -> bool:
    """Whether some branch puts the gel there and at the stand-off before it, hitting nothing.

    Quick, for choosing among hundreds of places; the way there is not looked at.

    Args:
        bench: the twin.
        base_from_gel: ``(4, 4)``, fully pressed.
        stand_off: m back along the gel's axis.
        travels: the twin that is travelled in, where it is another; see ``plan_contact``.
    """
    found = stand_off_outside(travels, base_from_gel, stand_off)
    return found is not None and next(_approaches(bench, base_from_gel, found, travels), None) is not None


def stand_off_outside(
    travels: TwinBench | None,
    base_from_gel: FloatArray,
    least: float = STAND_OFF,
    axis: FloatArray | None = None,
) -> float | None:
    """M back along an axis to where the tool is clear of what is travelled around.

    Args:
        travels: the twin that is travelled in; None for the least.
        base_from_gel: ``(4, 4)``, fully pressed, or where a strike is fired.
        least: m.
        axis: ``(3,)`` unit in base, forward; None for the gel's.

    Returns:
        None where it is farther than any line of this arm.
    """
    if travels is None:
        return least
    forward = base_from_gel[:3, 2] if axis is None else axis
    clear = None
    # From outside inward: a tool that is wholly inside the space touches none of its surface either.
    for back in np.arange(least, FARTHEST, _FARTHER)[::-1].tolist():
        if travels.tool_hits(translation(-back * forward) @ base_from_gel, press=False):
            break
        clear = float(back)
    return clear


def plan_contact(
    bench: TwinBench,
    base_from_gel: FloatArray,
    seed_joints: FloatArray,
    stand_off: float = STAND_OFF,
    seed: int = 0,
    searched: int = SEARCHED,
    travels: TwinBench | None = None,
) -> PlannedContact | None:
    """Travel, approach and retreat for one contact; None where no branch has a free way.

    Args:
        bench: the twin.
        base_from_gel: ``(4, 4)``, fully pressed.
        seed_joints: ``(6,)`` rad, where the arm is.
        stand_off: m back along the gel's axis, at least.
        seed: of the search, should one be needed.
        searched: branches for which a way is searched where no natural one is free; the nearest first.
        travels: the twin that is travelled in, where it is another: its object is all the space that an
            object of uncertain place and size may take, so that only the straight approach enters it.
    """
    back = stand_off_outside(travels, base_from_gel, stand_off)
    if back is None:
        return None
    stand_off, around = back, travels or bench
    candidates = [
        approach
        for found in _approaches(bench, base_from_gel, stand_off, travels)
        if (approach := _turned_to(bench, found, seed_joints)) is not None
        and _line_free(bench, approach, NEARLY_SINGULAR if travels is not None else 0.0)
    ]
    candidates.sort(key=lambda approach: float(np.abs(approach.stand_off_joints - seed_joints).max()))
    for thorough in (False, True):
        for approach in candidates[: searched if thorough else None]:
            travel = connect(around, seed_joints, approach.stand_off_joints, seed, thorough)
            if travel is not None:
                pressed = approach.base_from_gel @ bench.gel_from_flange
                before = (
                    approach.base_from_gel
                    @ translation(np.array([0.0, 0.0, -stand_off]))
                    @ bench.gel_from_flange
                )
                return PlannedContact(
                    seed_joints, travel, before, pressed, approach.pressed_joints, stand_off
                )
    return None


def _approaches(
    bench: TwinBench, base_from_gel: FloatArray, stand_off: float, travels: TwinBench | None
) -> Iterator[Approach]:
    """The cheap questions first: the pad, the tool, the reach, the branch's posture, the whole arm."""
    if bench.has_object and not 0.0 < bench.pad_depth(base_from_gel) <= bench.sensor.gel_thickness:
        return
    greatest = GREATEST_TURN if travels is None else GREATEST_TURN_OF_LONG
    around = travels or bench
    before = base_from_gel @ translation(np.array([0.0, 0.0, -stand_off]))
    if bench.tool_hits(base_from_gel, press=True) or bench.tool_hits(before, press=False):
        return
    pressed = kinematics.inverse(bench.model, base_from_gel @ bench.gel_from_flange)
    if len(pressed) == 0:
        return
    good = kinematics.singularity(bench.model, pressed) >= NEARLY_SINGULAR
    for joints in pressed[good]:
        back = kinematics.nearest_branch(
            bench.model, before @ bench.gel_from_flange, joints, bench.joint_range
        )
        if back is None or np.abs(back - joints).max() > greatest:
            continue
        if bench.hits(joints, press=True) or around.hits(back):
            continue
        if float(kinematics.singularity(bench.model, back)) >= NEARLY_SINGULAR:
            yield Approach(base_from_gel, back, joints)


def _turned_to(bench: TwinBench, approach: Approach, seed_joints: FloatArray) -> Approach | None:
    """The same branch, whole turns nearer to where the arm is."""
    back = kinematics.within_range(approach.stand_off_joints[None], seed_joints, bench.joint_range)
    if len(back) == 0:
        return None
    pressed = approach.pressed_joints + (back[0] - approach.stand_off_joints)
    low, high = bench.joint_range
    if np.any(pressed < low) or np.any(pressed > high):
        return None
    return Approach(approach.base_from_gel, back[0], pressed)


def _line_free(bench: TwinBench, approach: Approach, least: float) -> bool:
    start = kinematics.forward(bench.model, approach.stand_off_joints)
    poses = line_poses(start, approach.base_from_gel @ bench.gel_from_flange)
    postures = line_postures(bench, approach.stand_off_joints, poses)
    # A long line may leave its branch on the way: it is only this approach if it ends in its posture.
    if len(postures) < len(poses) or np.abs(postures[-1] - approach.pressed_joints).max() > SAME:
        return False
    if float(kinematics.singularity(bench.model, postures).min()) < least:
        return False
    return sweep_postures(bench, postures, press=True) is None


BACK: Final = 0.03  # m from where the striker is fired to where the straight way there begins
YAWS: Final = 16  # turns about the strike that are looked at: the hammer is round


@dataclass(frozen=True, eq=False)
class PlannedStrike(_Planned):
    """A strike with every motion to and from it."""

    travelling = "travel to strike"

    base_from_ready: FloatArray  #: ``(4, 4)`` of the flange where the straight way begins.
    base_from_firing: FloatArray  #: ``(4, 4)`` of the flange, the tip at its stand-off from the surface.
    firing_joints: FloatArray  #: ``(6,)`` rad.
    axis: FloatArray  #: ``(3,)`` unit in base, the way of the strike.

    def segments(self, step: int) -> tuple[Segment, ...]:
        """Return the motions of the arm for this strike, to be rehearsed; only the striker makes contact."""
        return (*self.travels(step), *self.lines(step))

    def lines(self, step: int) -> tuple[Segment, Segment]:
        """There and back along the strike."""
        return (
            Segment(step, "strike", "line", self.stand_off_joints, self.base_from_firing),
            Segment(step, "draw back", "line", self.firing_joints, self.base_from_ready),
        )


@dataclass(frozen=True, eq=False)
class _Posture:
    """One way to hold the hammer before a place."""

    base_from_ready: FloatArray
    base_from_firing: FloatArray
    ready: FloatArray
    firing: FloatArray


class StrikePlanner:
    """Plans strikes with the hammer of a twin.

    Args:
        bench: a twin that was given the same hammer.
        flange_from_hammer: ``(4, 4)``, the tip at rest, z along the strike.
        stand_off: m between the tip and the surface when the striker is fired; more than the
            twin's clearance.
        travels: the twin that is travelled in, where it is another; see ``plan_contact``.

    Raises:
        WrongUse: a stand-off within the clearance.
    """

    def __init__(
        self,
        bench: TwinBench,
        flange_from_hammer: FloatArray,
        stand_off: float,
        travels: TwinBench | None = None,
    ) -> None:
        if stand_off <= bench.clearance:
            raise WrongUse(
                f"hammer.stand_off = {1e3 * stand_off:g} mm; the tip must stay more than "
                f"{1e3 * bench.clearance:g} mm from the object until it is fired"
            )
        self._bench = bench
        self._travels = travels
        self._around = travels or bench
        self._hammer_from_flange = inverse(flange_from_hammer)
        self._stand_off = stand_off

    def plan(
        self, base_from_gel: FloatArray, seed_joints: FloatArray, seed: int = 0, searched: int = 0
    ) -> PlannedStrike | None:
        """The motions of a strike where a press touches, along the axis of the press.

        Args:
            base_from_gel: ``(4, 4)``, of the press, fully pressed.
            seed_joints: ``(6,)`` rad, where the arm is.
            seed: of the search, should one be needed.
            searched: postures for which a way is searched where no natural one is free.

        Returns:
            None where no posture has a free way.
        """
        near = [
            turned for found in self._postures(base_from_gel) if (turned := self._near(found, seed_joints))
        ]
        near.sort(key=lambda posture: float(np.abs(posture.ready - seed_joints).max()))
        for thorough in (False, True):
            for posture in near[: searched if thorough else None]:
                if not self._line_free(posture):
                    continue
                travel = connect(self._around, seed_joints, posture.ready, seed, thorough)
                if travel is not None:
                    return PlannedStrike(
                        seed_joints,
                        travel,
                        posture.base_from_ready,
                        posture.base_from_firing,
                        posture.firing,
                        base_from_gel[:3, 2],
                    )
        return None

    def _postures(self, base_from_gel: FloatArray) -> Iterator[_Posture]:
        bench = self._bench
        axis = base_from_gel[:3, 2]
        point = apply(bench.base_from_object, contact_point(bench, base_from_gel)[None])[0]
        for yaw in np.linspace(0.0, 2 * np.pi, YAWS, endpoint=False):
            hammer = transform(frame_facing(axis, yaw), point - self._stand_off * axis)
            firing = hammer @ self._hammer_from_flange
            if bench.tool_hits(firing @ bench.flange_from_gel, press=False):
                continue
            way_back = stand_off_outside(self._travels, firing @ bench.flange_from_gel, BACK, axis)
            if way_back is None:
                continue
            ready = hammer @ translation(np.array([0.0, 0.0, -way_back])) @ self._hammer_from_flange
            for joints in kinematics.inverse(bench.model, firing):
                back = kinematics.nearest_branch(bench.model, ready, joints, bench.joint_range)
                turn = GREATEST_TURN if self._travels is None else GREATEST_TURN_OF_LONG
                if back is not None and self._good(joints, back, turn):
                    yield _Posture(ready, firing, back, joints)

    def _good(self, firing: FloatArray, ready: FloatArray, turn: float) -> bool:
        bench = self._bench
        if float(np.abs(ready - firing).max()) > turn:
            return False
        both = np.stack([firing, ready])
        if float(kinematics.singularity(bench.model, both).min()) < NEARLY_SINGULAR:
            return False
        return not bench.hits(firing) and not self._around.hits(ready)

    def _near(self, posture: _Posture, seed_joints: FloatArray) -> _Posture | None:
        """The same posture, whole turns nearer to where the arm is."""
        low, high = self._bench.joint_range
        back = kinematics.within_range(posture.ready[None], seed_joints, self._bench.joint_range)
        if len(back) == 0:
            return None
        firing = posture.firing + (back[0] - posture.ready)
        if np.any(firing < low) or np.any(firing > high):
            return None
        return _Posture(posture.base_from_ready, posture.base_from_firing, back[0], firing)

    def _line_free(self, posture: _Posture) -> bool:
        start = kinematics.forward(self._bench.model, posture.ready)
        poses = line_poses(start, posture.base_from_firing)
        postures = line_postures(self._bench, posture.ready, poses)
        if len(postures) < len(poses) or np.abs(postures[-1] - posture.firing).max() > SAME:
            return False
        singular = float(kinematics.singularity(self._bench.model, postures).min()) < NEARLY_SINGULAR
        if self._travels is not None and singular:
            return False
        return sweep_postures(self._bench, postures, press=False) is None
