"""An acquisition box behind a pseudo-terminal: samples when they are due, on a crystal of its own.

A pseudo-terminal would block where the instrument overflows, so its master is non-blocking: what the
program does not fetch stays in the host's memory, what the host does not fetch stays in the box's own,
and what does not fit there is lost and counted. A box that is served late catches up in steps smaller
than its memory, so that only a host that does not fetch makes it overflow.
"""

import contextlib
import errno
import math
import multiprocessing
import os
import pty
import select
import tty
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.clock import now
from mocks.faults import ActiveFault, Fault
from mocks.lab_processes import ChildPipe, keep_time

_END = b"\r"
_LONGEST_COMMAND = 256
_MAKER = "DATAQ"
_INPUTS = range(11)  # analogue 0 to 7, counter 8, rate 9, digital word 10
_INFO_QUESTIONS = range(10)


@dataclass(frozen=True)
class MockedBoxModel:
    """What one model of the family is."""

    name: str  #: product number, as ``info 1`` states it.
    bits: int  #: of its converter; fewer than 16 leave it left-justified in 16.
    dividend: int  #: Hz; the scan list's rate is this over the divisor of ``srate``.
    divisors: tuple[int, int]  #: that ``srate`` takes, least and greatest.
    decimates: bool  #: whether it has ``dec`` and ``deca``.


MODELS = {
    "DI-1110": MockedBoxModel("1110", 12, 60_000_000, (375, 65535), decimates=False),
    "DI-2108": MockedBoxModel("2108", 16, 60_000_000, (375, 65535), decimates=True),
}


class CommandInterpreter:
    """The command interpreter of an instrument.

    From the maker's "Data Acquisition Instrument Command Protocol" (DATAQ Instruments, revised
    2019-08-05): commands are lower-case ASCII, arguments separated by one space, ended by a carriage
    return; each is answered by itself with its value while the instrument is not scanning, and by
    nothing while it is.

    Args:
        model: of ``MODELS``.
        serial: as ``info 6`` states it.
        echoes_start: whether the echo of ``start`` comes in front of the data; firmwares differ.
    """

    def __init__(self, model: MockedBoxModel, serial: str, echoes_start: bool = False) -> None:
        self.scanning = False  #: whether samples are being taken.
        self.scan_list: list[int] = [0]  #: inputs, by slot.
        self._model = model
        self._serial = serial
        self._echoes_start = echoes_start
        self._pending = b""
        low, high = model.divisors
        # The commands that set one number: what it may be, and what it is.
        self._allowed = {"srate": range(low, high + 1), "ps": range(8), "led": range(8), "encode": range(2)}
        if model.decimates:
            self._allowed |= {"dec": range(1, 513), "deca": range(4)}
        self._set = {"srate": high, "ps": 0, "encode": 0, "dec": 1}

    @property
    def aggregate_rate(self) -> float:
        """Hz, nominal, of words: over the whole scan list."""
        return self._model.dividend / self._set["srate"]

    @property
    def packet(self) -> int:
        """Bytes that leave at once."""
        return 1 << (self._set["ps"] + 4)

    @property
    def as_text(self) -> bool:
        """True if samples are sent as lines of decimal numbers."""
        return self._set["encode"] == 1

    @property
    def decimation(self) -> int:
        """Scans that are taken for each that leaves; the last of them does, whatever ``deca`` says."""
        return self._set["dec"]

    def take(self, data: bytes) -> bytes:
        """Obey what the cable brings; the answers to it."""
        *commands, self._pending = (self._pending + data).split(_END)
        self._pending = self._pending[-_LONGEST_COMMAND:]
        return b"".join(self._answer(command) for command in commands)

    def _answer(self, command: bytes) -> bytes:
        words = command.decode("ascii", "replace").strip("\0\n ").split(" ")
        was_scanning = self.scanning
        value = self._obey(words[0], words[1:])
        silent = value is None or (was_scanning and words[0] != "stop")
        if silent or (words[0] == "start" and not self._echoes_start):
            return b""
        return f"{' '.join([*words, value] if value else words)}".encode() + _END + b"\0"

    def _obey(self, name: str, arguments: list[str]) -> str | None:
        """The value in the answer, often empty; None where the command is not answered."""
        if name == "start" and arguments in ([], ["0"]):
            self.scanning = True
            return ""
        if name == "stop" and not arguments:
            self.scanning = False
            return ""
        if not all(argument.isdigit() for argument in arguments):
            return None
        match name, [int(argument) for argument in arguments]:
            case "info", [question] if question in _INFO_QUESTIONS:
                model = self._model
                answers = {0: _MAKER, 1: model.name, 2: "129", 6: self._serial, 9: str(model.dividend)}
                return answers.get(question, "0")
            case "slist", [slot, source] if not self.scanning:
                if source not in _INPUTS or slot > len(self.scan_list):
                    return None
                self.scan_list = self.scan_list[:slot]
                if source in self.scan_list:
                    return None
                self.scan_list.append(source)
                return ""
            case _, [number] if not self.scanning and number in self._allowed.get(name, ()):
                self._set[name] = number
                return ""
        return None


