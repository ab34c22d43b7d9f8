"""The parent's side of the process that fetches a box's stream."""

import contextlib
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.dataq.fetch_child import CUT, EMPTIED, HEADER
from drivers.ur import pipe
from harness.basics.errors import BenchFault

_READY: Final = 20.0
_END: Final = 2.0
_LARGEST: Final = 1 << 20


@dataclass(frozen=True)
class Arrival:
    """What the port held at one moment.

    Attributes:
        time: s on the bench clock.
        data: bytes; none where none came for a while.
        emptied: whether nothing more was waiting behind them.
        cut: why no more can come; empty where more may.
    """

    time: float
    data: bytes
    emptied: bool
    cut: str


class Fetcher:
    """A process that empties a port, from now until ``end``.

    Args:
        port: file descriptor; nobody else may read it meanwhile.

    Raises:
        BenchFault: the process does not begin.
    """

    def __init__(self, port: int) -> None:
        environment = dict(os.environ)
        root = str(Path(__file__).resolve().parents[2])
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [root, environment.get("PYTHONPATH", "")]))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "drivers.dataq.fetch_child", str(port)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            pass_fds=(port,),
            start_new_session=True,
        )
        assert self._process.stdout is not None
        self._out = self._process.stdout.fileno()
        pipe.prepare_to_write(self._out)  # roomy, and never waited for
        self._waiting = bytearray()
        if not self.read(_READY):
            self.end()
            raise BenchFault("the process that fetches the box's samples did not begin; see its words above")

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    def read(self, timeout: float) -> list[Arrival]:
        """What has arrived since the last time; waits at most ``timeout`` s for something."""
        if not select.select([self._out], [], [], timeout)[0]:
            return []
        data = os.read(self._out, _LARGEST)
        if not data:
            return [Arrival(0.0, b"", False, "the process that fetches its samples ended")]
        self._waiting += data
        return list(self._frames())

    def end(self) -> None:
        """End the process; the port is this program's again."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _frames(self) -> Iterator[Arrival]:
        start = 0
        while len(self._waiting) - start >= HEADER.size:
            time, kind, length = HEADER.unpack_from(self._waiting, start)
            end = start + HEADER.size + length
            if len(self._waiting) < end:
                break
            data = bytes(self._waiting[start + HEADER.size : end])
            cut = data.decode("utf-8", "replace") if kind == CUT else ""
            yield Arrival(time, b"" if cut else data, kind == EMPTIED, cut)
            start = end
        del self._waiting[:start]
