"""A Universal Robots arm over RTDE, kept within the station's limits.

ur_rtde lives in a child process with deadlines and the controller's watchdog armed. There are two
ways to stop: through the child, and through the dashboard port by a socket of this process's own.
The tool's offset stays at the flange, so that every pose here is the flange's.
"""

import contextlib
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from drivers.ur import paths, pipe, safety
from drivers.ur import state as ur_state
from drivers.ur.process import Alarm, Alarmed
from drivers.ur.safety import SafetyLimits
from drivers.ur.session import UrSession
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, LimitExceeded, MotionEnded, SafetyStop, TouchstoneError
from harness.basics.geometry import translation, vector_from_rotation
from harness.bench.device import ArmState, Health, Reading

ANSWER_WITHIN: Final = 2.0  # s
MOTION_SPARE: Final = 3.0  # s beyond the time a motion should take, before the child gives up
KILL_SPARE: Final = 1.5  # s beyond that, before the child is killed
SEEN_WITHIN: Final = 0.3  # s for an output or a zeroed sensor to show in the stream
SETTLED: Final = 1e-6  # rad or m; a target this close is where the arm is


class UrArm:
    """An ``Arm`` of Universal Robots.

    Args:
        address: of the controller; loopback only, see ``drivers.ur.safety.require_loopback``.
        model: ``"ur3e"``, ``"ur5e"`` or ``"ur10e"``.
        limits: what it may be asked to do.
        rate: Hz of the state stream; 500 on an e-Series.
        tool_points: m in the flange's frame, the points that the workspace and speed limits are for.
        lock_folder: where the lock file lies; None for the computer's temporary folder.
        command: what to run as the child process; None for ``drivers.ur.child``.
        alarm: why a motion must end, empty while all is well. It ends a motion that began without one, and
            no search for contact begins under one; other motions may, so that the arm can back away.
    """

    def __init__(
        self,
        address: str,
        model: str,
        limits: SafetyLimits,
        rate: float = 500.0,
        tool_points: Sequence[Sequence[float]] = ((0.0, 0.0, 0.0),),
        lock_folder: Path | None = None,
        command: Sequence[str] | None = None,
        alarm: Alarm = lambda: "",
    ) -> None:
        self.address = address
        self.model = model
        self.limits = limits
        self.rate = rate
        self._points = np.asarray(tool_points, dtype=np.float64).reshape(-1, 3)
        self._lock_folder = lock_folder
        child = [sys.executable, "-P", "-m", "drivers.ur.child", "--address", address, "--model", model]
        self._command = command or [*child, "--rate", f"{rate:g}", "--patience", f"{limits.patience:g}"]
        self._alarm = alarm
        self._session: UrSession | None = None
        self._contact: FloatArray | None = None
        self._busy = threading.Lock()

    def open(self) -> None:
        """Connect; raises ``BenchFault`` naming the cable or the switch to look at.

        Raises:
            WrongUse: the address is not a loopback address.
            SafetyStop: what answers there is no mock.
            ProtectiveStop: the controller has stopped the arm.
        """
        if self._session is not None:
            return
        self._contact = None
        self._session = UrSession(
            self.address, self._command, self.rate, self._lock_folder, self.limits.patience
        )
        try:
            ur_state.require_model(self.model, self.address, self.state())
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Stop, disconnect, release."""
        session, self._session = self._session, None
        if session is not None:
            session.close()

    def state(self) -> ArmState:
        """The newest state; raises ``BenchFault`` where it is stale."""
        return ur_state.arm_state(self._opened().packet())

    def history(self, seconds: float) -> tuple[Reading, ...]:
        """Every packet of the last ``seconds`` (up to 60): joints, poses, wrenches, controller's clock."""
        return ur_state.readings(self._opened().process.since(now() - seconds), self.rate)

    def health(self) -> Health:
        """Rate and drops since opening; the latency is unknown, for the controller's clock is its own."""
        session = self._opened()
        packet, first, count = session.packet(), session.process.first, session.process.count
        elapsed = 0.0 if first is None else float(packet[0] - first[0])
        model, serial, version = session.controller
        return Health(
            name="arm",
            identity=f"{model} serial {serial}, PolyScope {version}",
            rate=(count - 1) / elapsed if elapsed > 0.0 else 0.0,
            drops=int(packet[pipe.FIELDS["drops"]][0]),
            latency=None,
            detail=ur_state.detail(packet),
        )

    def move_joints(self, joints: FloatArray, speed: float, acceleration: float) -> None:
        """Move to ``(6,)`` rad at rad/s and rad/s^2 of the leading joint; returns at rest.

        Raises:
            LimitExceeded: outside the limits; nothing was sent.
            SafetyStop: stopped by force or by request.
            ProtectiveStop: the controller stopped the arm.
            MotionEnded: there was an alarm; the arm is stopped and may move away.
            BenchFault: the controller or the link failed; the arm is stopped.
        """
        what = "the joint motion"
        target = safety.vector(what, joints, 6)
        safety.within(f"{what}, speed", speed, self.limits.joint_speed, "rad/s", "ask for less")
        cap = self.limits.joint_acceleration
        safety.within(f"{what}, acceleration", acceleration, cap, "rad/s^2", "ask for less")
        with self._motion() as (session, epoch):
            present = self.state().joints
            path = paths.joint_path(self.model, self._points, present, target, speed, acceleration)
            safety.check_path(self.limits, path, self._contact, what)
            distance = float(np.abs(target - present).max())
            if distance > SETTLED:
                seconds = safety.trapezoid_seconds(distance, speed, acceleration)
                details = {"joints": target.tolist(), "speed": speed, "acceleration": acceleration}
                self._perform(session, epoch, what, seconds, details)

    def move_line(self, base_from_flange: FloatArray, speed: float, acceleration: float) -> None:
        """Move the flange in a straight line at m/s and m/s^2; returns at rest.

        Raises: as ``move_joints``.
        """
        target = safety.pose("the straight line", base_from_flange)
        with self._motion() as (session, epoch):
            self._line(session, epoch, "the straight line", target, speed, acceleration, {})

    def move_until_contact(self, direction: FloatArray, speed: float, force: float, travel: float) -> bool:
        """Move along a unit direction in base until ``force`` N resist; False after ``travel`` m without.

        The force counts along the direction, in either sense; where it resists already, nothing
        moves. ``drivers.ur.motion`` says why ur_rtde's own search is not used.

        Raises: as ``move_joints``.
        """
        what, limits = "the search for contact", self.limits
        axis = safety.unit_vector(f"{what}, direction", direction)
        safety.within(f"{what}, force", force, limits.force_press, "N", "ask for a lighter touch")
        safety.within(f"{what}, travel", travel, limits.travel, "m", "approach closer first")
        safety.within(f"{what}, speed", speed, limits.speed_near, "m/s", "search more slowly")
        if reason := self._alarm():
            raise MotionEnded(f"{what} was not begun: {reason}")
        with self._motion() as (session, epoch):
            state = self.state()
            touched = abs(float(state.wrench[:3] @ axis)) >= force
            if not touched:
                target = translation(travel * axis) @ state.base_from_flange
                seek = {"contact": force, "direction": axis.tolist()}
                touched = self._line(session, epoch, what, target, speed, limits.acceleration, seek)
            if touched:
                self._contact = self.state().base_from_flange[:3, 3]
            return touched

    def zero_force(self) -> None:
        """Take the present reading of the force sensor as zero; only at rest and out of contact.

        Raises:
            SafetyStop: the flange is still within half of ``limits.near`` of the last contact.
            BenchFault: the arm moves, something pulls at the tool, or this computer is too busy to see.
        """
        with self._motion() as (session, _):
            self._require_clear()
            session.ask({"do": "zero_force"}, ANSWER_WITHIN)
            limit = self.limits.force_press / 2
            if not session.comes_true(lambda packet: ur_state.force(packet) < limit, SEEN_WITHIN):
                raise ur_state.not_zeroed(session.packet(), limit, SEEN_WITHIN)

    def set_digital_output(self, index: int, on: bool) -> None:
        """Switch a tool digital output (0 or 1), and see it switched; off in any state.

        Raises:
            LimitExceeded: there is no such output.
            BenchFault: the controller did not switch it.
            TouchstoneError: what latched the arm, where it is to be switched on.
        """
        if index not in (0, 1):
            raise LimitExceeded(f"tool digital output {index} was asked; the tool has outputs 0 and 1")
        session = self._opened()
        session.ask({"do": "tool_output", "index": index, "on": on}, ANSWER_WITHIN, though_latched=not on)
        bit = 1 << (ur_state.TOOL_OUTPUT_BIT + index)
        if not session.comes_true(
            lambda p: bool(int(p[pipe.FIELDS["output_bits"]][0]) & bit) == on, SEEN_WITHIN
        ):
            raise BenchFault(
                f"tool digital output {index} did not switch {'on' if on else 'off'}; check the tool's "
                "supply voltage in the pendant's installation, and that no fieldbus owns the outputs"
            )

    def stop(self) -> None:
        """Stop now, from any thread and in any state; no motion asked for before begins after.

        Takes no lock, so a signal handler may call it. Returns at rest.
        """
        session = self._session
        if session is not None:
            session.stop()

    def _line(
        self,
        session: UrSession,
        epoch: int,
        what: str,
        target: FloatArray,
        speed: float,
        acceleration: float,
        seek: pipe.Message,
    ) -> bool:
        """Check and perform a straight line; what the child says at its end."""
        safety.within(f"{what}, speed", speed, self.limits.speed, "m/s", "ask for less")
        cap = self.limits.acceleration
        safety.within(f"{what}, acceleration", acceleration, cap, "m/s^2", "ask for less")
        state = self.state()
        start = state.base_from_flange
        path = paths.line_path(self.model, self._points, state.joints, start, target, speed, acceleration)
        safety.check_path(self.limits, path, self._contact, what)
        length = float(np.linalg.norm(target[:3, 3] - start[:3, 3]))
        turn = float(np.linalg.norm(vector_from_rotation(start[:3, :3].T @ target[:3, :3])))
        if max(length, turn) <= SETTLED:
            return True
        seconds = safety.trapezoid_seconds(max(length, turn), speed, acceleration)
        # UR's pose: x, y, z in m and a rotation vector in rad.
        pose = [*target[:3, 3].tolist(), *vector_from_rotation(target[:3, :3]).tolist()]
        near = state.joints.tolist()
        details = {"pose": pose, "near": near, "speed": speed, "acceleration": acceleration, **seek}
        return self._perform(session, epoch, what, seconds, details)

    def _perform(
        self, session: UrSession, epoch: int, what: str, seconds: float, details: pipe.Message
    ) -> bool:
        """Have the child perform a checked motion; stops the arm if the waiting is interrupted."""
        allowed = 1.5 * seconds + MOTION_SPARE
        limits = {"force_press": self.limits.force_press, "force_any": self.limits.force_any}
        message = {"do": "move", "what": what, "epoch": epoch, "seconds": allowed, **limits, **details}
        alarm = None if self._alarm() else self._alarm
        try:
            arrived = bool(session.ask(message, allowed + KILL_SPARE, beat=True, alarm=alarm))
            session.comes_true(lambda packet: not packet[pipe.FIELDS["moving"]][0], SEEN_WITHIN)
        except TouchstoneError:
            raise
        except Alarmed as reason:
            session.stop()
            raise MotionEnded(f"{what} was stopped: {reason}") from reason
        except BaseException:
            session.stop()
            raise
        return arrived

    @contextlib.contextmanager
    def _motion(self) -> Iterator[tuple[UrSession, int]]:
        """One motion at a time, none after a latched stop; yields the session and its count of stops."""
        session = self._opened()
        epoch = session.epoch
        session.require_unlatched()
        if not self._busy.acquire(blocking=False):
            raise BenchFault("the arm was asked to move during a motion; wait for it to end")
        try:
            yield session, epoch
        finally:
            self._busy.release()

    def _opened(self) -> UrSession:
        if self._session is None:
            raise BenchFault(f"the arm at {self.address} is not open")
        return self._session

    def _require_clear(self) -> None:
        """Out of contact, as far as the last contact tells."""
        if self._contact is None:
            return
        clear = self.limits.near / 2
        away = float(np.linalg.norm(self.state().base_from_flange[:3, 3] - self._contact))
        if away < clear:
            raise SafetyStop(
                f"zero the force sensor: the flange is {1e3 * away:.1f} mm from the last contact; it must be "
                f"{1e3 * clear:g} mm or more: retreat first, or the force of the contact would become zero"
            )
