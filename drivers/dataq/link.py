"""The serial port of a DATAQ box: commands with their echoes, the stream, and what cuts it off."""

import time
from typing import TYPE_CHECKING

from drivers.dataq.protocol import END, SERIAL, STOP, VENDOR, answer_to
from harness.basics.clock import now
from harness.basics.errors import BenchFault

if TYPE_CHECKING:
    from serial import Serial

REPLY_TIMEOUT = 1.0
"""s within which a command is echoed."""

QUIET = 0.06
"""s without a byte after which a stopped box is taken to be drained."""

_READ_TIMEOUT = 0.05
_DRAIN_TIMEOUT = 5.0
_DRAIN_STEP = 0.005


class LinkCut(BenchFault):
    """The port itself is gone: the cable was pulled or the power cut."""


class DataqLink:
    """One open serial port.

    Args:
        name: of the instrument, as messages call it.
        port: path of the device file.
    """

    def __init__(self, name: str, port: str) -> None:
        self.name = name
        self.port = port
        self._serial: Serial | None = None

    def open(self) -> None:
        """Open the port for this program alone, and quiet a box that an earlier one left scanning.

        Raises:
            BenchFault: there is no such port, another program has it, or the box does not fall silent.
        """
        from serial import Serial, SerialException

        try:
            self._serial = Serial(
                self.port, timeout=_READ_TIMEOUT, write_timeout=REPLY_TIMEOUT, exclusive=True
            )
        except (SerialException, OSError, ValueError) as error:
            raise BenchFault(
                f"{self.name}: the port {self.port} cannot be opened ({_reason(error)}); check the box's USB "
                "cable and power, that no other program has the port, and the port in the station"
            ) from error
        self.send(STOP)
        self.drain()

    def close(self) -> None:
        """Close the port; does nothing if it is closed."""
        if self._serial is not None:
            self._serial.close()
            self._serial = None

    def ask(self, command: str) -> str:
        """Send a command to a box that is not scanning; the value in its echo.

        Raises:
            BenchFault: no echo within ``REPLY_TIMEOUT`` s, another one, or the link is cut.
        """
        self.send(command)
        heard, began = b"", now()
        while now() - began < REPLY_TIMEOUT:
            heard += self._waiting(1)
            value = answer_to(command, heard)
            if value is not None:
                return value
        said = repr(heard.decode("ascii", "replace")) if heard else "nothing"
        raise BenchFault(
            f"{self.name}: the box at {self.port} answered {said} to {command!r}; check its power, and "
            "that it is a DATAQ box in CDC mode (its light blinks yellow)"
        )

    def send(self, command: str) -> None:
        """Send a command whose echo nobody waits for; ``BenchFault`` where the link is cut."""
        port = self._open_port()
        try:
            port.write(command.encode("ascii") + END)
        except OSError as error:
            raise self.cut(_reason(error)) from error

    def fileno(self) -> int:
        """The port's file descriptor, for a process that reads it instead of this one."""
        return self._open_port().fileno()

    def cut(self, reason: str) -> LinkCut:
        """That the port is gone, for the operator."""
        return LinkCut(
            f"{self.name}: the box at {self.port} went away ({reason}); check its USB cable and its "
            "power, then open the bench again"
        )

    def drain(self) -> int:
        """Throw away what still comes until the box is quiet; how many bytes that were.

        Raises:
            BenchFault: it is not quiet within 5 s, or the link is cut.
        """
        began = heard = now()
        thrown = 0
        while now() - heard < QUIET:
            data = self._waiting()
            thrown += len(data)
            if data:
                heard = now()
            else:
                time.sleep(_DRAIN_STEP)
            if now() - began > _DRAIN_TIMEOUT:
                raise BenchFault(
                    f"{self.name}: the box at {self.port} keeps sending after {STOP!r}; "
                    "unplug it and plug it in again"
                )
        return thrown

    def _waiting(self, least: int = 0) -> bytes:
        """What has arrived already; waits up to 50 ms for the ``least`` bytes."""
        port = self._open_port()
        try:
            return port.read(max(least, port.in_waiting))
        except OSError as error:
            raise self.cut(_reason(error)) from error

    def _open_port(self) -> "Serial":
        if self._serial is None:
            raise BenchFault(f"{self.name} was used before it was opened; open the bench first")
        return self._serial


def find_port(name: str, serial_number: str) -> str:
    """Path of the port at whose other end a DATAQ box says it has this serial number.

    Raises:
        BenchFault: none does; the ones there are, are named.
    """
    from serial.tools import list_ports

    said: dict[str, str] = {}
    for candidate in list_ports.comports():
        if candidate.vid != VENDOR:
            continue
        link = DataqLink(name, candidate.device)
        try:
            link.open()
            said[candidate.device] = link.ask(f"info {SERIAL}")
        except BenchFault as fault:
            said[candidate.device] = f"no answer: {fault}"
        finally:
            link.close()
        if said[candidate.device] == serial_number:
            return candidate.device
    there = "; ".join(f"{port}: {number}" for port, number in said.items()) or "no DATAQ box at all"
    raise BenchFault(
        f"{name}: no acquisition box has the serial number {serial_number!r}; found {there}. "
        "Check its USB cable and power, that it is in CDC mode, or name its port in the station"
    )


def _reason(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
