"""From a place that was touched to motions that bring the hammer before it and away again."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, frame_facing, inverse, transform, translation
from harness.bench import kinematics
from harness.twin.bench import TwinBench
from harness.twin.motion import GREATEST_TURN, GREATEST_TURN_OF_LONG, stand_off_outside
from harness.twin.rehearsal import NEARLY_SINGULAR, SAME, Segment, contact_point
from harness.twin.sweep import line_poses, line_postures, sweep_postures
from harness.twin.ways import connect

BACK: Final = 0.03  # m from where the striker is fired to where the straight way there begins
YAWS: Final = 16  # turns about the strike that are looked at: the hammer is round


@dataclass(frozen=True, eq=False)
class PlannedStrike:
    """A strike with every motion to and from it."""

    start: FloatArray  #: ``(6,)`` rad, where the travel starts.
    travel: FloatArray  #: ``(n, 6)`` rad, joint motions; the last is where the straight way begins.
    base_from_ready: FloatArray  #: ``(4, 4)`` of the flange, there.
    base_from_firing: FloatArray  #: ``(4, 4)`` of the flange, the tip at its stand-off from the surface.
    firing_joints: FloatArray  #: ``(6,)`` rad.
    axis: FloatArray  #: ``(3,)`` unit in base, the way of the strike.

    @property
    def ready_joints(self) -> FloatArray:
        """``(6,)`` rad: where the strike begins and ends."""
        return self.travel[-1] if len(self.travel) else self.start

    def segments(self, step: int) -> tuple[Segment, ...]:
        """What the arm does for this strike, to be rehearsed; it touches nothing, the striker does."""
        return (*self.travels(step), *self.lines(step))

    def travels(self, step: int) -> tuple[Segment, ...]:
        """The joint motions to where the strike begins."""
        stations = [self.start, *self.travel]
        return tuple(
            Segment(step, "travel to strike", "joint", a, b) for a, b in itertools.pairwise(stations)
        )

    def lines(self, step: int) -> tuple[Segment, Segment]:
        """There and back along the strike."""
        return (
            Segment(step, "strike", "line", self.ready_joints, self.base_from_firing),
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
