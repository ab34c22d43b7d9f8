"""One opened arm: its lock, its child process, and the two ways to stop it."""

import contextlib
import os
import re
import socket
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, NoReturn

from drivers.ur import dashboard, pipe
from drivers.ur.link import PATIENCE
from drivers.ur.process import Alarm, ChildLost, ChildProcess, DeadlineMissed
from drivers.ur.safety import require_loopback, require_mock
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, ProtectiveStop, TouchstoneError
from harness.basics.files.lock_file import read_owner, remove_unheld, take_lock
from harness.basics.starvation import WATCH, name_cause

PORTS: Final = {30004: "RTDE", 29999: "dashboard", 30003: "script", 30011: "message"}
OPEN_WITHIN: Final = 20.0  # s
FIRST_PACKET_WITHIN: Final = 2.0  # s
CLOSE_WITHIN: Final = 3.0  # s
ACKNOWLEDGE_WITHIN: Final = 0.15  # s for the child to brake
REST_WITHIN: Final = 1.0  # s from braking to rest
_CHECK_BOTH: Final = "check this computer's load and the network cable of the control box"
_CHECK_BOX: Final = "check the network cable of the control box, and restart the controller if this stays"
_RECENT: Final = 5.0  # s in which a delay of this computer explains a stale state
STALE: Final = 5.0  # of the watchdog's patience


class UrSession:
    """From connected to closed; after a failure it stays latched and only closes.

    Raises: on construction, ``WrongUse`` for an address that is not loopback, ``SafetyStop`` for a
        controller that is no mock, ``ProtectiveStop`` where the controller has stopped the arm,
        ``BenchFault`` for all else.
    """

    def __init__(
        self,
        address: str,
        command: Sequence[str],
        rate: float,
        lock_folder: Path | None,
        patience: float = PATIENCE,
    ) -> None:
        require_loopback(address)
        self.address = address
        self._stale = STALE * patience
        self.latched: TouchstoneError | None = None
        self.epoch = 0
        self._closing = False
        self._lock = take_arm(address, lock_folder)
        self._process: ChildProcess | None = None
        try:
            for port, name in PORTS.items():
                try:
                    socket.create_connection((address, port), timeout=2.0).close()
                except OSError as error:
                    raise BenchFault(
                        f"no arm controller at {address}: its {name} port {port} does not answer ({error}); "
                        "check the network cable of the control box, that the box is on, and the address in "
                        "the station file"
                    ) from error
            require_mock(address, dashboard.ask(address, "get serial number"))
            self._process = ChildProcess(command, rate, keep=(self._lock,))
            self.controller: list[str] = self._ready(self._process)
        except BaseException:
            self.close()
            raise

    @property
    def process(self) -> ChildProcess:
        """The child; it outlives its death, to say what it last saw."""
        assert self._process is not None, "set by the constructor, or it raised"
        return self._process

    def close(self) -> None:
        """Stop the arm, end the child, release the lock."""
        self._closing = True
        if self._process is not None:
            self._process.end(CLOSE_WITHIN)
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def packet(self) -> FloatArray:
        """The newest packet; raises ``BenchFault`` where it is stale, and latches."""
        packet = self.process.newest()
        age = float("inf") if packet is None else now() - float(packet[0])
        if packet is None or age > self._stale:
            why = self.process.lost or "its stream stalled"
            fault = BenchFault(
                f"the state of the arm at {self.address} is {age:.2f} s old (limit {self._stale:g} s): "
                f"{why}; "
                + name_cause(
                    _CHECK_BOTH,
                    now() - min(age, _RECENT),
                )
            )
            self.latched = self.latched or fault
            raise fault
        return packet

    def ask(
        self,
        message: pipe.Message,
        seconds: float,
        *,
        beat: bool = False,
        alarm: Alarm | None = None,
        though_latched: bool = False,
    ) -> Any:
        """A request to the child; a missed deadline or a lost child stops the arm and latches.

        Raises:
            Alarmed: by ``alarm``; nothing was stopped yet.
            TouchstoneError: what latched the arm, unless the request may be made though it is latched.
        """
        if not though_latched:
            self.require_unlatched()
        try:
            return self.process.request(message, seconds, beat=beat, alarm=alarm)
        except DeadlineMissed as error:
            self._fault(str(error))
        except ChildLost as error:
            self.process.kill()  # so that its last words are read to their end
            self._fault(self.process.lost or str(error))
        except ProtectiveStop as error:
            self.latched = error
            raise

    def require_unlatched(self) -> None:
        """Raise what stopped the arm for good, if anything did."""
        if self.latched is not None:
            raise self.latched

    def stop(self) -> None:
        """Stop now; takes no lock, so that a signal handler may call it."""
        self.epoch += 1
        stopped = not self.process.lost and self._stop_by_child()
        if not stopped and not self._closing:  # a closing child stops the arm itself
            dashboard.stop(self.address)
            self.latched = self.latched or BenchFault(
                f"the arm at {self.address} was stopped through its dashboard, for its process did not "
                f"stop it in time; open it again to move it ({self.process.lost or 'no acknowledgement'})"
            )

    def comes_true(self, condition: Callable[[FloatArray], bool], seconds: float) -> bool:
        """Whether a packet that arrives within ``seconds`` from now fulfils the condition."""
        start = now()
        while now() < start + seconds and not self.process.lost:
            packet = self.process.newest()
            if packet is not None and packet[0] > start and condition(packet):
                return True
            time.sleep(0.002)
        return False

    def _stop_by_child(self) -> bool:
        """Whether the child braked and the arm came to rest."""
        try:
            number = self.process.tell({"do": "stop", "epoch": self.epoch})
        except (ChildLost, DeadlineMissed):
            return False
        end = now() + ACKNOWLEDGE_WITHIN
        while not self.process.answered(number):
            if now() > end or self.process.lost:
                return False
            time.sleep(0.002)
        return self.comes_true(lambda packet: not packet[pipe.FIELDS["moving"]][0], REST_WITHIN)

    def _fault(self, reason: str) -> NoReturn:
        """Kill the child, end the controller's program, and latch."""
        self.process.kill()
        stopped = "stopped through its dashboard"
        try:
            dashboard.stop(self.address)
        except BenchFault as error:
            stopped = f"left to its watchdog, for {error}"
        fault = BenchFault(f"the arm at {self.address}: {reason}; it was {stopped}; open it again to move it")
        self.latched = self.latched or fault
        raise fault

    def _ready(self, process: ChildProcess) -> list[str]:
        WATCH.start()
        began = now()
        try:
            controller: list[str] = process.ready(OPEN_WITHIN)
        except (DeadlineMissed, ChildLost) as error:
            self._kill_and_stop(process)
            raise BenchFault(
                f"the arm at {self.address} did not open: {error}; "
                + name_cause(
                    _CHECK_BOX,
                    began,
                )
            ) from error
        end = now() + FIRST_PACKET_WITHIN
        while process.newest() is None:
            if now() > end or process.lost:
                raise BenchFault(
                    f"the arm at {self.address} opened but sent no state within {FIRST_PACKET_WITHIN:g} s "
                    f"({process.lost or 'stream silent'}); "
                    + name_cause("check the network cable of the control box", began)
                )
            time.sleep(0.005)
        return controller

    def _kill_and_stop(self, process: ChildProcess) -> None:
        process.kill()
        with contextlib.suppress(BenchFault):
            dashboard.stop(self.address)


