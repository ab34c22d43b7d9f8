"""A mocked controller in a process of its own, and an arm driver on it, for the tests on the wire."""

import json
import os
import secrets
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.ur.arm import UrArm
from drivers.ur.safety import SafetyLimits
from harness.basics.arrays import FloatArray

LIMITS = SafetyLimits(workspace_low=(-0.9, -0.6, 0.02), workspace_high=(-0.1, 0.6, 0.9), speed=0.6)
READY: FloatArray = np.array([0.0, -1.4, 1.7, -1.87, -1.57, 0.0])
FLOOR = 0.15
DOWN: FloatArray = np.array([0.0, 0.0, -1.0])


class FarEnd:
    """The mocked controller: ``tests/support/arm_far_end.py``."""

    def __init__(self) -> None:
        self.address = "127." + ".".join(str(1 + secrets.randbelow(254)) for _ in range(3))
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("arm_far_end.py")), self.address],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parents[2])},
        )
        assert self._answer() == {"ready": True}

    def cue(self, kind: str, seconds: float | None = None) -> None:
        """Begin a fault."""
        self._tell({"cue": {"kind": kind, "seconds": seconds}})

    def joints(self) -> FloatArray:
        """``(6,)`` rad, as the controller itself knows them."""
        return np.array(self._tell({"where": True})["joints"])

    def close(self) -> None:
        """End it by closing its input."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(5.0)
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


def make_arm(address: str, folder: Path, rate: float = 500.0, **limits: Any) -> UrArm:
    """A UR5e at the far end, its lock file in ``folder``."""
    return UrArm(address, "ur5e", replace(LIMITS, **limits), rate=rate, lock_folder=folder)


def child_pid(arm: UrArm) -> int:
    """Process number of the driver's child."""
    assert arm._session is not None
    return arm._session.process.pid
