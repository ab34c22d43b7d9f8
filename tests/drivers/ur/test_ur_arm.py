"""The parent's promises when its child process hangs, crashes, goes deaf or dies."""

import contextlib
import itertools
import json
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.ur import arm as ur_arm
from drivers.ur import paths
from drivers.ur import session as ur_session
from drivers.ur.arm import UrArm
from drivers.ur.safety import SafetyLimits
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, LimitExceeded, ProtectiveStop, SafetyStop, WrongUse
from harness.basics.geometry import translation
from harness.bench import kinematics
from harness.bench.device import Arm

READY = np.array([0.0, -1.4, 1.7, -1.87, -1.57, 0.0])
LIMITS = SafetyLimits(workspace_low=(-0.9, -0.6, 0.02), workspace_high=(-0.1, 0.6, 0.9))
NUMBERS = itertools.count(1)


class FarEnd:
    """The four ports of a controller, of which only the dashboard answers."""

    def __init__(self) -> None:
        self.address = f"127.{60 + os.getpid() % 60}.{os.getpid() // 60 % 250}.{next(NUMBERS)}"
        self.heard: list[str] = []
        self.dashboard_answers = True
        self._ports = [socket.create_server((self.address, port)) for port in (30004, 29999, 30003, 30011)]
        threading.Thread(target=self._serve, args=(self._ports[1],), daemon=True).start()

    def _serve(self, listener: socket.socket) -> None:
        while True:
            try:
                link, _ = listener.accept()
            except OSError:
                return
            with contextlib.suppress(OSError), link, link.makefile("rwb") as lines:
                lines.write(b"Connected: Universal Robots Dashboard Server\n")
                lines.flush()
                command = lines.readline().decode().strip()
                if command == "get serial number":
                    lines.write(b"00005500001\n")
                elif command:
                    self.heard.append(command)
                    lines.write(b"Stopped\n")

    def close(self) -> None:
        for port in self._ports:
            port.shutdown(socket.SHUT_RDWR)
            port.close()


@pytest.fixture
def far_end() -> Iterator[FarEnd]:
    end = FarEnd()
    yield end
    end.close()


MakeArm = Callable[[str], UrArm]


