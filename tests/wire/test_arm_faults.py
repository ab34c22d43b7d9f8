"""What an operator sees when the arm, its controller, its process or its program fails."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.ur import dashboard
from drivers.ur.arm import UrArm
from harness.basics.errors import BenchFault, ProtectiveStop, SafetyStop
from harness.basics.geometry import translation
from tests.support.arm_bench import (
    DOWN,
    FAR,
    FLOOR,
    READY,
    FarEnd,
    InFlight,
    child_pid,
    comes_to_rest,
    make_arm,
)


@pytest.fixture
def far_end() -> Iterator[FarEnd]:
    end = FarEnd()
    yield end
    end.close()


@pytest.fixture
def arm(far_end: FarEnd, tmp_path: Path) -> Iterator[UrArm]:
    arm = make_arm(far_end.address, tmp_path)
    arm.open()
    yield arm
    arm.close()


@pytest.fixture
def patient_arm(far_end: FarEnd, tmp_path: Path) -> Iterator[UrArm]:
    """An arm whose watchdog waits as long as a mocked station's: this computer's delays are no fault here."""
    arm = make_arm(far_end.address, tmp_path, patience=0.5)
    arm.open()
    yield arm
    arm.close()


def environment() -> dict[str, str]:
    """For a program of its own that drives the arm with what the tests are made of."""
    return {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])}


def gone(pid: int, within: float = 60.0) -> bool:
    end = time.monotonic() + within
    while Path(f"/proc/{pid}").exists() and time.monotonic() < end:
        time.sleep(0.02)
    return not Path(f"/proc/{pid}").exists()


def test_a_protective_stop_is_seen_latched_and_never_resumed(patient_arm: UrArm, far_end: FarEnd) -> None:
    arm = patient_arm
    motion = InFlight(arm)
    far_end.cue("protective_stop")
    error = motion.join()
    assert isinstance(error, ProtectiveStop)
    assert "joint motion" in str(error)
    assert arm.state().safety == "protective stop"
    assert comes_to_rest(far_end, 1.0, FAR)
    with pytest.raises(ProtectiveStop):
        arm.move_joints(READY, 0.1, 1.0)
    with pytest.raises(ProtectiveStop):
        arm.zero_force()
    arm.close()
    with pytest.raises(ProtectiveStop, match=far_end.address):
        arm.open()


def test_a_protective_stop_that_is_released_at_the_pendant_resumes_nothing(
    patient_arm: UrArm, far_end: FarEnd
) -> None:
    """The release is under this driver's hands: it stays open, and its program must be gone by then."""
    motion = InFlight(patient_arm)
    far_end.cue("protective_stop")
    assert isinstance(motion.join(), ProtectiveStop)
    assert comes_to_rest(far_end, 1.0, FAR)
    resting = far_end.joints()
    while far_end.ask("unlock protective stop") != "Protective stop releasing":
        time.sleep(0.1)
    assert far_end.ask("play") == "Failed to execute: play"
    assert far_end.ask("running") == "Program running: false"
    time.sleep(0.3)
    assert np.array_equal(far_end.joints(), resting)
    with pytest.raises(ProtectiveStop):
        patient_arm.move_joints(READY, 0.1, 1.0)


def test_a_protective_stop_at_rest_is_latched_too(patient_arm: UrArm, far_end: FarEnd) -> None:
    """What is at the tool is not switched on either, and still off."""
    arm = patient_arm
    before = far_end.outputs()
    arm.set_digital_output(0, True)
    far_end.cue("protective_stop")
    while arm.state().safety == "normal":
        time.sleep(0.01)
    time.sleep(0.1)
    with pytest.raises(ProtectiveStop):
        arm.move_joints(FAR, 0.1, 1.0)
    with pytest.raises(ProtectiveStop):
        arm.set_digital_output(1, True)
    assert far_end.outputs() == before | 1 << 16
    arm.set_digital_output(0, False)
    assert far_end.outputs() == before


