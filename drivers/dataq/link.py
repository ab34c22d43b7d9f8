"""The serial port of a DATAQ box: commands with their echoes, the stream, and what cuts it off."""

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, WrongUse

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
    """One open serial port."""

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

    def drain(self) -> None:
        """Throw away what still comes until the box is quiet.

        Raises:
            BenchFault: it is not quiet within 5 s, or the link is cut.
        """
        began = heard = now()
        while now() - heard < QUIET:
            if self._waiting():
                heard = now()
            else:
                time.sleep(_DRAIN_STEP)
            if now() - began > _DRAIN_TIMEOUT:
                raise BenchFault(
                    f"{self.name}: the box at {self.port} keeps sending after {STOP!r}; "
                    "unplug it and plug it in again"
                )

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


VENDOR = 0x0683
MAKER, MODEL, FIRMWARE, SERIAL, DIVIDEND = 0, 1, 2, 6, 9
"""Questions of ``info``."""

START, STOP = "start 0", "stop"
END = b"\r"

_PACKET_LARGEST = 7
_PACKET_SECONDS = 2.5e-3


@dataclass(frozen=True)
class BoxModel:
    """What the driver must know of a model."""

    number: str  #: as ``info 1`` answers.
    bits: int  #: of the converter; words of fewer than 16 are left-justified.
    volts: float  #: full scale, either sign.
    divisors: tuple[int, int]  #: least and greatest that ``srate`` takes.
    resets: tuple[str, ...]
    """commands that undo what another program may have left on the box: text for binary, and the decimation
    of a model that has it."""

    @property
    def full_scale(self) -> int:
        """Greatest count."""
        return (1 << (self.bits - 1)) - 1


MODELS = {
    "DI-1110": BoxModel("1110", 12, 10.0, (375, 65535), ("encode 0",)),
    "DI-2108": BoxModel("2108", 16, 10.0, (375, 65535), ("encode 0", "dec 1", "deca 1")),
}


def divisor(dividend: int, rate: float, channels: int, model: BoxModel) -> int:
    """What ``srate`` must be told for ``rate`` Hz on each of ``channels``.

    Raises:
        WrongUse: the box cannot sample at just this rate.
    """
    low, high = model.divisors
    exact = dividend / (rate * channels)
    whole = round(exact)
    if abs(exact - whole) > 1e-9 * exact or not low <= whole <= high:
        nearest = dividend / (min(max(whole, low), high) * channels)
        raise WrongUse(
            f"the box cannot sample {channels} channels at {rate:g} Hz each; it takes {dividend} Hz over a "
            f"whole number from {low} to {high} for all of them: {nearest:.10g} Hz is the nearest"
        )
    return whole


def packet_exponent(rate: float, channels: int) -> int:
    """What ``ps`` must be told, so that a packet is no older than 2.5 ms when it is full."""
    wanted = 2.0 * channels * rate * _PACKET_SECONDS
    return int(np.clip(np.floor(np.log2(max(wanted, 16.0))) - 4, 0, _PACKET_LARGEST))


def answer_to(command: str, heard: bytes) -> str | None:
    """The value in the echo of a command: what follows the command in a whole line.

    Other lines are echoes of earlier commands, which a box that was busy sends late. None where no line
    is an echo of this command.
    """
    for line in heard.replace(b"\0", b"").split(END)[:-1]:
        text = line.strip(b"\n ").decode("ascii", "replace")
        if text == command or text.startswith(command + " "):
            return text[len(command) :].strip()
    return None


def without_start_echo(data: bytes) -> tuple[bool, bytes]:
    """The first bytes of a stream without an echo of the start in front, which some firmwares send.

    Returns:
        Whether more bytes are needed to tell, and the data.
    """
    echo = START.encode() + END
    if len(data) <= len(echo) and echo.startswith(data):
        return True, data
    return False, data[len(echo) :].removeprefix(b"\0") if data.startswith(echo) else data


def counts(words: AnyArray, model: BoxModel) -> AnyArray:
    """Counts of int16 ``words`` as the box left-justified them; volts are ``counts * volts / 2^(bits-1)``."""
    shifted: AnyArray = words >> (16 - model.bits)
    return shifted


def likely_loss(words: AnyArray, offsets: FloatArray, tolerance: float, model: BoxModel) -> int | None:
    """How many bytes are missing, from what the channels rest at.

    Args:
        words: ``(n, channels)`` int16 as read, of a quiet time; n at least 16.
        offsets: ``(channels,)`` counts that the channels rest at, as calibrated.
        tolerance: counts within which they do.
        model: of the box.

    Returns:
        0 where the order is right; the least number of bytes (less than a scan) whose loss puts the
        calibrated offsets in their places; None where nothing does.
    """
    data = np.ascontiguousarray(words).view(np.uint8).ravel()
    scan = 2 * words.shape[1]
    for missing in range(scan):
        kept = data[(scan - missing) % scan :]
        kept = kept[: len(kept) // scan * scan]
        tried = kept.view("<i2").reshape(-1, words.shape[1])
        rests = np.median(counts(tried, model), axis=0)
        if np.all(np.abs(rests - offsets) <= tolerance):
            return missing
    return None
