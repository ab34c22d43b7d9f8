"""The parent's side of the child process: requests with deadlines, the ring of packets, the kill."""

import contextlib
import itertools
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import IO, Any, Final

from drivers.ur import pipe
from harness.basics.arrays import FloatArray
from harness.basics.errors import (
    BenchFault,
    LimitExceeded,
    ProtectiveStop,
    SafetyStop,
    TouchstoneError,
)
from harness.basics.worker_pool import end_process

BEAT_PERIOD: Final = 0.02  # s between heartbeats while a motion is waited for
RING_SECONDS: Final = 60.0
LAST_LINES: Final = 3  # of what the child printed, for the message of a failure
_REFUSALS: Final[dict[str, type[TouchstoneError]]] = {
    kind.__name__: kind for kind in (BenchFault, SafetyStop, ProtectiveStop, LimitExceeded)
}


class DeadlineMissed(Exception):
    """The child did not answer in time."""


class ChildLost(Exception):
    """The child ended, or said that it cannot go on; the text is the reason."""


class Alarmed(Exception):
    """Something else failed while a motion was waited for; the text says what."""


Alarm = Callable[[], str]
"""Why a motion must end, in words; empty while all is well."""


class _Pending:
    """A request that waits for its reply."""

    def __init__(self) -> None:
        self.done = threading.Event()
        self.reply: pipe.Message | None = None


class ChildProcess:
    """A child that answers requests and streams packets.

    ``tell`` and ``answered`` take no lock: they may be called in a signal handler.
    """

    def __init__(self, command: Sequence[str], rate: float, keep: Sequence[int] = ()) -> None:
        """Start it.

        Args:
            command: what to run.
            rate: packets a second, which sizes the ring.
            keep: file descriptors that the child holds open too.
        """
        self._said: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._process = pipe.start_process(command, keep, self._said)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to_child = self._process.stdin.fileno()
        self._from_child = self._process.stdout.fileno()
        pipe.prepare_to_write(self._to_child)
        self._ids = itertools.count(1)
        self._pending: dict[int, _Pending] = {0: _Pending()}
        self._packets: deque[bytes] = deque(maxlen=int(RING_SECONDS * rate))
        self._lost = ""
        self.first: FloatArray | None = None
        self.count = 0
        self._reader = threading.Thread(target=self._read, name="arm replies", daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """Of the child."""
        return self._process.pid

    @property
    def lost(self) -> str:
        """Why the child can no longer serve; empty while it can."""
        return self._lost

    def ready(self, seconds: float) -> Any:
        """The value of the child's first reply, which says that it is connected."""
        return self._await(0, self._pending[0], seconds, beat=False)

    def request(
        self, message: pipe.Message, seconds: float, *, beat: bool = False, alarm: Alarm | None = None
    ) -> Any:
        """Send a request and wait for its value.

        Args:
            message: without its id.
            seconds: the deadline.
            beat: send heartbeats meanwhile, which keep a motion alive.
            alarm: looked at before every heartbeat.

        Raises:
            Alarmed: by ``alarm``; the request goes on.
            DeadlineMissed: no reply in time; the child should be killed.
            ChildLost: the child is gone.
            TouchstoneError: the child's refusal.
        """
        number = next(self._ids)
        pending = self._pending[number] = _Pending()
        self._send({**message, "id": number})
        return self._await(number, pending, seconds, beat=beat, alarm=alarm)

    def tell(self, message: pipe.Message) -> int:
        """Send a request without waiting; its id, for ``answered``."""
        number = next(self._ids)
        self._pending[number] = _Pending()
        self._send({**message, "id": number})
        return number

    def answered(self, number: int) -> bool:
        """Whether a request that was only told has been answered."""
        return self._pending[number].reply is not None

    def newest(self) -> FloatArray | None:
        """The newest packet, ``(pipe.WIDTH,)``, or None before the first."""
        with contextlib.suppress(IndexError):
            newest: FloatArray = pipe.unpack_packets([self._packets[-1]])[0]
            return newest
        return None

    def since(self, start: float) -> FloatArray:
        """``(n, pipe.WIDTH)`` packets of the last minute that arrived at ``start`` (bench clock) or later."""
        packets = pipe.unpack_packets(list(self._packets))
        return packets[packets[:, 0] >= start]

    def end(self, seconds: float) -> None:
        """Close the child's input, so that it stops the arm and ends; kill it after ``seconds``."""
        end_process(self._process, seconds)
        self._collect()

    def kill(self) -> None:
        """End the child at once; the controller's watchdog then stops the arm."""
        self._process.kill()
        self._collect()

    def _collect(self) -> None:
        self._process.wait()
        self._reader.join(timeout=2.0)
        for stream in (self._process.stdin, self._process.stdout, self._said):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()

    def _send(self, message: pipe.Message) -> None:
        try:
            if not pipe.write_now(self._to_child, pipe.message_frame(message)):
                raise DeadlineMissed("the arm's process does not read its requests")
        except (pipe.PipeBroken, ValueError) as error:
            raise ChildLost(self._lost or str(error)) from error

    def _await(
        self, number: int, pending: _Pending, seconds: float, *, beat: bool, alarm: Alarm | None = None
    ) -> Any:
        end = time.monotonic() + seconds
        while not pending.done.wait(BEAT_PERIOD):
            if time.monotonic() > end:
                raise DeadlineMissed(f"the arm's process gave no answer within {seconds:.1f} s")
            if alarm is not None and (reason := alarm()):
                raise Alarmed(reason)
            if beat:
                self._send({"do": "beat"})
        reply = pending.reply
        if reply is None:
            raise ChildLost(self._lost)
        self._pending.pop(number, None)
        if reply["ok"]:
            return reply["value"]
        raise _REFUSALS.get(reply["error"], BenchFault)(reply["text"])

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            for kind, payload in pipe.read_frames(self._from_child):
                if kind == pipe.PACKET:
                    self._packets.append(payload)
                    self.count += 1
                    if self.first is None:
                        self.first = pipe.unpack_packets([payload])[0]
                else:
                    self._take(pipe.unpack_message(payload))
        self._lost = self._lost or self._last_words()
        for pending in list(self._pending.values()):
            pending.done.set()

    def _take(self, reply: pipe.Message) -> None:
        if reply["id"] < 0:
            self._lost = reply["text"]
            return
        pending = self._pending.get(reply["id"])
        if pending is not None:
            pending.reply = reply
            pending.done.set()

    def _last_words(self) -> str:
        """The end of what the child printed, for a child that died without saying why."""
        with contextlib.suppress(OSError, ValueError):
            self._said.seek(0)
            lines = self._said.read()[-4000:].decode(errors="replace").strip().splitlines()
            if lines:
                return "the arm's process ended: " + " / ".join(line.strip() for line in lines[-LAST_LINES:])
        return "the arm's process ended without a word (killed, or crashed in ur_rtde)"
