"""Frames between the arm driver and the child process that owns ur_rtde.

A frame is one byte of kind, two of length and the payload, and never longer than
``PIPE_BUF``: POSIX then promises that a write to a non-blocking pipe happens whole or not
at all (write(2)), so any thread, and a signal handler, may write without a lock.
"""

import json
import os
import select
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from harness.basics.arrays import FloatArray

if sys.platform == "linux":
    import fcntl

HEADER: Final = struct.Struct("<BH")
MESSAGE: Final = 1
PACKET: Final = 2
LONGEST: Final = select.PIPE_BUF - HEADER.size
PIPE_BYTES: Final = 1 << 20  # four seconds of packets at 500 Hz, should the reader be held up

Message = dict[str, Any]
"""One JSON object."""

FIELDS: Final = {
    "time": slice(0, 1),
    "controller_time": slice(1, 2),
    "joints": slice(2, 8),
    "joint_speeds": slice(8, 14),
    "pose": slice(14, 20),
    "wrench": slice(20, 26),
    "safety_bits": slice(26, 27),
    "status_bits": slice(27, 28),
    "runtime_state": slice(28, 29),
    "robot_mode": slice(29, 30),
    "output_bits": slice(30, 31),
    "moving": slice(31, 32),
    "drops": slice(32, 33),
    "restarts": slice(33, 34),
}
"""Where each quantity lies in a packet of the arm's state (all float64, SI)."""
WIDTH: Final = 34


class PipeBroken(Exception):
    """The other end is gone, or has not read for so long that the pipe is full."""


def start_process(
    command: Sequence[str], keep: Sequence[int], errors: IO[bytes] | None = None
) -> subprocess.Popen[bytes]:
    """Start a program of this checkout in a session of its own, with pipes to its input and from its output.

    Args:
        command: as for ``subprocess``.
        keep: file descriptors that stay open in it.
        errors: file for what it writes to standard error; None for this program's own.
    """
    environment = dict(os.environ)
    root = str(Path(__file__).resolve().parents[2])
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [root, environment.get("PYTHONPATH", "")]))
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        env=environment,
        pass_fds=tuple(keep),
        start_new_session=True,
    )


def message_frame(message: Message) -> bytes:
    """A JSON object as a frame; ``ValueError`` where it is too long or not finite."""
    payload = json.dumps(message, allow_nan=False, separators=(",", ":")).encode()
    if len(payload) > LONGEST:
        raise ValueError(f"a message of {len(payload)} bytes; a frame holds {LONGEST}")
    return HEADER.pack(MESSAGE, len(payload)) + payload


def packet_frame(packet: FloatArray) -> bytes:
    """A ``(WIDTH,)`` packet as a frame."""
    payload = packet.astype("<f8").tobytes()
    return HEADER.pack(PACKET, len(payload)) + payload


def unpack_packets(payloads: list[bytes]) -> FloatArray:
    """``(n, WIDTH)`` of the payloads of packet frames."""
    return np.frombuffer(b"".join(payloads), dtype="<f8").astype(np.float64).reshape(-1, WIDTH)


def unpack_message(payload: bytes) -> Message:
    """The JSON object of a message frame's payload."""
    message: Message = json.loads(payload)
    return message


def prepare_to_write(descriptor: int) -> None:
    """Make a pipe non-blocking, and roomy where the system allows."""
    os.set_blocking(descriptor, False)
    if sys.platform == "linux":
        fcntl.fcntl(descriptor, fcntl.F_SETPIPE_SZ, PIPE_BYTES)


def write_now(descriptor: int, frame: bytes) -> bool:
    """Write a frame whole, or return False where the pipe is full.

    Raises:
        PipeBroken: the other end is closed.
    """
    try:
        os.write(descriptor, frame)
    except BlockingIOError:
        return False
    except OSError as error:
        raise PipeBroken("the other end of the pipe is closed") from error
    return True


def write_within(descriptor: int, frame: bytes, seconds: float) -> None:
    """Write a frame, waiting at most ``seconds`` for room; ``PipeBroken`` after that."""
    end = time.monotonic() + seconds
    while not write_now(descriptor, frame):
        if time.monotonic() > end:
            raise PipeBroken(f"the other end has not read for {seconds:g} s")
        time.sleep(0.001)


def read_frames(descriptor: int) -> Iterator[tuple[int, bytes]]:
    """(kind, payload) of each frame, blocking, until end of file."""
    waiting = b""
    while arrived := os.read(descriptor, 1 << 16):
        waiting += arrived
        start = 0
        while len(waiting) - start >= HEADER.size:
            kind, length = HEADER.unpack_from(waiting, start)
            end = start + HEADER.size + length
            if len(waiting) < end:
                break
            yield kind, waiting[start + HEADER.size : end]
            start = end
        waiting = waiting[start:]
