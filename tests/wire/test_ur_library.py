"""The real ur_rtde against the mocked controller: streams, moves, kinematics, programs."""

import math
import threading
import time
from typing import Any

import numpy as np
import pytest
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from tests.support.ur_process import HOME, TURN, UrProcess, wait_until

UNREACHABLE = [3.0, 0.0, 0.5, 0.0, 0.0, 0.0]


pytestmark = pytest.mark.usefixtures("at_home")


def _stamps(interface: Any, seconds: float) -> np.ndarray[Any, Any]:
    found = [interface.getTimestamp()]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        newest = interface.getTimestamp()
        if newest != found[-1]:
            found.append(newest)
        time.sleep(0.0002)
    return np.array(found)


@pytest.mark.parametrize(("rate", "seconds"), [(125.0, 1.5), (500.0, 3.0)])
def test_the_stream_keeps_its_rate(mock: UrProcess, rate: float, seconds: float) -> None:
    interface = RTDEReceiveInterface(mock.host, rate, ["timestamp", "actual_q"])
    start = time.monotonic()
    stamps = _stamps(interface, seconds)
    elapsed = time.monotonic() - start
    interface.disconnect()
    steps = np.diff(stamps) * rate
    # a busy machine shows two packets at once; never a stamp between the grid's
    assert np.abs(steps - np.round(steps)).max() < 1e-5
    assert 0.5 * elapsed < stamps[-1] - stamps[0] < elapsed + 0.05


def test_two_controllers_side_by_side_move_at_the_same_time(receive: Any, control: Any) -> None:
    with UrProcess() as second:
        other_receive = RTDEReceiveInterface(second.host, 125.0)
        other = RTDEControlInterface(second.host, 500.0)
        goals = HOME + 0.3 * TURN, HOME - 0.2 * TURN
        assert control.moveJ(goals[0].tolist(), 1.0, 4.0, True)
        assert other.moveJ(goals[1].tolist(), 1.0, 4.0, True)
        for interface, goal in ((receive, goals[0]), (other_receive, goals[1])):
            wait_until(lambda i=interface, g=goal: np.abs(i.getActualQ() - g).max() < 1e-6)  # type: ignore[misc]
        other.stopScript()
        other.disconnect()
        other_receive.disconnect()


def _moving_time(receive: Any, start: Any) -> float:
    """Seconds on the controller's clock from the first cycle that moves to the last."""
    wait_until(lambda: any(receive.getTargetQd()))
    begin = receive.getTimestamp()
    wait_until(lambda: not any(receive.getTargetQd()), 5.0)
    return float(receive.getTimestamp() - begin)


@pytest.mark.parametrize(
    ("turn", "speed", "acceleration", "seconds"),
    [(0.2, 1.05, 1.4, 2 * math.sqrt(0.2 / 1.4)), (1.0, 1.0, 4.0, 1.0 / 1.0 + 1.0 / 4.0)],
)
def test_a_joint_move_takes_the_time_of_its_trapezoid(
    receive: Any, control: Any, turn: float, speed: float, acceleration: float, seconds: float
) -> None:
    goal = HOME.copy()
    goal[0] += turn
    assert control.moveJ(goal.tolist(), speed, acceleration, True)
    assert _moving_time(receive, HOME) == pytest.approx(seconds, abs=0.03)
    assert np.abs(receive.getActualQ() - goal).max() < 1e-9


def test_a_line_is_straight_and_takes_the_time_of_its_trapezoid(receive: Any, control: Any) -> None:
    start = np.array(receive.getActualTCPPose())
    goal = start + np.array([0.0, 0.15, 0.0, 0.0, 0.0, 0.0])
    assert control.moveL(goal.tolist(), 0.1, 0.5, True)
    seen: list[list[float]] = []
    wait_until(lambda: any(receive.getTargetQd()))
    begin = receive.getTimestamp()
    while any(receive.getTargetQd()):
        seen.append(receive.getActualTCPPose()[:3])
        time.sleep(0.002)
    assert receive.getTimestamp() - begin == pytest.approx(0.15 / 0.1 + 0.1 / 0.5, abs=0.03)
    assert np.abs(np.array(seen)[:, [0, 2]] - start[[0, 2]]).max() < 1e-9
    assert np.abs(np.array(receive.getActualTCPPose())[:3] - goal[:3]).max() < 1e-9


def test_progress_of_an_asynchronous_move(control: Any) -> None:
    goal = HOME.copy()
    goal[5] += 0.5
    before = control.getAsyncOperationProgressEx().changeCount()
    assert control.moveJ(goal.tolist(), 1.0, 4.0, True)
    wait_until(lambda: control.getAsyncOperationProgressEx().changeCount() != before)
    assert control.getAsyncOperationProgress() >= 0
    wait_until(lambda: control.getAsyncOperationProgress() < 0)


@pytest.mark.parametrize("kind", ["joints", "line"])
def test_an_asynchronous_move_is_stopped_within_150_ms(receive: Any, control: Any, kind: str) -> None:
    if kind == "joints":
        assert control.moveJ((HOME + TURN).tolist(), 0.5, 4.0, True)
    else:
        assert control.moveL([-0.4919, 0.2, 0.5, 2.221441469, 2.221441469, 0.0], 0.1, 1.0, True)
    wait_until(lambda: max(map(abs, receive.getTargetQd())) > 0.1)
    time.sleep(0.1)
    start = receive.getTimestamp()
    control.stopJ(10.0) if kind == "joints" else control.stopL(10.0)
    wait_until(lambda: not any(receive.getTargetQd()), 1.0)
    assert receive.getTimestamp() - start <= 0.15
    assert np.abs(receive.getActualQ() - (HOME + TURN)).max() > 0.1


