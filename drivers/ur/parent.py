"""The program that owns the arm's process, as that process sees it: requests in, packets and answers out."""

import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Final

from drivers.ur import pipe
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import TouchstoneError

LAST_WORDS: Final = 1.5  # s that this process may take to stop the arm when its parent is gone

_LONGEST: Final = 2000  # characters of an error's text that are sent


class Parent:
    """The far ends of two pipes.

    Args:
        requests: file descriptor that is read.
        replies: file descriptor that is written.
        stop_hard: what to do when the parent is gone and this process has not ended ``LAST_WORDS`` later.
    """

    def __init__(self, requests: int, replies: int, stop_hard: Callable[[], None]) -> None:
        self._requests, self._replies, self._stop_hard = requests, replies, stop_hard
        self._inbox: queue.SimpleQueue[pipe.Message | None] = queue.SimpleQueue()
        self._beat = now()
        self.closed = False
        self.epoch = 0  # of the latest stop: motions asked for before it are not begun

    @property
    def late(self) -> float:
        """Seconds since the last heartbeat, or since they were last waited for."""
        return now() - self._beat

    def expect_beats(self) -> None:
        """Heartbeats count from now on."""
        self._beat = now()

    def listen(self) -> None:
        """Take requests from now on, in a thread of their own."""
        threading.Thread(target=self._read, name="requests", daemon=True).start()

    def wake(self) -> None:
        """Let who waits for a request go on without one."""
        self._inbox.put(None)

    def next(self, seconds: float) -> pipe.Message | None:
        """The next request; None if none came in time, or something else woke this process."""
        with contextlib.suppress(queue.Empty):
            return self._inbox.get(timeout=seconds)
        return None

    def send_packet(self, packet: FloatArray) -> None:
        """Hand on what the arm told of itself."""
        pipe.write_now(self._replies, pipe.packet_frame(packet))

    def answer(self, request: int, value: object) -> None:
        """A request was done."""
        self._reply({"id": request, "ok": True, "value": value})

    def refuse(self, request: int, error: TouchstoneError) -> None:
        """A request failed; -1 stands for all that will ever come."""
        text = str(error)[:_LONGEST]
        self._reply({"id": request, "ok": False, "error": type(error).__name__, "text": text})

    def _reply(self, message: pipe.Message) -> None:
        with contextlib.suppress(pipe.PipeBroken):
            pipe.write_within(self._replies, pipe.message_frame(message), 0.5)

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            for _, payload in pipe.read_frames(self._requests):
                message = pipe.unpack_message(payload)
                if message["do"] == "beat":
                    self._beat = now()
                    continue
                if message["do"] == "stop":
                    self.epoch = max(self.epoch, message["epoch"])
                self._inbox.put(message)
        self.closed = True
        self.wake()
        threading.Timer(LAST_WORDS, self._stop_hard).start()