MEMORY = 4096
"""Bytes of the instrument's own."""

HOST_MEMORY = 640 << 10
"""Bytes that Linux keeps of a serial port for its program (TTYB_DEFAULT_MEM_LIMIT in tty_buffer.c)."""

_WRITE = 4096
_PERIOD = 10e-3
_LONGEST_WAIT = 30e-3
_COMMAND_BYTES = 4096
_LOSSES = {"lost_byte": 1, "lost_word": 2}

Source = Callable[[int, int], AnyArray]
"""Counts of inputs 0 and 1, ``(count, 2)`` int16, of ``count`` scans from the one numbered first. Scans are
asked for once each and in order, numbered from when the box was made, however often it is started.
Input 1 is converted ``1 / aggregate rate`` after input 0 of the same scan: the source says what each
was at its own moment."""


class DaqBox:
    """One box, from the moment it is plugged in.

    The process that makes it may give it to a child (``serve`` there) and then must ``leave`` it.

    Args:
        source: what its inputs are at.
        model: of ``mocks.daq.box.MODELS``.
        serial: as it states it.
        drift_ppm: how much faster than nominal its crystal runs, parts in a million.
        memory: bytes of its own.
        host_memory: bytes that the host's system keeps for a program that does not fetch them.
        echoes_start: whether the echo of ``start`` comes in front of the data.
    """

    def __init__(
        self,
        source: Source,
        model: str = "DI-2108",
        serial: str = "mock-2108",
        drift_ppm: float = 0.0,
        memory: int = MEMORY,
        host_memory: int = HOST_MEMORY,
        echoes_start: bool = False,
    ) -> None:
        self._model = MODELS[model]
        self._instrument = CommandInterpreter(self._model, serial, echoes_start)
        self._source = source
        self._speed = 1.0 + 1e-6 * drift_ppm
        self._memory = bytearray()
        self._capacity = memory
        self._fault = ActiveFault()
        self._lost = multiprocessing.get_context("fork").Value("q", 0)
        self._began = 0.0
        self._taken = 0
        self._numbered = 0
        self._answers = b""
        self._host = bytearray()
        self._host_memory = host_memory
        self._losing = 0
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)  #: path of the device file that a driver opens.

    @property
    def lost(self) -> int:
        """Bytes that did not fit into the memory so far; readable in every process that has the box."""
        return int(self._lost.value)

    def scan(self) -> tuple[int, float, float]:
        """Number of the next scan, its time in s on the bench clock, and scans a second of that clock.

        For a source that must be in time with something else. Meaningless while the box does not scan.
        """
        rate = self._scan_rate
        return self._numbered, self._began + self._taken / rate, rate

    def leave(self) -> None:
        """Close this process's ends of the cable; does nothing if they are closed."""
        for end in (self._master, self._slave):
            with contextlib.suppress(OSError):
                os.close(end)
        self._master = self._slave = -1

    def serve(self, line: ChildPipe) -> None:
        """Be the instrument until the lab is gone or the cable is pulled."""
        keep_time()
        line.ready()
        while not line.should_stop() and self._master >= 0:
            fault = line.fault()
            if fault is not None:
                self._begin(fault)
            if self._fault.kind == "stall":
                self._began = now() - self._taken / self._scan_rate
                select.select([], [], [], _PERIOD)
            elif self._master >= 0:
                self._obey()
                # Take the scans that are due, in steps, and let them out as the cable takes them.
                due = math.floor((now() - self._began) * self._scan_rate) if self._instrument.scanning else 0
                step = max(1, (MEMORY // (2 * len(self._instrument.scan_list))) // 2)
                while self._instrument.scanning and self._taken < due:
                    count = min(step, due - self._taken)
                    words, free = self._words(count), self._capacity - len(self._memory)
                    self._memory += words[:free]  # the rest is lost, wherever in a scan that may be
                    self._lost.value += max(0, len(words) - free)
                    self._taken += count
                    self._numbered += count * self._instrument.decimation
                    self._let_out()
                self._let_out()
                select.select([self._master], [], [], self._until_packet())

    @property
    def _scan_rate(self) -> float:
        scans = self._speed * self._instrument.aggregate_rate / len(self._instrument.scan_list)
        return scans / self._instrument.decimation

    def _until_packet(self) -> float:
        """Seconds until the last of the next few packets is full, which then leaves at once."""
        if not self._instrument.scanning:
            return _PERIOD
        scan, packet = 2 * len(self._instrument.scan_list), self._instrument.packet
        few = max(1, round(_PERIOD * self._scan_rate * scan / packet))
        full = math.ceil((self._taken * scan // packet + few) * packet / scan)
        return min(max(0.0, self._began + full / self._scan_rate - now()), _LONGEST_WAIT)

    def _begin(self, fault: Fault) -> None:
        if fault.kind == "unplug":
            self.leave()
        elif fault.kind in _LOSSES:
            self._losing += _LOSSES[fault.kind]
        else:
            self._fault.set(fault)

    def _obey(self) -> None:
        """Answer what the cable has brought."""
        try:
            data = os.read(self._master, _COMMAND_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return
        was_scanning = self._instrument.scanning
        answers = self._instrument.take(data)
        if self._instrument.scanning and not was_scanning:
            self._began, self._taken = now(), 0
            self._memory.clear()
        self._answers += answers

    def _words(self, count: int) -> bytes:
        """``count`` scans as the instrument sends them."""
        step = self._instrument.decimation
        counts = self._source(self._numbered, count * step)[step - 1 :: step]
        words = np.zeros((count, len(self._instrument.scan_list)), "<i2")
        for slot, wired in enumerate(self._instrument.scan_list):
            if wired < counts.shape[1]:
                words[:, slot] = counts[:, wired]
        limit = 1 << (self._model.bits - 1)
        if words.min() < -limit or words.max() >= limit:
            raise ValueError(f"the source gave counts that a {self._model.bits}-bit converter cannot say")
        if self._instrument.as_text:
            return b"".join(b",".join(b"%d" % word for word in scan) + b"\r" for scan in words)
        return (words << (16 - self._model.bits)).astype("<i2").tobytes()

    def _let_out(self) -> None:
        """Let the host fetch whole packets, and the last answers behind the data; deliver what it has."""
        while self._fault.kind != "overflow" and len(self._host) < self._host_memory and self._packet():
            self._deliver()
        self._deliver()

    def _packet(self) -> bool:
        """Move the next packet to the host; whether there was one."""
        size = self._instrument.packet
        if not self._instrument.scanning and self._answers:
            size = len(self._memory)
        elif not self._answers and (not self._instrument.scanning or len(self._memory) < size):
            return False
        if self._answers and self._instrument.scanning:
            data = b""
        else:
            data = bytes(self._memory[self._losing : size])
            del self._memory[:size]
            self._losing = 0
        self._host += data + self._answers
        self._answers = b""
        return True

    def _deliver(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while self._host:
                del self._host[: os.write(self._master, self._host[:_WRITE])]