def test_a_blocking_line_ignores_stop_but_the_dashboard_ends_it(
    mock: UrProcess, receive: Any, control: Any
) -> None:
    pose = np.array(receive.getActualTCPPose())
    goal = pose + np.array([0.0, 0.10, 0.0, 0.0, 0.0, 0.0])
    ended = threading.Event()
    speed = 0.1

    def move() -> None:
        control.moveL(goal.tolist(), speed, 1.0)
        ended.set()

    mover = threading.Thread(target=move)
    mover.start()
    time.sleep(0.3)
    stopper = threading.Thread(target=lambda: control.stopL(10.0))
    stopper.start()
    assert ended.wait(3.0)
    stopper.join(10.0)
    mover.join(1.0)
    assert np.abs(np.array(receive.getActualTCPPose()) - goal).max() < 1e-6

    ended.clear()
    goal, speed = pose, 0.05
    mover = threading.Thread(target=move)
    mover.start()
    time.sleep(0.3)
    assert mock.ask("stop") == "Stopped"
    assert ended.wait(0.5)
    mover.join(1.0)
    assert not control.isProgramRunning()
    assert np.abs(np.array(receive.getActualTCPPose()) - pose).max() > 0.05


def test_kinematics_agree_with_the_stream(receive: Any, control: Any) -> None:
    joints = (HOME + np.array([0.1, -0.2, 0.1, 0.1, 0.2, 0.4])).tolist()
    offset = [0.0, 0.0, 0.12, 0.0, 0.0, 0.0]
    assert control.setTcp(offset)
    assert control.getTCPOffset() == pytest.approx(offset)
    assert control.moveJ(joints, 3.0, 10.0)
    pose = receive.getActualTCPPose()
    assert control.getForwardKinematics(joints, offset) == pytest.approx(pose, abs=1e-12)
    assert control.getInverseKinematics(pose) == pytest.approx(joints, abs=1e-9)
    assert control.getInverseKinematicsHasSolution(pose)
    assert not control.getInverseKinematicsHasSolution(UNREACHABLE)
    assert control.isPoseWithinSafetyLimits(pose)
    assert not control.isPoseWithinSafetyLimits(UNREACHABLE)
    assert control.isProgramRunning()


@pytest.mark.parametrize("how", ["unreachable", "not a number", "payload", "move during speed"])
def test_what_kills_the_script(receive: Any, control: Any, how: str) -> None:
    if how == "unreachable":
        assert control.getInverseKinematics(UNREACHABLE) == []
    elif how == "not a number":
        assert not control.moveJ([math.nan] * 6)
    elif how == "payload":
        assert not control.setPayload(99.0, [0.0, 0.0, 0.1])
    else:
        control.speedL([0.0, 0.02, 0.0, 0.0, 0.0, 0.0], 0.5)
        wait_until(lambda: any(receive.getTargetQd()))
        assert not control.moveJ(HOME.tolist())
    wait_until(lambda: not control.isProgramRunning())
    wait_until(lambda: receive.getRuntimeState() == 1)
    wait_until(lambda: not any(receive.getTargetQd()), 1.0)
    assert control.reuploadScript()
    wait_until(control.isProgramRunning)
    assert control.moveJ((HOME + 0.05 * TURN).tolist(), 3.0, 10.0)


def test_real_time_calls_answer_one_call_late(control: Any) -> None:
    """They do not wait, so what they return is what the register held before."""
    first = []
    for left_over in (0.5, 0.6, 0.7, 0.8, 0.9):
        assert control.poseTrans([left_over] * 6, [0.0] * 6)[0] == pytest.approx(left_over)
        first.append(control.getStepTime() == pytest.approx(left_over))
        time.sleep(0.05)
        assert control.getStepTime() == pytest.approx(0.002)
    assert any(first)


def test_speed_moves_until_it_is_stopped(receive: Any, control: Any) -> None:
    start = np.array(receive.getActualTCPPose())
    control.speedL([0.0, 0.05, 0.0, 0.0, 0.0, 0.0], 0.5)
    wait_until(lambda: receive.getActualTCPSpeed()[1] > 0.0499)
    assert control.speedStop(10.0)
    wait_until(lambda: not any(receive.getActualTCPSpeed()), 1.0)
    moved = np.array(receive.getActualTCPPose()) - start
    assert moved[1] > 0.002
    assert np.abs(moved[[0, 2, 3, 4, 5]]).max() < 1e-9


def test_a_second_control_interface_is_told_that_the_registers_are_taken(
    mock: UrProcess, control: Any
) -> None:
    with pytest.raises(RuntimeError, match="already in use"):
        RTDEControlInterface(mock.host, 500.0)
    assert control.isProgramRunning() or mock.ask("running") == "Program running: false"


def test_a_program_of_ones_own_runs_and_is_replaced_again(control: Any) -> None:
    script = 'write_output_float_register(20, 4.5)\n textmsg("from the outside")\n'
    assert control.sendCustomScriptFunction("ours", script)
    wait_until(control.isProgramRunning)


def test_waypoints_are_uploaded_with_the_script(receive: Any, control: Any) -> None:
    path = [[*(HOME + 0.1 * TURN).tolist(), 1.0, 4.0, 0.0], [*(HOME - 0.1 * TURN).tolist(), 1.0, 4.0, 0.0]]
    assert control.moveJ(path)
    assert receive.getActualQ() == pytest.approx((HOME - 0.1 * TURN).tolist(), abs=1e-5)  # as printed
