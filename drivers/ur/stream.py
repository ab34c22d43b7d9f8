"""The arm's state in the child, packet by packet, and the force guard that reads each one."""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from drivers.ur import pipe
from drivers.ur import state as ur_state
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.starvation import WATCH, name_cause

AT_REST: Final = 1e-3  # rad/s of the fastest joint
LOOK_PERIOD: Final = 0.002  # s
CONTACT_PACKETS: Final = 2  # in a row above the threshold; one alone may be noise


class PacketSource(Protocol):
    """What packets come from."""

    rate: float

    def packets(self) -> Iterator[FloatArray | None]:
        """Each packet as it arrives; None whenever there was none for a moment."""


@dataclass(frozen=True, eq=False)
class Guard:
    """Forces that end a motion."""

    press: float  #: N; ends the motion.
    hard: float  #: N; ends it and latches.
    contact: float | None  #: N along ``direction``, either sign; None where none is sought.
    direction: FloatArray  #: ``(3,)`` unit vector in base.


@dataclass(frozen=True)
class Trip:
    """Why the guard ended a motion: ``"hard"``, ``"press"`` or ``"contact"``, and the force in N."""

    kind: str
    force: float


class Stream:
    """Reads every packet in a thread, hands each on, watches the force."""

    def __init__(
        self, source: PacketSource, send: Callable[[FloatArray], None], wake: Callable[[], None]
    ) -> None:
        self._source = source
        self._send = send
        self._wake = wake
        self._thread = threading.Thread(target=self._run, name="arm stream", daemon=True)
        self._contact_count = 0
        self._closed = threading.Event()
        self.newest: FloatArray = np.full(pipe.WIDTH, np.nan)
        self.changed = now()
        self.packets = 0
        self.drops = 0
        self.still = 0
        self.moving = False
        self.restarts = 0
        self.failure = ""
        self.guard: Guard | None = None
        self.trip: Trip | None = None

    def start(self) -> None:
        """Begin to read."""
        WATCH.start()
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join(timeout=1.0)

    @property
    def age(self) -> float:
        """Seconds since a packet last arrived."""
        return now() - self.changed

    def becomes_younger(self, age: float, seconds: float) -> bool:
        """Whether the state is, or within some ``seconds`` becomes, at most ``age`` s old."""
        end = now() + seconds
        while self.age > age and now() < end:
            time.sleep(LOOK_PERIOD)
        return self.age <= age

    def require_younger(self, age: float) -> None:
        """Raise ``BenchFault`` where the stream has failed, or the state is more than ``age`` s old."""
        if self.failure:
            raise BenchFault(self.failure)
        if self.age > age:
            raise BenchFault(
                f"no state arrived from the arm for {self.age:.1f} s (limit {age:g} s); "
                + name_cause("check the network cable of the control box", self.changed)
            )

    @property
    def safety(self) -> str:
        """The controller's safety state in words; ``"normal"`` before the first packet."""
        return "normal" if self.packets == 0 else ur_state.safety_words(int(self._field("safety_bits")[0]))

    @property
    def at_rest(self) -> bool:
        """Whether the last three packets say that no joint turns."""
        return self.still >= 3

    @property
    def force(self) -> float:
        """N, of the newest packet."""
        return float(np.linalg.norm(self._field("wrench")[:3]))

    def watch(self, guard: Guard | None) -> None:
        """Set or end the watch on the force."""
        self.guard = None
        self.trip = None
        self._contact_count = 0
        self.guard = guard

    def _field(self, name: str) -> FloatArray:
        return self.newest[pipe.FIELDS[name]]

    def _run(self) -> None:
        period = 1.0 / self._source.rate
        try:
            for packet in self._source.packets():
                if self._closed.is_set():
                    return
                if packet is not None:
                    self._accept(packet, period)
        except (BenchFault, pipe.PipeBroken) as error:
            self.failure = str(error) or "the state stream ended"
            self._wake()

    def _accept(self, packet: FloatArray, period: float) -> None:
        fields = pipe.FIELDS
        if self.packets:
            step = packet[fields["controller_time"]][0] - self._field("controller_time")[0]
            self.drops += max(0, round(step / period) - 1)
        packet[fields["moving"]] = self.moving
        packet[fields["drops"]] = self.drops
        packet[fields["restarts"]] = self.restarts
        turning = float(np.abs(packet[fields["joint_speeds"]]).max())
        self.still = self.still + 1 if turning < AT_REST else 0
        self.newest = packet
        self.changed = float(packet[fields["time"]][0])
        self.packets += 1
        self._watch_force(packet[fields["wrench"]][:3])
        self._send(packet)

    def _watch_force(self, force: FloatArray) -> None:
        guard = self.guard
        if guard is None or (self.trip is not None and self.trip.kind == "hard"):
            return
        total = float(np.linalg.norm(force))
        along = abs(float(force @ guard.direction))
        touching = guard.contact is not None and along >= guard.contact
        self._contact_count = self._contact_count + 1 if touching else 0
        if total > guard.hard:
            self.trip = Trip("hard", total)
        elif self.trip is not None:
            return
        elif total > guard.press:
            self.trip = Trip("press", total)
        elif self._contact_count >= CONTACT_PACKETS:
            self.trip = Trip("contact", along)
        else:
            return
        self._wake()


PORT: Final = 30004
CONNECT_WITHIN: Final = 2.0  # s
SILENT: Final = 0.1  # s without a byte before the reader looks up

