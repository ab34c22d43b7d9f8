"""Packets of the real-time data exchange (Universal Robots, RTDE guide): big-endian, three-byte header."""

import struct
from collections.abc import Iterator
from enum import IntEnum
from typing import Final

HEADER: Final = struct.Struct(">HB")
TYPES: Final = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
}
SCALARS: Final = frozenset(("BOOL", "UINT8", "UINT32", "UINT64", "INT32", "DOUBLE"))
NOT_FOUND: Final = "NOT_FOUND"
IN_USE: Final = "IN_USE"


class Kind(IntEnum):
    """Packet types: the ASCII codes of V, v, M, U, O, I, S and P."""

    PROTOCOL_VERSION = 86
    CONTROL_VERSION = 118
    TEXT = 77
    DATA = 85
    SETUP_OUTPUTS = 79
    SETUP_INPUTS = 73
    START = 83
    PAUSE = 80


class BadPacket(Exception):
    """Bytes that cannot be a packet; what follows cannot be told apart."""


class Packets:
    """Cuts a stream into packets."""

    def __init__(self) -> None:
        self._waiting = b""

    def feed(self, data: bytes) -> Iterator[tuple[int, bytes]]:
        """(type, payload) of each whole packet.

        Raises:
            BadPacket: a size below that of the header.
        """
        self._waiting += data
        while len(self._waiting) >= HEADER.size:
            size, kind = HEADER.unpack_from(self._waiting)
            if size < HEADER.size:
                raise BadPacket(f"a packet of {size} bytes")
            if len(self._waiting) < size:
                return
            payload, self._waiting = self._waiting[HEADER.size : size], self._waiting[size:]
            yield kind, payload


def packet(kind: Kind, payload: bytes = b"") -> bytes:
    """One packet."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def text_message(message: str, level: int = 1) -> bytes:
    """A text for the client; level 0 exception, 1 error, 2 warning, 3 info."""
    text, source = message.encode()[:255], b"controller"
    return packet(Kind.TEXT, bytes((len(text),)) + text + bytes((len(source),)) + source + bytes((level,)))


def layout(types: list[str]) -> struct.Struct:
    """The bytes of values of these types."""
    return struct.Struct(">" + "".join(TYPES[name] for name in types))


def names_in(payload: bytes) -> list[str]:
    """Variable names; an empty one behind a trailing comma is none."""
    return [name.strip() for name in payload.decode("ascii", "replace").split(",") if name.strip()]