@pytest.fixture
def make_arm(far_end: FarEnd, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[MakeArm]:
    """Arms whose child is the fake one, with short patience."""
    monkeypatch.setattr(ur_arm, "MOTION_SPARE", 0.1)
    monkeypatch.setattr(ur_arm, "KILL_SPARE", 0.2)
    monkeypatch.setattr(ur_session, "OPEN_WITHIN", 1.5)
    monkeypatch.setattr(ur_session, "CLOSE_WITHIN", 0.5)
    made: list[UrArm] = []

    def make(mode: str) -> UrArm:
        fake = Path(__file__).with_name("fake_ur_child.py")
        command = [sys.executable, str(fake), mode, str(tmp_path / "requests")]
        arm = UrArm(far_end.address, "ur5e", LIMITS, lock_folder=tmp_path, command=command)
        made.append(arm)
        return arm

    yield make
    for arm in made:
        arm.close()


def sent(tmp_path: Path) -> list[str]:
    """What the fake child was asked to do."""
    log = tmp_path / "requests"
    return [json.loads(line)["do"] for line in log.read_text().splitlines()] if log.exists() else []


def child_pid(arm: UrArm) -> int:
    assert arm._session is not None
    return arm._session.process.pid


def exists(pid: int) -> bool:
    return Path(f"/proc/{pid}").exists()


NEAR_BY: FloatArray = READY + np.array([0.05, 0, 0, 0, 0, 0])


def move(arm: UrArm) -> None:
    arm.move_joints(NEAR_BY, 0.2, 1.0)


def test_it_is_an_arm(make_arm: MakeArm) -> None:
    arm: Arm = make_arm("good")
    arm.open()
    arm.open()
    assert np.abs(arm.state().base_from_flange - kinematics.forward("ur5e", READY)).max() < 1e-12
    arm.move_joints(NEAR_BY, 0.2, 1.0)
    arm.close()
    arm.close()


def test_history_holds_what_arrived(make_arm: MakeArm) -> None:
    arm = make_arm("good")
    arm.open()
    time.sleep(0.2)
    joints, poses, wrench, clock = arm.history(10.0)
    assert [r.channel.name for r in (joints, poses, wrench, clock)] == [
        "arm.joints",
        "arm.base_from_flange",
        "arm.wrench",
        "arm.controller_time",
    ]
    assert len(joints.times) >= 5
    assert np.all(np.diff(joints.times) > 0)
    expected = kinematics.forward("ur5e", READY)
    assert np.abs(poses.values[:, :3] - expected[:3, 3]).max() < 1e-12
    assert np.abs(np.linalg.norm(poses.values[:, 3:], axis=1) - 1).max() < 1e-12
    assert len(arm.history(0.0)[0].times) <= 1


def test_a_hung_child_is_killed_and_the_arm_stopped_through_its_dashboard(
    make_arm: MakeArm, far_end: FarEnd
) -> None:
    arm = make_arm("hang")
    arm.open()
    pid = child_pid(arm)
    with pytest.raises(BenchFault, match=r"answer .*1\.0 s"):
        move(arm)
    assert "stop" in far_end.heard
    assert not exists(pid)
    with pytest.raises(BenchFault, match="dashboard"):
        move(arm)


def test_a_crashed_child_stops_the_arm_and_its_last_words_are_told(
    make_arm: MakeArm, far_end: FarEnd
) -> None:
    arm = make_arm("crash")
    arm.open()
    with pytest.raises(BenchFault, match="invalid pointer"):
        move(arm)
    assert far_end.heard == ["stop"]


def test_a_child_killed_during_a_motion_stops_the_arm(make_arm: MakeArm, far_end: FarEnd) -> None:
    arm = make_arm("hang")
    arm.open()
    threading.Timer(0.1, os.kill, (child_pid(arm), signal.SIGKILL)).start()
    with pytest.raises(BenchFault, match=r"process .*(dashboard|watchdog)"):
        move(arm)
    assert far_end.heard == ["stop"]


def test_last_words_are_told_of_a_child_found_dead_by_writing_to_it(
    make_arm: MakeArm, far_end: FarEnd
) -> None:
    # Whichever is noticed first, the end of what it says or the pipe that nobody reads.
    arm = make_arm("shut")
    arm.open()
    with pytest.raises(BenchFault, match="invalid pointer"):
        move(arm)
    assert far_end.heard == ["stop"]


def test_reopening_after_a_fault_gives_a_working_arm(make_arm: MakeArm) -> None:
    arm = make_arm("good")
    arm.open()
    os.kill(child_pid(arm), signal.SIGKILL)
    with pytest.raises(BenchFault):
        move(arm)
    arm.close()
    arm.open()
    move(arm)


def test_a_stop_ends_a_motion_from_another_thread(make_arm: MakeArm, far_end: FarEnd) -> None:
    arm = make_arm("hang")
    arm.open()
    stopper = threading.Timer(0.1, arm.stop)
    stopper.start()
    with pytest.raises(SafetyStop, match="request"):
        move(arm)
    stopper.join()
    assert far_end.heard == []


@pytest.mark.parametrize("mode", ["deaf", "no stop"])
def test_a_stop_that_is_not_acknowledged_goes_through_the_dashboard(
    make_arm: MakeArm, far_end: FarEnd, mode: str
) -> None:
    arm = make_arm(mode)
    arm.open()
    began = time.monotonic()
    arm.stop()
    assert far_end.heard == ["stop"]
    assert time.monotonic() - began < 1.0
    with pytest.raises(BenchFault, match="dashboard"):
        move(arm)


def test_stop_works_in_a_signal_handler_during_a_motion(make_arm: MakeArm) -> None:
    arm = make_arm("hang")
    arm.open()
    previous = signal.signal(signal.SIGUSR1, lambda *_: arm.stop())
    try:
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGUSR1)).start()
        with pytest.raises(SafetyStop):
            move(arm)
    finally:
        signal.signal(signal.SIGUSR1, previous)


def test_an_interrupt_during_a_motion_stops_the_arm(make_arm: MakeArm, tmp_path: Path) -> None:
    arm = make_arm("hang")
    arm.open()
    # A program started in the background inherits interrupts that are ignored.
    previous = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            move(arm)
    finally:
        signal.signal(signal.SIGINT, previous)
    assert sent(tmp_path) == ["move", "stop"]