def test_killing_the_child_in_flight_stops_the_arm(arm: UrArm, far_end: FarEnd) -> None:
    pid = child_pid(arm)
    motion = InFlight(arm)
    os.kill(pid, signal.SIGKILL)
    error = motion.join()
    assert isinstance(error, BenchFault)
    assert far_end.address in str(error)
    assert comes_to_rest(far_end, 1.0, FAR)
    assert gone(pid)
    arm.close()
    arm.open()
    arm.move_joints(READY, 0.3, 1.5)


def test_the_watchdog_alone_stops_the_arm_of_a_frozen_child(
    arm: UrArm, far_end: FarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dashboard, "stop", lambda _: True)
    pid = child_pid(arm)
    motion = InFlight(arm)
    os.kill(pid, signal.SIGSTOP)
    assert comes_to_rest(far_end, 1.0, FAR)
    os.kill(pid, signal.SIGKILL)
    assert isinstance(motion.join(), BenchFault)


def test_a_stop_while_the_child_is_frozen_goes_through_the_dashboard(arm: UrArm, far_end: FarEnd) -> None:
    pid = child_pid(arm)
    motion = InFlight(arm)
    os.kill(pid, signal.SIGSTOP)
    began = time.monotonic()
    arm.stop()
    assert time.monotonic() - began < 0.5
    assert comes_to_rest(far_end, 0.5, FAR)
    os.kill(pid, signal.SIGKILL)
    assert isinstance(motion.join(), BenchFault)
    with pytest.raises(BenchFault, match=far_end.address):
        arm.move_joints(READY, 0.1, 1.0)


def test_killing_the_program_in_flight_stops_the_arm_and_leaves_no_process(
    far_end: FarEnd, tmp_path: Path
) -> None:
    program = (
        "import sys; from pathlib import Path; from tests.support.arm_bench import FAR, make_arm, child_pid\n"
        "arm = make_arm(sys.argv[1], Path(sys.argv[2])); arm.open()\n"
        "sys.stdout.write(f'{child_pid(arm)}\\n'); sys.stdout.flush()\n"
        "arm.move_joints(FAR, 0.3, 1.5)"
    )
    command = [sys.executable, "-c", program, far_end.address, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment()) as running:
        assert running.stdout is not None
        pid = int(running.stdout.readline())
        before = far_end.joints()
        while np.abs(far_end.joints() - before).max() < 0.02:
            time.sleep(0.01)
        running.kill()
    assert comes_to_rest(far_end, 1.0, FAR)
    assert gone(pid)
    arm = make_arm(far_end.address, tmp_path)
    arm.open()
    arm.close()


def test_a_dropped_connection_in_flight_is_a_fault(arm: UrArm, far_end: FarEnd) -> None:
    pid = child_pid(arm)
    motion = InFlight(arm)
    far_end.cue("drop", 1.0)
    error = motion.join()
    assert isinstance(error, BenchFault)
    assert "cable" in str(error)
    assert comes_to_rest(far_end, 1.0, FAR)
    assert gone(pid)


def test_a_frozen_stream_in_flight_is_a_fault(arm: UrArm, far_end: FarEnd) -> None:
    motion = InFlight(arm)
    far_end.cue("freeze", 3.0)
    error = motion.join()
    assert isinstance(error, BenchFault)
    assert "cable" in str(error)


def test_beyond_the_hard_limit_the_arm_stays_stopped(far_end: FarEnd, tmp_path: Path) -> None:
    arm = make_arm(far_end.address, tmp_path, patience=0.5, force_press=4.0, force_any=5.0)
    arm.open()
    here = arm.state().base_from_flange
    arm.move_line(translation(np.array([0, 0, FLOOR + 0.005 - here[2, 3]])) @ here, 0.2, 1.2)
    arm.zero_force()
    with pytest.raises(SafetyStop, match=r" N.*\b5 N"):
        arm.move_line(translation(0.02 * DOWN) @ arm.state().base_from_flange, 0.2, 1.5)
    with pytest.raises(SafetyStop, match=r" N.*\b5 N"):
        arm.move_line(translation(-0.01 * DOWN) @ arm.state().base_from_flange, 0.05, 1.0)
    arm.close()


