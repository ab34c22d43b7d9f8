"""The process that owns ur_rtde: ``python -m drivers.ur.child`` with frames on its standard streams.

The parent may kill it at any moment: the controller's watchdog then stops the arm. When the
parent dies, its end of the pipe closes, and this process stops the arm and ends.
"""

import argparse
import contextlib
import os
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Final

from drivers.ur import dashboard, pipe
from drivers.ur import state as ur_state
from drivers.ur.link import PATIENCE, Link, Watchdog
from drivers.ur.motion import Motion, Outcome
from drivers.ur.program_watch import foreign_program_text
from drivers.ur.safety import require_loopback
from drivers.ur.stream import Stream
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, ProtectiveStop, SafetyStop, TouchstoneError
from harness.basics.starvation import name_cause

TICK: Final = 0.002  # s between looks at a motion
REST_TICK: Final = 0.01
# In units of the watchdog's patience, 0.1 s at a real bench:
STALE: Final = 0.5  # without a packet: nothing is commanded, the watchdog is not kicked
LOST_MOVING: Final = 5.0  # without a packet during a motion: give up
LOST_AT_REST: Final = 20.0
BEAT_LATE: Final = 3.0  # without a heartbeat during a motion: stop


class Child:
    """Serves requests one by one; one motion at a time; a stop request at any moment."""

    def __init__(self, link: Link, requests: int, replies: int) -> None:
        self._link = link
        self._parent = Parent(requests, replies, self._stop_hard)
        self._stream = Stream(link, self._parent.send_packet, self._parent.wake)
        self._motion: Motion | None = None
        self._latched: TouchstoneError | None = None
        self._watchdog = Watchdog(link)
        self._patience = link.patience

    def run(self, model: str) -> None:
        """Connect, then serve until the parent closes the pipe or the link is lost."""
        self._parent.listen()
        try:
            controller = self._link.connect(model)
            self._stream.start()
            self._link.arm()
        except TouchstoneError as error:
            self._parent.refuse(0, error)
            return
        self._watchdog.start()
        self._parent.answer(0, [controller.model, controller.serial, controller.version])
        try:
            while not self._parent.closed:
                self._tick()
        except (TouchstoneError, RuntimeError) as error:
            self._give_up(error)
        else:
            self._leave()

    def _tick(self) -> None:
        message = self._parent.next(TICK if self._motion else REST_TICK)
        self._check_programs()
        if message is not None:
            self._serve(message)
        self._stream.require_younger((LOST_MOVING if self._motion else LOST_AT_REST) * self._patience)
        self._check_safety()
        self._check_script()
        if self._motion is not None:
            self._watch(self._motion)
        self._kick()

    # Requests

    def _serve(self, message: pipe.Message) -> None:
        try:
            match message["do"]:
                case "stop":
                    self._stop(message)
                case "move":
                    self._start(message)
                case "zero_force":
                    self._zero_force()
                    self._parent.answer(message["id"], True)
                case "tool_output":
                    self._switch(message["index"], message["on"])
                    self._parent.answer(message["id"], True)
                case unknown:
                    raise BenchFault(f"the arm's process was asked to '{unknown}', which it does not know")
        except TouchstoneError as error:
            self._parent.refuse(message["id"], error)

    def _stop(self, message: pipe.Message) -> None:
        if self._motion is not None:
            self._motion.stop(
                self._link, Outcome(error=SafetyStop(f"{self._motion.what} was stopped by request"))
            )
        self._parent.answer(message["id"], True)

    def _start(self, message: pipe.Message) -> None:
        if message["epoch"] < self._parent.epoch:
            raise SafetyStop("a stop was requested before this motion began; it was not sent")
        self._require_calm("move")
        motion = Motion.from_message(message, self._stream.force)
        if motion.pose is not None and not self._reachable(motion.pose, motion.near):
            raise BenchFault(
                f"{motion.what}: the controller finds no joints for the target; nothing was moved"
            )
        self._parent.expect_beats()
        self._stream.watch(motion.guard)
        self._stream.moving = True
        self._motion = motion
        try:
            motion.start(self._link)
        except TouchstoneError:
            self._end_motion()
            raise

    def _reachable(self, pose: list[float], near: list[float]) -> bool:
        """Ask the controller; once more where this computer's own delay ended the script that was asked.

        Nothing has begun to move yet, so asking twice does nothing twice.
        """
        try:
            return self._link.reachable(pose, near)
        except RuntimeError:
            self._check_script()
            if not self._link.program_running():
                raise
            return self._link.reachable(pose, near)

    def _zero_force(self) -> None:
        self._require_calm("zero the force sensor")
        if not self._comes_to_rest(0.2):
            raise BenchFault("the force sensor was not zeroed: the arm is not at rest; wait and ask again")
        self._link.zero_force()

    def _switch(self, index: int, on: bool) -> None:
        """On by an arm that nothing has latched, as what is at the tool may move by it; off always."""
        if on:
            self._require_unlatched()
        self._link.set_tool_output(index, on)

    def _require_unlatched(self) -> None:
        if self._latched is not None:
            raise self._latched

    def _require_calm(self, what: str) -> None:
        self._require_unlatched()
        if self._motion is not None:
            raise BenchFault(f"the arm was asked to {what} during a motion; wait for it to end")
        if not self._stream.becomes_younger(STALE * self._patience, LOST_MOVING * self._patience):
            raise BenchFault(
                f"the arm was asked to {what}, but its state is {1e3 * self._stream.age:.0f} ms old "
                f"(limit {1e3 * STALE * self._patience:.0f} ms); "
                + name_cause("check this computer's load and the network", self._stream.changed)
            )

    def _comes_to_rest(self, seconds: float) -> bool:
        """Whether the arm is at rest within some seconds; the watchdog is kicked meanwhile."""
        end = now() + seconds
        while not self._stream.at_rest and now() < end:
            self._kick()
            time.sleep(TICK)
        return self._stream.at_rest

    # What goes on meanwhile

    def _watch(self, motion: Motion) -> None:
        late = self._parent.late
        if late > BEAT_LATE * self._patience and not motion.stopping:
            limit = 1e3 * BEAT_LATE * self._patience
            text = (
                f"{motion.what} was stopped: the program that asked for it was frozen or this computer too "
                f"busy: it fell behind by {1e3 * late:.0f} ms (limit {limit:.0f} ms); see what held it up, "
                "then open the arm again"
            )
            motion.stop(self._link, Outcome(error=BenchFault(text), latch=True))
        outcome = motion.look(self._link, self._stream)
        if outcome is None:
            return
        if outcome.latch and outcome.error is not None:
            self._latch(outcome.error)
            return
        self._end_motion()
        if outcome.error is not None:
            self._parent.refuse(motion.id, outcome.error)
        else:
            self._parent.answer(motion.id, outcome.value)

    def _end_motion(self) -> None:
        self._motion = None
        self._stream.moving = False
        self._stream.watch(None)

    def _check_safety(self) -> None:
        """Latch a stop of the controller's, and end the program, so that no release resumes the motion."""
        safety = self._stream.safety
        if safety in ("normal", "reduced") or isinstance(self._latched, ProtectiveStop):
            return
        self._latch(ProtectiveStop(ur_state.stopped_by_controller(self._stream.newest, self._during)))

    def _check_programs(self) -> None:
        """Latch a program that somebody else started; the link has ended it already."""
        program = self._link.foreign_program()
        if program and self._latched is None:
            self._latch(SafetyStop(foreign_program_text(self._link.address, program, self._during)))

    @property
    def _during(self) -> str:
        return f"during {self._motion.what}" if self._motion is not None else "at rest"

    def _latch(self, error: TouchstoneError) -> None:
        """Refuse the motion and all later ones, and end the program."""
        self._latched = error
        if self._motion is not None:
            self._parent.refuse(self._motion.id, error)
            self._end_motion()
        with contextlib.suppress(BenchFault):
            self._link.halt()

    def _check_script(self) -> None:
        """Start the script again if this computer's own delay let the watchdog end it; at rest only.

        A motion that it was cut out of is latched, and so is an end that somebody else made.
        """
        self._watchdog.look()
        if self._motion or self._latched or self._link.program_running():
            return
        if not self._watchdog.bit:
            self._latch_the_end()
        elif self._stream.at_rest:
            self._link.revive()
            self._watchdog.start()
            self._stream.restarts += 1

    def _latch_the_end(self) -> None:
        """Of a script at rest, once the state says what ended it; the controller's stops latch themselves."""
        if not self._link.state_is_older():
            cause = self._link.why()
            if not isinstance(cause, ProtectiveStop):
                self._latch(cause)

    def _kick(self) -> None:
        if self._stream.age <= STALE * self._patience:
            self._watchdog.kick()

    # The end

    def _give_up(self, error: Exception) -> None:
        try:
            # Before the halt, which ends the program whose state says why.
            fault = error if isinstance(error, TouchstoneError) else self._named(error)
        finally:
            # Nothing that words may run into keeps the arm from being halted.
            with contextlib.suppress(BenchFault):
                self._link.halt()
        self._parent.refuse(-1, fault)

    def _named(self, error: Exception) -> TouchstoneError:
        """What the controller's state says about a call of the library that failed."""
        cause = self._link.why()
        return type(cause)(f"ur_rtde failed ({error}); {cause}")

    def _stop_hard(self) -> None:
        """The main thread is stuck in the library, and nobody is left to kill it."""
        with contextlib.suppress(BenchFault):
            dashboard.stop(self._link.address)
        os._exit(1)

    def _leave(self) -> None:
        """Stop, end the script. Sockets are closed by the exit: disconnecting takes 0.5 s an interface."""
        with contextlib.suppress(TouchstoneError, RuntimeError):
            if self._motion is not None:
                self._motion.stop(self._link, Outcome(error=SafetyStop("the program ended")))
                self._comes_to_rest(0.5)
            self._link.end_script()


def main() -> None:
    """Serve one arm until standard input closes."""
    parser = argparse.ArgumentParser(description="Owns ur_rtde for one arm; started by the arm driver.")
    parser.add_argument("--address", required=True)
    parser.add_argument("--model", required=True)
    parser.add_argument("--rate", type=float, required=True)
    parser.add_argument("--patience", type=float, default=PATIENCE)
    arguments = parser.parse_args()
    require_loopback(arguments.address)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    replies = os.dup(sys.stdout.fileno())
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # ur_rtde prints; that must not enter the frames
    pipe.prepare_to_write(replies)
    child = Child(Link(arguments.address, arguments.rate, arguments.patience), sys.stdin.fileno(), replies)
    child.run(arguments.model)
    os._exit(0)  # the library's destructors race with its threads and crash


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


if __name__ == "__main__":
    main()