def test_one_motion_at_a_time(make_arm: MakeArm) -> None:
    arm = make_arm("hang")
    arm.open()
    outcome: list[Exception] = []

    def move_and_tell() -> None:
        try:
            move(arm)
        except SafetyStop as error:
            outcome.append(error)

    first = threading.Thread(target=move_and_tell)
    first.start()
    time.sleep(0.1)
    with pytest.raises(BenchFault, match="motion"):
        move(arm)
    arm.stop()
    first.join()
    assert len(outcome) == 1


def test_a_protective_stop_is_latched(make_arm: MakeArm, tmp_path: Path) -> None:
    arm = make_arm("pstop")
    arm.open()
    for _ in range(3):
        with pytest.raises(ProtectiveStop, match=r"\(1, 2, 3\) mm"):
            move(arm)
    assert sent(tmp_path) == ["move"]


def test_stale_state_is_a_fault(make_arm: MakeArm) -> None:
    arm = make_arm("stale")
    arm.open()
    arm.state()
    time.sleep(0.9)
    with pytest.raises(BenchFault, match="cable"):
        arm.state()
    with pytest.raises(BenchFault, match="cable"):
        move(arm)


def test_stale_state_latches_though_it_comes_again(make_arm: MakeArm, tmp_path: Path) -> None:
    """A child that was frozen and goes on does not move as though nothing had been."""
    arm = make_arm("hiccup")
    arm.open()
    time.sleep(0.9)
    with pytest.raises(BenchFault, match=r"\d s "):
        arm.state()
    time.sleep(0.4)
    assert not arm.state().moving
    with pytest.raises(BenchFault, match=r"\d s "):
        move(arm)
    assert sent(tmp_path) == []


@pytest.mark.parametrize(("mode", "words"), [("mute", "1.5 s"), ("refuse", "remote control")])
def test_a_child_that_does_not_open_leaves_no_process_and_no_lock(
    make_arm: MakeArm, mode: str, words: str
) -> None:
    arm = make_arm(mode)
    for _ in range(2):
        with pytest.raises(BenchFault, match=words):
            arm.open()


def test_two_programs_cannot_own_one_arm(make_arm: MakeArm) -> None:
    first, second = make_arm("good"), make_arm("good")
    first.open()
    with pytest.raises(BenchFault, match=f"process {os.getpid()}"):
        second.open()
    first.close()
    second.open()


def test_nobody_at_the_address_names_the_cable(tmp_path: Path) -> None:
    arm = UrArm("127.99.99.99", "ur5e", LIMITS, lock_folder=tmp_path)
    with pytest.raises(BenchFault, match="cable"):
        arm.open()


def test_an_address_outside_this_computer_is_refused_before_anything_is_sent(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="real arm"):
        UrArm("192.168.1.10", "ur5e", LIMITS, lock_folder=tmp_path).open()
    assert list(tmp_path.iterdir()) == []


def test_another_model_than_the_station_says_is_noticed(make_arm: MakeArm) -> None:
    arm = make_arm("good")
    arm.model = "ur10e"
    with pytest.raises(BenchFault, match="ur10e"):
        arm.open()


DOWN: FloatArray = np.array([0.0, 0.0, -1.0])
WRIST: FloatArray = READY + 0.002 * np.eye(6)[5]
"""rad; so near that no speed is reached, about an axis through the flange: only the request is too fast."""
REACH: float = float(np.hypot(*kinematics.forward("ur5e", READY)[:2, 3]))
"""m from the first joint's axis."""