_PREFIX, _SUFFIX = "touchstone-arm-", ".lock"

_ATTEMPTS = 10
"""Attempts at a lock: other programs hold it for moments, to find out whether it is free."""


def lock_path(address: str, folder: Path | None = None) -> Path:
    """The lock file of the arm at ``address``; shared by all users of this computer."""
    name = re.sub(r"[^0-9A-Za-z.]", "-", address)
    return (folder or Path(tempfile.gettempdir())) / f"{_PREFIX}{name}{_SUFFIX}"


def take_arm(address: str, folder: Path | None = None) -> int:
    """Take the lock of an arm; the descriptor holds it until it is closed, here and in any child given it.

    The lock files of programs that ended, or were killed, are removed first.

    Raises:
        BenchFault: another program owns this arm.
    """
    path = lock_path(address, folder)
    remove_ownerless(path.parent)
    descriptor = take_lock(path, _ATTEMPTS)
    if descriptor is None:
        raise BenchFault(
            f"the arm at {address} is owned by another program ({read_owner(path)}, lock {path}); "
            "two programs must not drive one arm: end that one first"
        )
    return descriptor


def remove_ownerless(folder: Path) -> None:
    """Remove this user's lock files that no living process holds."""
    for path in folder.glob(f"{_PREFIX}*{_SUFFIX}"):
        remove_unheld(path)
