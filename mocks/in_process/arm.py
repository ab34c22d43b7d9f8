"""The arm without sockets, in simulated time: a motion takes no longer than computing where it ends."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import BenchFault, LimitExceeded
from harness.basics.geometry import quaternion_from_rotation, rotation_from_vector, vector_from_rotation
from harness.bench.device import ArmState, Channel, Health, Reading
from harness.bench.kinematics import forward, nearest_branch
from mocks.ur.arm.motions import trapezoid
from mocks.world.world import World


@dataclass
class Stage:
    """Where a run is in time and in its plan."""

    time: float = 0.0  #: s on the simulated bench clock.
    step: int = -1  #: of the run; -1 before the first.
    sample: int = -1  #: of the step; -1 before the first.

    def pause(self, seconds: float) -> None:
        """Let simulated time pass."""
        self.time += seconds


def between(start: FloatArray, goal: FloatArray, turn: FloatArray, share: float) -> FloatArray:
    """The pose at ``share`` of the way in a straight line, ``turn`` being the whole turn in start's frame."""
    pose = np.eye(4)
    pose[:3, :3] = start[:3, :3] @ rotation_from_vector(share * turn)
    pose[:3, 3] = start[:3, 3] + share * (goal[:3, 3] - start[:3, 3])
    return goal.copy() if share == 1.0 else pose


CYCLE = 2e-3
"""s, the controller's own step: contact is noticed on this grid."""

NOTICED_AFTER = 2
"""Cycles above the threshold before a search is ended: one alone may be noise."""

_JOINT_RANGE = np.array([[-2 * np.pi] * 6, [2 * np.pi] * 6])
_COARSE = 1e-3


@dataclass(frozen=True, eq=False)
class _Piece:
    """A stretch of motion, from ``start`` to ``end`` s; before and after, the arm is at rest."""

    start: float
    end: float
    joints_at: Callable[[float], FloatArray]


@dataclass(frozen=True, eq=False)
class Rise:
    """A tool digital output that was switched on."""

    output: int  #: 0 or 1.
    base_from_flange: FloatArray  #: ``(4, 4)``, where the flange was.


