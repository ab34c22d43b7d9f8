"""A mocked controller in a process of its own, and an arm driver on it, for the tests on the wire."""

import json
import os
import secrets
import socket
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.ur import dashboard
from drivers.ur.arm import UrArm
from drivers.ur.process import Alarm
from drivers.ur.safety import SafetyLimits
from harness.basics.arrays import FloatArray

LIMITS = SafetyLimits(workspace_low=(-0.9, -0.6, 0.02), workspace_high=(-0.1, 0.6, 0.9), speed=0.6)
READY: FloatArray = np.array([0.0, -1.4, 1.7, -1.87, -1.57, 0.0])
FAR: FloatArray = READY + np.array([0.6, 0, 0, 0, 0, 0])
FLOOR = 0.15
MOCK_SERIAL = "00005500001"
DOWN: FloatArray = np.array([0.0, 0.0, -1.0])


class FarEnd:
    """The mocked controller: ``tests/support/arm_far_end.py``; by its serial number it may be a real arm."""

    def __init__(self, serial: str = MOCK_SERIAL) -> None:
        self.address = "127." + ".".join(str(1 + secrets.randbelow(254)) for _ in range(3))
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("arm_far_end.py")), self.address, serial],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])},
        )
        assert self._answer() == {"ready": True}

    def cue(self, kind: str, seconds: float | None = None) -> None:
        """Begin a fault."""
        self._tell({"cue": {"kind": kind, "seconds": seconds}})

    def program(self, text: str, port: int = 30002) -> None:
        """Send a program, as another computer would."""
        with socket.create_connection((self.address, port), timeout=30.0) as link:
            link.sendall(text.encode())

    def ask(self, command: str) -> str:
        """One line to the dashboard, one line back."""
        return dashboard.ask(self.address, command)

    def joints(self) -> FloatArray:
        """``(6,)`` rad, as the controller itself knows them."""
        return np.array(self._tell({"where": True})["joints"])

    def outputs(self) -> int:
        """Bits of the digital outputs, as the controller itself has switched them."""
        return int(self._tell({"where": True})["outputs"])

    def close(self) -> None:
        """End it by closing its input."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(60.0)
        self._process.stdout.close()

    def _tell(self, message: dict[str, Any]) -> dict[str, Any]:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(message).encode() + b"\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        answer: dict[str, Any] = json.loads(self._process.stdout.readline())
        return answer


class InFlight:
    """A long joint motion in a thread, from when the arm moves, and how it ended."""

    def __init__(self, arm: UrArm) -> None:
        self.error: Exception | None = None
        self._thread = threading.Thread(target=self._move, args=(arm,))
        self._thread.start()
        while np.abs(arm.state().joint_speeds).max() < 0.1:
            assert self._thread.is_alive(), f"the motion ended before it was seen to begin: {self.error!r}"
            time.sleep(0.005)

    def _move(self, arm: UrArm) -> None:
        try:
            arm.move_joints(FAR, 0.3, 1.5)
        except Exception as error:  # noqa: BLE001 - it is looked at by the test
            self.error = error

    def join(self) -> Exception | None:
        """Its failure, once it has ended."""
        self._thread.join()
        return self.error


def comes_to_rest(far_end: FarEnd, within: float, target: FloatArray | None = None) -> bool:
    """Whether the controller's own joints stop changing within some seconds, short of a target."""
    end = time.monotonic() + within
    before = far_end.joints()
    while time.monotonic() < end:
        time.sleep(0.05)
        after = far_end.joints()
        if np.array_equal(before, after):
            return target is None or bool(np.abs(after - target).max() > 0.05)
        before = after
    return False


def make_arm(
    address: str, folder: Path, rate: float = 500.0, alarm: Alarm = lambda: "", **limits: Any
) -> UrArm:
    """A UR5e at the far end, its lock file in ``folder``."""
    limited = replace(LIMITS, **limits)
    return UrArm(address, "ur5e", limited, rate=rate, lock_folder=folder, alarm=alarm)


def child_pid(arm: UrArm) -> int:
    """Process number of the driver's child."""
    assert arm._session is not None
    return arm._session.process.pid