_HEADER: Final = struct.Struct(">HB")
_VERSION, _OUTPUTS, _START, _DATA = ord("V"), ord("O"), ord("S"), ord("U")
_FIELDS: Final = (
    ("timestamp", "DOUBLE", "controller_time"),
    ("actual_q", "VECTOR6D", "joints"),
    ("actual_qd", "VECTOR6D", "joint_speeds"),
    ("actual_TCP_pose", "VECTOR6D", "pose"),
    ("actual_TCP_force", "VECTOR6D", "wrench"),
    ("safety_status_bits", "UINT32", "safety_bits"),
    ("robot_status_bits", "UINT32", "status_bits"),
    ("runtime_state", "UINT32", "runtime_state"),
    ("robot_mode", "INT32", "robot_mode"),
    ("actual_digital_output_bits", "UINT64", "output_bits"),
)
"""(the controller's name, its type, ours)."""
_CODES: Final = {"DOUBLE": "d", "VECTOR6D": "6d", "UINT32": "I", "UINT64": "Q", "INT32": "i"}
_SAMPLE: Final = struct.Struct(">B" + "".join(_CODES[kind] for _, kind, _ in _FIELDS))
_COLUMNS: Final = np.concatenate([np.arange(pipe.WIDTH)[pipe.FIELDS[ours]] for _, _, ours in _FIELDS])


class RtdeStream:
    """One connection to the controller's Real-Time Data Exchange that only receives (RTDE guide, version 2).

    Raises: ``BenchFault`` where the controller does not speak the protocol or lacks a quantity.
    """

    def __init__(self, address: str, rate: float) -> None:
        self.rate = rate
        self._address = address
        self._waiting = b""
        with contextlib.ExitStack() as undo:
            try:
                self._socket = socket.create_connection((address, PORT), timeout=CONNECT_WITHIN)
                undo.callback(self._socket.close)
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._agree(rate)
            except OSError as error:
                raise BenchFault(
                    f"the arm at {address}: no state on port {PORT} ({error}); check the network cable of "
                    "the control box"
                ) from error
            undo.pop_all()
        self._socket.settimeout(SILENT)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def packets(self) -> Iterator[FloatArray | None]:
        """Every ``(pipe.WIDTH,)`` packet, and None whenever the line was silent for a moment.

        Raises:
            BenchFault: the controller closed the connection, or sent a number that is not finite.
        """
        time = now()
        while True:
            for kind, payload in self._whole_packages():
                if kind == _DATA and len(payload) == _SAMPLE.size:
                    yield _packet(payload, time)
            try:
                arrived = self._socket.recv(1 << 16)
            except TimeoutError:
                yield None
                continue
            except OSError as error:
                raise BenchFault(self._closed(str(error))) from error
            if not arrived:
                raise BenchFault(self._closed("end of file"))
            time = now()
            self._waiting += arrived

    def _agree(self, rate: float) -> None:
        """Version 2, the quantities wanted, start."""
        if self._ask(_VERSION, struct.pack(">H", 2)) != b"\x01":
            raise BenchFault(
                f"the controller at {self._address} does not speak RTDE version 2; update PolyScope"
            )
        names = ",".join(name for name, _, _ in _FIELDS)
        reply = self._ask(_OUTPUTS, struct.pack(">d", rate) + names.encode())
        types, wanted = reply[1:].decode().split(","), [kind for _, kind, _ in _FIELDS]
        if types != wanted:
            lacking = [name for (name, kind, _), got in zip(_FIELDS, types, strict=False) if got != kind]
            raise BenchFault(
                f"the controller at {self._address} does not give {', '.join(lacking) or 'its state'} at "
                f"{rate:g} Hz; update PolyScope, or lower the rate in the station file"
            )
        if self._ask(_START, b"") != b"\x01":
            raise BenchFault(f"the controller at {self._address} refuses to stream its state; restart it")

    def _ask(self, kind: int, payload: bytes) -> bytes:
        """The payload of the controller's reply to a package; texts in between are passed over."""
        self._socket.sendall(_HEADER.pack(_HEADER.size + len(payload), kind) + payload)
        while True:
            for answered, reply in self._whole_packages():
                if answered == kind:
                    return reply
            arrived = self._socket.recv(1 << 16)
            if not arrived:
                raise ConnectionResetError("the controller closed the connection")
            self._waiting += arrived

    def _whole_packages(self) -> Iterator[tuple[int, bytes]]:
        """(type, payload) of each package that has arrived whole."""
        while len(self._waiting) >= _HEADER.size:
            size, kind = _HEADER.unpack_from(self._waiting)
            if size < _HEADER.size:
                raise BenchFault(
                    f"the controller at {self._address} sent a package of {size} bytes; reconnect"
                )
            if len(self._waiting) < size:
                return
            payload, self._waiting = self._waiting[_HEADER.size : size], self._waiting[size:]
            yield kind, payload

    def _closed(self, why: str) -> str:
        return (
            f"the controller at {self._address} closed the connection ({why}); check the network cable of "
            "the control box"
        )


def _packet(payload: bytes, time: float) -> FloatArray:
    packet = np.zeros(pipe.WIDTH)
    packet[_COLUMNS] = _SAMPLE.unpack(payload)[1:]
    packet[pipe.FIELDS["time"]] = time
    if not np.isfinite(packet).all():
        name, ours = next(
            (name, ours) for name, _, ours in _FIELDS if not np.isfinite(packet[pipe.FIELDS[ours]]).all()
        )
        raise BenchFault(
            f"the controller sent the {name} {packet[pipe.FIELDS[ours]].tolist()}, where numbers must be "
            "finite: nothing guards the arm without them; look at the pendant's log, and restart the "
            "controller"
        )
    return packet