BEYOND: dict[str, Callable[[UrArm], object]] = {
    "five joints": lambda arm: arm.move_joints(READY[:5], 0.2, 1.0),
    "not finite": lambda arm: arm.move_joints(READY * np.nan, 0.2, 1.0),
    "joint speed": lambda arm: arm.move_joints(WRIST, 1.05 * LIMITS.joint_speed, 1.0),
    "joint acceleration": lambda arm: arm.move_joints(WRIST, 0.2, 1.05 * LIMITS.joint_acceleration),
    "joint step": lambda arm: arm.move_joints(READY + 1.05 * LIMITS.joint_step * np.eye(6)[5], 0.1, 1.0),
    "no speed": lambda arm: arm.move_joints(NEAR_BY, 0.0, 1.0),
    "tool speed": lambda arm: arm.move_joints(READY + 0.4 * np.eye(6)[0], 1.05 * LIMITS.speed / REACH, 2.0),
    "joint range": lambda arm: arm.move_joints(READY + 7.0 * np.eye(6)[5], 0.1, 1.0),
    "line speed": lambda arm: arm.move_line(here(arm), 1.05 * LIMITS.speed, 1.0),
    "line acceleration": lambda arm: arm.move_line(here(arm), 0.1, 1.05 * LIMITS.acceleration),
    "below the table": lambda arm: arm.move_line(translation(np.array([0, 0, -0.6])) @ here(arm), 0.1, 1.0),
    "out of reach": lambda arm: arm.move_line(translation(np.array([-0.8, 0, 0])) @ here(arm), 0.1, 1.0),
    "not rigid": lambda arm: arm.move_line(2 * here(arm), 0.1, 1.0),
    "contact speed": lambda arm: arm.move_until_contact(DOWN, 1.05 * LIMITS.speed_near, 3.0, 0.05),
    "contact force": lambda arm: arm.move_until_contact(DOWN, 0.01, 1.05 * LIMITS.force_press, 0.05),
    "contact travel": lambda arm: arm.move_until_contact(DOWN, 0.01, 3.0, 1.05 * LIMITS.travel),
    "contact direction": lambda arm: arm.move_until_contact(2 * DOWN, 0.01, 3.0, 0.05),
    "output": lambda arm: arm.set_digital_output(2, True),
}


def here(arm: UrArm) -> FloatArray:
    return arm.state().base_from_flange


def test_nothing_beyond_the_limits_is_sent(make_arm: MakeArm, tmp_path: Path) -> None:
    arm = make_arm("good")
    arm.open()
    for ask in BEYOND.values():
        with pytest.raises(LimitExceeded):
            ask(arm)
    assert sent(tmp_path) == []


def test_a_stop_while_a_motion_is_planned_is_later_than_the_motion(
    make_arm: MakeArm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The request carries the count of stops at its beginning; the child begins none of before a stop."""
    arm = make_arm("good")
    arm.open()
    planned = paths.joint_path

    def interrupted(*arguments: Any) -> paths.Path:
        arm.stop()
        return planned(*arguments)

    monkeypatch.setattr(paths, "joint_path", interrupted)
    move(arm)
    lines = (tmp_path / "requests").read_text().splitlines()
    epochs = {request["do"]: request["epoch"] for request in map(json.loads, lines)}
    assert epochs["move"] < epochs["stop"]


def test_a_target_where_the_arm_is_sends_nothing(make_arm: MakeArm, tmp_path: Path) -> None:
    arm = make_arm("good")
    arm.open()
    arm.move_joints(READY, 0.2, 1.0)
    arm.move_line(here(arm), 0.1, 1.0)
    assert sent(tmp_path) == []


def test_a_search_that_begins_in_contact_ends_there(make_arm: MakeArm, tmp_path: Path) -> None:
    arm = make_arm("pulled")
    arm.open()
    assert arm.move_until_contact(DOWN, 0.01, 5.0, 0.05)
    assert sent(tmp_path) == []
    with pytest.raises(SafetyStop, match=r" mm .* mm"):
        arm.zero_force()
    with pytest.raises(LimitExceeded, match=r"0\.0500 m/s"):
        arm.move_line(translation(np.array([0, 0, 0.05])) @ here(arm), 0.1, 1.0)


def test_a_sensor_that_does_not_go_to_zero_is_a_fault(make_arm: MakeArm) -> None:
    arm = make_arm("pulled")
    arm.open()
    with pytest.raises(BenchFault, match=r"7\.0 N"):
        arm.zero_force()


def test_a_busy_computer_that_sees_no_state_is_no_pull_at_the_tool(
    make_arm: MakeArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ur_arm, "SEEN_WITHIN", 0.1)
    arm = make_arm("stale")
    arm.open()
    time.sleep(0.25)
    with pytest.raises(BenchFault, match=r"force sensor.*0\.1 s"):
        arm.zero_force()
