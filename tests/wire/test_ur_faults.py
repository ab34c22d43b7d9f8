"""What goes wrong at a real controller, on the mock, seen through the real ur_rtde."""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from tests.support.ur_process import UrProcess, wait_until

HOME = np.array([0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0])
FAR = HOME + np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])

CLIENT = """
import sys, time
from rtde_control import RTDEControlInterface
control = RTDEControlInterface(sys.argv[1], 500.0)
if float(sys.argv[2]):
    control.setWatchdog(float(sys.argv[2]))
print("connected", flush=True)
for _ in range(1000):
    control.speedL([0.0, 0.02, 0.0, 0.0, 0.0, 0.0], 0.5)
    time.sleep(0.01)
"""


@pytest.fixture
def mock() -> Iterator[UrProcess]:
    with UrProcess() as process:
        yield process


@pytest.fixture
def receive(mock: UrProcess) -> Iterator[Any]:
    interface = RTDEReceiveInterface(mock.host, 500.0)
    yield interface
    interface.disconnect()


@pytest.fixture
def control(mock: UrProcess, receive: Any) -> Iterator[Any]:
    interface = RTDEControlInterface(mock.host, 500.0)
    yield interface
    interface.disconnect()


def _moving(receive: Any) -> bool:
    return any(receive.getTargetQd())


def test_a_protective_stop_latches_and_nothing_resumes_by_itself(
    mock: UrProcess, receive: Any, control: Any
) -> None:
    assert control.moveJ(FAR.tolist(), 0.5, 4.0, True)
    wait_until(lambda: _moving(receive))
    time.sleep(0.2)
    control.triggerProtectiveStop()  # the script that would confirm it is paused
    wait_until(receive.isProtectiveStopped, 0.5)
    stopped_at = receive.getTimestamp()
    assert receive.getSafetyMode() == 3
    assert receive.getSafetyStatusBits() == 1 << 2 | 1 << 10
    assert receive.getRuntimeState() == 4
    wait_until(lambda: not _moving(receive), 0.5)
    resting = receive.getActualQ()
    assert not control.moveJ(HOME.tolist())

    assert mock.ask("close safety popup") == "closing safety popup"
    assert mock.ask("unlock protective stop").startswith(
        "Cannot unlock protective stop until 5s after occurr"
    )
    assert mock.ask("play") == "Failed to execute: play"
    assert mock.ask("stop") == "Stopped"
    wait_until(lambda: receive.getTimestamp() > stopped_at + 5.1)
    assert mock.ask("unlock protective stop") == "Protective stop releasing"
    wait_until(lambda: not receive.isProtectiveStopped())
    assert control.reuploadScript()
    wait_until(control.isProgramRunning)
    time.sleep(0.2)
    assert receive.getActualQ() == resting
    assert control.moveJ(HOME.tolist(), 1.0, 4.0)


def test_an_emergency_stop_takes_the_power(mock: UrProcess, receive: Any, control: Any) -> None:
    mock.cue("emergency_stop")
    wait_until(receive.isEmergencyStopped, 0.5)
    assert receive.getSafetyStatusBits() == 1 << 6 | 1 << 7 | 1 << 10
    assert (receive.getRobotMode(), receive.getRuntimeState()) == (3, 1)
    wait_until(lambda: not control.isProgramRunning(), 5.0)  # by a stream of its own
    assert mock.ask("power on") == "Failed to execute: power on"
    mock.cue("release_emergency_stop")
    assert mock.ask("power on") == "Powering on"
    wait_until(lambda: receive.getRobotMode() == 5)
    assert mock.ask("brake release") == "Brake releasing"
    wait_until(lambda: receive.getRobotMode() == 7)
    assert control.reuploadScript()
    wait_until(control.isProgramRunning)
    assert control.moveJ((HOME + 0.05).tolist(), 1.0, 4.0)


def test_a_dropped_connection_is_noticed_at_once(mock: UrProcess, receive: Any) -> None:
    stamp = receive.getTimestamp()
    mock.cue("drop", 1.0)
    # As long as for every other state here: mock and library share their cores with other tests.
    wait_until(lambda: not receive.isConnected(), 5.0)
    with pytest.raises(RuntimeError):
        RTDEReceiveInterface(mock.host, 125.0)
    time.sleep(1.1)
    again = RTDEReceiveInterface(mock.host, 125.0)
    assert again.getTimestamp() > stamp + 1.0
    again.disconnect()


@pytest.mark.parametrize(("seconds", "survives"), [(1.5, True), (4.0, False)])
def test_a_frozen_stream_is_survived_for_about_two_seconds(
    mock: UrProcess, receive: Any, seconds: float, survives: bool
) -> None:
    begin = receive.getTimestamp()
    mock.cue("freeze", seconds)
    time.sleep(0.1)
    frozen = receive.getTimestamp()
    time.sleep(seconds - 0.3)
    assert receive.getTimestamp() == frozen
    assert receive.isConnected() is survives
    time.sleep(0.5)
    if survives:
        wait_until(lambda: receive.getTimestamp() > begin + seconds)


@pytest.mark.parametrize("watchdog", [0.0, 10.0])
def test_a_client_killed_while_the_arm_moves(mock: UrProcess, receive: Any, watchdog: float) -> None:
    """Without a watchdog the arm moves on for ever; with one of 10 Hz it stops within 150 ms."""
    client = subprocess.Popen(
        [sys.executable, "-c", CLIENT, mock.host, str(watchdog)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert client.stdout is not None
    assert client.stdout.readline() == b"connected\n"
    wait_until(lambda: receive.getActualTCPSpeed()[1] > 0.0199)
    os.kill(client.pid, signal.SIGKILL)
    client.communicate()
    killed = receive.getTimestamp()
    if watchdog:
        wait_until(lambda: not _moving(receive), 1.0)
        assert receive.getTimestamp() - killed < 0.15
        assert receive.getRuntimeState() == 1
    else:
        wait_until(lambda: receive.getTimestamp() > killed + 0.5)
        assert receive.getActualTCPSpeed()[1] > 0.0199
        assert mock.ask("stop") == "Stopped"
        wait_until(lambda: not _moving(receive), 1.0)


def test_local_control_refuses_the_constructor(mock: UrProcess) -> None:
    mock.cue("local_control")
    with pytest.raises(RuntimeError, match="enable remote control"):
        RTDEControlInterface(mock.host, 500.0)
    assert mock.ask("stop").startswith("Command is not allowed due to safety reasons")
    assert mock.ask("robotmode") == "Robotmode: RUNNING"


def test_a_program_killed_at_the_pendant_fails_the_next_command(
    mock: UrProcess, receive: Any, control: Any
) -> None:
    mock.cue("kill_program")
    wait_until(lambda: receive.getRuntimeState() == 1)
    assert not control.moveJ(HOME.tolist())
