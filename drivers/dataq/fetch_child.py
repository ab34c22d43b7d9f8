"""The process that fetches a box's stream: ``python -m drivers.dataq.fetch_child PORT_DESCRIPTOR``.

The box's memory holds a fiftieth of a second, and a program that compiles, plans or estimates keeps
its interpreter's lock for longer than that. So a process of its own does nothing but empty the port
and say when. It tells the box to stop and ends when its standard input closes, as it does when the
program that began it dies.
"""

import contextlib
import os
import select
import struct
import sys
import time
from typing import Final

HEADER: Final = struct.Struct("<dBI")
"""Of a frame on standard output: bench-clock s of arrival, what it is, bytes that follow."""

PARTIAL: Final = 0
EMPTIED: Final = 1
CUT: Final = 2
"""What a frame is: bytes after which more were waiting; bytes (or none) that emptied the port; the reason
in words why no more can come."""

BEAT: Final = 0.05
"""s without a byte after which an empty frame says that none came."""

_LARGEST: Final = 1 << 16
_PUNCTUAL: Final = -10
_STOP: Final = b"stop\r"


def main() -> None:
    """Fetch until the parent is gone or the port is cut."""
    port, parent, out = int(sys.argv[1]), sys.stdin.fileno(), sys.stdout.fileno()
    with contextlib.suppress(OSError):  # only where the system lets us
        os.setpriority(os.PRIO_PROCESS, 0, _PUNCTUAL)
    os.set_blocking(port, False)
    os.set_blocking(out, False)
    waiting = bytearray(_frame(EMPTIED, b""))  # says that fetching has begun
    kind, beat = EMPTIED, time.monotonic()
    while kind != CUT:
        readable, _, _ = select.select([port, parent], [out] if waiting else [], [], BEAT)
        if parent in readable:
            with contextlib.suppress(OSError):
                os.write(port, _STOP)
            return
        if port in readable or time.monotonic() - beat > BEAT:
            kind, data = _fetch(port) if port in readable else (EMPTIED, b"")
            waiting += _frame(kind, data)
            beat = time.monotonic()
        os.set_blocking(out, kind == CUT)  # the last words are waited for
        with contextlib.suppress(BlockingIOError):
            while waiting:
                del waiting[: os.write(out, waiting)]


def _fetch(port: int) -> tuple[int, bytes]:
    """Everything that has arrived; a terminal that hangs up is readable and yet empty."""
    data = bytearray()
    try:
        while len(data) < _LARGEST and (new := os.read(port, _LARGEST)):
            data += new
    except BlockingIOError:
        pass
    except OSError as error:
        return CUT, (error.strerror or str(error)).encode()
    if not data:
        return CUT, b"it hung up"
    return (EMPTIED if len(data) < _LARGEST else PARTIAL), bytes(data)


def _frame(kind: int, data: bytes) -> bytes:
    return HEADER.pack(time.monotonic(), kind, len(data)) + data


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):  # the parent is gone
        main()
