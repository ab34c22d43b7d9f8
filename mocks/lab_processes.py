"""The lab's child processes: how they are begun, told of faults, and sure to end.

A child ends when its parent does, even by kill -9: Linux sends it the signal it asked for
(prctl(2), PR_SET_PDEATHSIG), and elsewhere it sees its parent's number change.
"""

import contextlib
import ctypes
import json
import multiprocessing
import os
import secrets
import signal
import socket
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict
from multiprocessing.connection import Connection
from typing import Protocol

from harness.basics.errors import BenchFault
from mocks.faults import Fault

ARM_PORTS = (29999, 30001, 30002, 30003, 30004, 30011)
GEL_PORT = 8080
CAMERA_PORT = 8081

_PR_SET_PDEATHSIG = 1
_READY = b"ready"
_ADDRESS_ATTEMPTS = 50
_PUNCTUAL = -10
_CONTEXT = multiprocessing.get_context("fork")


class ChildPipe:
    """A child's end of the lab: what to do there, and whether to go on.

    Args:
        connection: faults arrive on it; readiness is reported on it.
        parent: process number of the lab.
    """

    def __init__(self, connection: Connection, parent: int) -> None:
        self._connection = connection
        self._parent = parent
        self._ready = False

    def ready(self) -> None:
        """Say once that the instrument answers."""
        if not self._ready:
            self._ready = True
            self._connection.send_bytes(_READY)

    def fault(self) -> Fault | None:
        """The next fault to begin, if one was cued."""
        with contextlib.suppress(EOFError, OSError):
            if self._connection.poll():
                return Fault(**json.loads(self._connection.recv_bytes()))
        return None

    def should_stop(self) -> bool:
        """Whether the lab is gone."""
        return os.getppid() != self._parent


class FarEnd(Protocol):
    """The far end of one instrument's cable."""

    @property
    def address(self) -> str:
        """Where the driver finds it: a host, a URL, the path of a port, the name of an input."""

    @property
    def environment(self) -> Mapping[str, str]:
        """Environment variables that a program needs to open it."""

    @property
    def faults(self) -> tuple[str, ...]:
        """Kinds of faults that it takes."""

    def wait_ready(self, timeout: float) -> None:
        """Wait until the instrument answers; ``BenchFault`` after ``timeout`` s."""

    def cue(self, fault: Fault) -> None:
        """Begin a fault."""

    def kill(self) -> None:
        """End it now."""


class LabChild:
    """A process of the lab; a ``FarEnd``.

    Args:
        name: of the instrument, as messages call it.
        run: what it does; it ends when ``ChildPipe.should_stop`` says so.
        address: where the driver finds it.
        faults: kinds of faults that it takes.
    """

    def __init__(
        self, name: str, run: Callable[[ChildPipe], None], address: str = "", faults: tuple[str, ...] = ()
    ) -> None:
        self.name = name
        self.address = address
        self.faults = faults
        self.environment: Mapping[str, str] = {}
        self._connection, theirs = _CONTEXT.Pipe()
        self._process = _CONTEXT.Process(
            target=_begin, args=(run, theirs, os.getpid()), name=name, daemon=True
        )
        self._process.start()
        theirs.close()

    def wait_ready(self, timeout: float) -> None:
        """Wait until the instrument answers.

        Raises:
            BenchFault: it ended, or is not ready within ``timeout`` s.
        """
        if not self._connection.poll(timeout):
            raise BenchFault(f"the mocked {self.name} was not ready within {timeout:g} s; see its log above")
        try:
            word = self._connection.recv_bytes()
        except EOFError:
            word = b"it ended without a word"
        if word != _READY:
            raise BenchFault(f"the mocked {self.name} did not start: {word.decode()}")

    def cue(self, fault: Fault) -> None:
        """Begin a fault in this instrument; nothing happens if it has died."""
        with contextlib.suppress(OSError):
            self._connection.send_bytes(json.dumps(asdict(fault)).encode())

    def kill(self) -> None:
        """End the process now."""
        self._process.kill()
        self._process.join()

    @property
    def sentinel(self) -> int:
        """Readable once the process has ended."""
        return self._process.sentinel


def _begin(run: Callable[[ChildPipe], None], connection: Connection, parent: int) -> None:
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # the parent exited before the signal was set
        os._exit(0)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the lab's to answer
    # Keep the child's output out of the lab's replies, and the lab's input out of the child.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    try:
        run(ChildPipe(connection, parent))
    except Exception as error:  # noqa: BLE001 - reported to the lab in one sentence, and in full on stderr
        traceback.print_exc()
        with contextlib.suppress(OSError):
            connection.send_bytes(f"{type(error).__name__}: {error}".encode())
    os._exit(0)  # what was inherited is the lab's to clean up


def keep_time() -> None:
    """Ask to be served before other processes, where the system lets us: a controller is punctual."""
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, _PUNCTUAL)


def free_address() -> str:
    """A loopback address of its own, with all the lab's ports free.

    Raises:
        BenchFault: none was found.
    """
    for _ in range(_ADDRESS_ATTEMPTS):
        address = "127." + ".".join(str(1 + secrets.randbelow(254)) for _ in range(3))
        if all(_is_free(address, port) for port in (*ARM_PORTS, GEL_PORT, CAMERA_PORT)):
            return address
    raise BenchFault(
        "no loopback address 127.x.y.z has all of the lab's ports free; end other mocked labs first"
    )


def _is_free(address: str, port: int) -> bool:
    try:
        with socket.create_server((address, port)):
            return True
    except OSError:
        return False
