"""The arm's state by the controller's Real-Time Data Exchange (Universal Robots, RTDE guide, version 2).

ur_rtde's RTDEReceiveInterface keeps only the newest packet: whenever its reader is late it skips
the others, so a busy computer loses a tenth of them. This reader takes every packet, in order, with
the time at which it arrived, and the fields of one packet always belong together.
"""

import contextlib
import socket
import struct
from collections.abc import Iterator
from typing import Final

import numpy as np

from drivers.ur import pipe
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault

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
    """One connection that only receives.

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
        raise BenchFault(_not_finite(packet))
    return packet


def _not_finite(packet: FloatArray) -> str:
    name, ours = next(
        (name, ours) for name, _, ours in _FIELDS if not np.isfinite(packet[pipe.FIELDS[ours]]).all()
    )
    return (
        f"the controller sent the {name} {packet[pipe.FIELDS[ours]].tolist()}, where numbers must be finite: "
        "nothing guards the arm without them; look at the pendant's log, and restart the controller"
    )
