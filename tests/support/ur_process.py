"""A mocked controller in a process of its own, for tests that talk to its ports."""

import json
import secrets
import select
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, Self

import numpy as np

HOME = np.array([0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0])
"""rad: a pose from which every test may move."""

TURN = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 1.0])
"""Joints that may turn far without meeting anything."""

PLANE = 0.40
"""m: height of the surface that the controller's tool can touch."""

PORTS = (29999, 30001, 30002, 30003, 30004, 30011)
READY_WITHIN = 20.0


class UrProcess:
    """``python -m tests.support.ur_controller`` on a free loopback address; ends with the ``with`` block."""

    def __init__(self, *options: str) -> None:
        self.host = free_host()
        command = [sys.executable, "-m", "tests.support.ur_controller", "--host", self.host, *options]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def __enter__(self) -> Self:
        assert self._line() == {"ready": True, "host": self.host, "model": "ur5e"}
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> int:
        """Close its input; its exit status."""
        self.process.communicate(timeout=PATIENCE)
        return self.process.returncode

    def cue(self, kind: str, seconds: float | None = None) -> None:
        """Begin a fault."""
        cue = {"kind": kind} if seconds is None else {"kind": kind, "seconds": seconds}
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(cue).encode() + b"\n")
        self.process.stdin.flush()
        assert self._line() == {"cue": f"begun: {kind}"}

    def ask(self, command: str) -> str:
        """One line to the dashboard, one line back."""
        with socket.create_connection((self.host, 29999), timeout=PATIENCE) as link:
            lines = link.makefile("rwb")
            assert lines.readline() == b"Connected: Universal Robots Dashboard Server\n"
            lines.write(command.encode() + b"\n")
            lines.flush()
            return lines.readline().decode().strip()

    def _line(self) -> Any:
        assert self.process.stdout is not None
        assert select.select([self.process.stdout], [], [], READY_WITHIN)[0], "the mock is silent"
        return json.loads(self.process.stdout.readline())


def free_host() -> str:
    """A loopback address on which all the controller's ports are free."""
    for _ in range(100):
        host = f"127.{1 + secrets.randbelow(9)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"
        if all(is_free(host, port) for port in PORTS):
            return host
    raise AssertionError("no free loopback address")


def is_free(host: str, port: int) -> bool:
    """Whether a port could be bound."""
    try:
        socket.create_server((host, port)).close()
    except OSError:
        return False
    return True


PATIENCE = 30.0
"""Time limit in s of a condition, long enough for a busy computer."""


def wait_until(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Wait until a condition is met; fail if it is not within ``seconds``."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, f"not within {seconds} s"
        time.sleep(0.001)