class InProcessArm:
    """An ``Arm`` that is where it was sent.

    Args:
        model: ``"ur3e"``, ``"ur5e"`` or ``"ur10e"``.
        joints: ``(6,)`` rad, at the start.
        world: pushes back.
        stage: simulated time, and the step whose errors apply.
        rate: packets a second of the history.
    """

    def __init__(
        self, model: str, joints: FloatArray, world: World, stage: Stage, rate: float = 125.0
    ) -> None:
        self._model = model
        self._world = world
        self._stage = stage
        self._rate = rate
        self._zero = np.zeros(6)
        self.outputs: dict[int, bool] = {}  #: of the tool.
        self.rises: list[Rise] = []  #: outputs switched on so far, in order.
        resting = np.array(joints, dtype=np.float64)
        self._pieces = [_Piece(stage.time, stage.time, lambda _: resting)]

    def open(self) -> None:
        """Nothing to connect."""

    def close(self) -> None:
        """Nothing to release."""

    def stop(self) -> None:
        """Nothing moves between two calls."""

    def state(self) -> ArmState:
        """The state at this moment of simulated time."""
        joints = self._joints(self._stage.time)
        pose = forward(self._model, joints)
        return ArmState(self._stage.time, joints, np.zeros(6), pose, self._wrench(pose), "normal", False)

    def history(self, seconds: float) -> tuple[Reading, ...]:
        """Packets of the last ``seconds``, at least the newest one: joints, poses, wrenches, clock."""
        last = int(self._stage.time * self._rate + 1e-9)
        first = min(last, max(0, int(np.ceil((self._stage.time - seconds) * self._rate))))
        times = np.arange(first, last + 1) / self._rate
        joints = np.array([self._joints(time) for time in times]).reshape(-1, 6)
        poses = forward(self._model, joints)
        vectors = [np.concatenate([pose[:3, 3], quaternion_from_rotation(pose[:3, :3])]) for pose in poses]
        wrenches = [self._wrench(pose) for pose in poses]
        return (
            Reading(Channel("arm.joints", "rad", (6,), "float64", "", self._rate), times, joints),
            _reading("arm.base_from_flange", "m, 1", 7, times, vectors, self._rate),
            _reading("arm.wrench", "N, N m", 6, times, wrenches, self._rate),
            Reading(Channel("arm.controller_time", "s", (), "float64", "", self._rate), times, times),
        )

    def move_joints(self, joints: FloatArray, speed: float, acceleration: float) -> None:
        """Move to ``(6,)`` rad, every joint in proportion to the one that turns most."""
        start, goal = self._joints(self._stage.time), np.array(joints, dtype=np.float64)
        _require_finite(goal, speed, acceleration)
        furthest = float(np.abs(goal - start).max())
        way = trapezoid(furthest, speed, acceleration)
        self._append(way.duration, lambda time: start + way.share(time) * (goal - start))

    def move_line(self, base_from_flange: FloatArray, speed: float, acceleration: float) -> None:
        """Move in a straight line, turning evenly on the way."""
        _require_finite(base_from_flange, speed, acceleration)
        start = self.state().base_from_flange
        self._require_reachable(base_from_flange)
        length = float(np.linalg.norm(base_from_flange[:3, 3] - start[:3, 3]))
        turn = vector_from_rotation(start[:3, :3].T @ base_from_flange[:3, :3])
        way = trapezoid(max(length, 0.1 * float(np.linalg.norm(turn))), speed, acceleration)
        self._append_line(way.duration, lambda time: between(start, base_from_flange, turn, way.share(time)))

    def move_until_contact(self, direction: FloatArray, speed: float, force: float, travel: float) -> bool:
        """Move along a unit direction until ``force`` N resist; False after ``travel`` m without."""
        _require_finite(direction, speed, force)
        start = self.state().base_from_flange
        step = speed * CYCLE

        def at(distance: float) -> FloatArray:
            pose = start.copy()
            pose[:3, 3] += distance * direction
            return pose

        met = self._first_resistance(lambda k: at(k * step), direction, force, int(travel / step), step)
        distance = travel if met is None else (met + NOTICED_AFTER) * step
        self._require_reachable(at(distance))
        way = trapezoid(distance, speed, np.inf)
        self._append_line(way.duration, lambda time: at(way.share(time) * distance))
        return met is not None

    def zero_force(self) -> None:
        """Take the present wrench as zero."""
        self._zero = self._world.contact_wrench(self.state().base_from_flange, self._stage.step)

    def set_digital_output(self, index: int, on: bool) -> None:
        """Switch a tool digital output: 0 or 1."""
        if index not in (0, 1):
            raise LimitExceeded(f"tool digital output {index} does not exist; a UR tool has 0 and 1")
        if on and not self.outputs.get(index, False):
            self.rises.append(Rise(index, self.state().base_from_flange))
        self.outputs[index] = on

    def health(self) -> Health:
        """Every packet, on time."""
        return Health("arm", f"{self._model} in process", self._rate, 0, 0.0, "simulated time")

    def _first_resistance(
        self, at: Callable[[int], FloatArray], direction: FloatArray, force: float, last: int, step: float
    ) -> int | None:
        """The first cycle whose pose meets ``force``: by millimetres, then by halving the last one."""

        def resists(cycle: int) -> bool:
            return abs(float(self._wrench(at(cycle))[:3] @ direction)) >= force

        stride = max(1, round(_COARSE / step))
        for met in range(0, last + stride, stride):
            if resists(min(met, last)):
                break
        else:
            return None
        low, high = max(0, met - stride), min(met, last)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if resists(middle) else (middle, high)
        return high

    def _wrench(self, base_from_flange: FloatArray) -> FloatArray:
        wrench: FloatArray = self._world.contact_wrench(base_from_flange, self._stage.step) - self._zero
        return wrench

    def _joints(self, time: float) -> FloatArray:
        piece = next((piece for piece in reversed(self._pieces) if piece.start <= time), self._pieces[0])
        return piece.joints_at(min(time, piece.end) - piece.start)

    def _append(self, duration: float, joints_at: Callable[[float], FloatArray]) -> None:
        start = self._stage.time
        self._pieces.append(_Piece(start, start + duration, joints_at))
        self._stage.time = start + duration

    def _append_line(self, duration: float, pose_at: Callable[[float], FloatArray]) -> None:
        seed = self._joints(self._stage.time)
        last = self._solved(pose_at(duration), seed)

        def joints_at(time: float) -> FloatArray:
            return last if time >= duration else self._solved(pose_at(time), seed)

        self._append(duration, joints_at)

    def _solved(self, base_from_flange: FloatArray, seed: FloatArray) -> FloatArray:
        joints = nearest_branch(self._model, base_from_flange, seed, _JOINT_RANGE)
        if joints is None:
            raise BenchFault(f"no joints of the {self._model} reach a pose on the line; nothing was moved")
        return joints

    def _require_reachable(self, base_from_flange: FloatArray) -> None:
        self._solved(base_from_flange, self._joints(self._stage.time))


def _require_finite(target: FloatArray, *numbers: float) -> None:
    if not (np.isfinite(target).all() and all(0.0 < number < np.inf for number in numbers)):
        raise LimitExceeded(f"a motion to {target.tolist()} with {numbers} is not finite; nothing was sent")


def _reading(
    name: str, unit: str, width: int, times: FloatArray, values: list[AnyArray], rate: float
) -> Reading:
    channel = Channel(name, unit, (width,), "float64", "base", rate)
    return Reading(channel, times, np.array(values).reshape(-1, width))