@pytest.mark.parametrize(("command", "done"), [("stop", "stopped"), ("pause", "paused")])
def test_a_program_ended_at_the_pendant_is_named_latches_and_is_not_taken_up_again(
    patient_arm: UrArm, far_end: FarEnd, command: str, done: str
) -> None:
    arm = patient_arm
    motion = InFlight(arm)
    far_end.ask(command)
    error = motion.join()
    assert isinstance(error, BenchFault)
    assert f"program {done}" in str(error)
    assert comes_to_rest(far_end, 1.0, FAR)
    assert far_end.ask("play") == "Failed to execute: play"
    resting = far_end.joints()
    with pytest.raises(BenchFault, match=done):
        arm.move_joints(READY, 0.2, 1.5)
    assert np.array_equal(far_end.joints(), resting)


@pytest.mark.parametrize(("command", "done"), [("stop", "stopped"), ("pause", "paused")])
def test_a_program_ended_at_the_pendant_at_rest_latches_too(
    arm: UrArm, far_end: FarEnd, command: str, done: str
) -> None:
    far_end.ask(command)
    time.sleep(0.3)
    assert far_end.ask("play") == "Failed to execute: play"
    with pytest.raises(BenchFault, match=done):
        arm.move_joints(FAR, 0.1, 1.0)


def test_no_process_is_left_after_closing(arm: UrArm) -> None:
    pid = child_pid(arm)
    arm.close()
    assert gone(pid, 5.0)


def freeze(pid: int, seconds: float) -> None:
    os.kill(pid, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(pid, signal.SIGCONT)


def test_a_delay_at_rest_that_wakes_the_watchdog_is_mended_and_told(arm: UrArm) -> None:
    freeze(child_pid(arm), 0.25)
    time.sleep(0.6)
    arm.move_joints(READY + 0.02, 0.2, 1.5)
    assert "restarted 1 times" in arm.health().detail


def test_a_delay_in_flight_fails_the_motion_and_latches(arm: UrArm, far_end: FarEnd) -> None:
    motion = InFlight(arm)
    freeze(child_pid(arm), 0.25)
    error = motion.join()
    assert isinstance(error, BenchFault)
    assert "watchdog" in str(error)
    assert comes_to_rest(far_end, 1.0, FAR)
    time.sleep(0.6)
    resting = far_end.joints()
    with pytest.raises(BenchFault, match=r"watchdog.* ms"):
        arm.move_joints(READY, 0.2, 1.5)
    assert np.array_equal(far_end.joints(), resting)
    arm.close()
    arm.open()
    arm.move_joints(READY, 0.2, 1.5)


FROZEN = """
import sys
from pathlib import Path
from drivers.ur.arm import UrArm
from harness.basics.errors import TouchstoneError
from tests.support.arm_bench import FAR, READY, make_arm

arm = make_arm(sys.argv[1], Path(sys.argv[2]))
arm.open()
for target in (FAR, READY):
    try:
        arm.move_joints(target, 0.3, 1.5)
    except TouchstoneError as error:
        print(f"{type(error).__name__}: {error}", flush=True)
arm.close()
"""


def test_a_frozen_program_stops_its_motion_and_may_not_move_again(far_end: FarEnd, tmp_path: Path) -> None:
    command = [sys.executable, "-c", FROZEN, far_end.address, str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=environment()) as running:
        assert running.stdout is not None
        before = far_end.joints()
        while np.abs(far_end.joints() - before).max() < 0.02:
            time.sleep(0.01)
        running.send_signal(signal.SIGSTOP)
        stopped = comes_to_rest(far_end, 1.5, FAR)
        resting = far_end.joints()
        running.send_signal(signal.SIGCONT)
        first, second = (line.decode() for line in running.stdout)
    assert stopped, "while the program was frozen"
    assert "BenchFault" in first
    assert " ms" in first
    assert second == first
    assert np.array_equal(far_end.joints(), resting)
