"""Perform an experiment step by step, committing each, and stop when told to."""

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Protocol, TypeVar

from harness.basics.clock import now
from harness.bench.device import Reading
from harness.recording.recording import Recording
from harness.recording.step_file import Step

B = TypeVar("B", contravariant=True)


class StepPerformer(Protocol[B]):
    """What a session needs of an experiment on a bench of type ``B``."""

    def steps(self, recording: Recording) -> Iterator[Step]:
        """The steps still to perform; may look at what has been recorded so far."""

    def perform(self, step: Step, bench: B) -> Sequence[Reading]:
        """Touch the hardware; everything read is returned, nothing else is kept."""


class Progress(Protocol):
    """Told as steps begin and end."""

    def began(self, step: Step) -> None:
        """A step is about to be performed."""

    def ended(self, step: Step, seconds: float) -> None:
        """A step is on the disk."""


class Quiet:
    """A progress that reports nothing."""

    def began(self, step: Step) -> None:
        """Nothing."""

    def ended(self, step: Step, seconds: float) -> None:
        """Nothing."""


@contextmanager
def interruptible(stop_arm: Callable[[], None]) -> Iterator[threading.Event]:
    """Take over Ctrl-C for the length of a session (in the main thread; elsewhere it stays as it is).

    Once: the event is set, and the session ends after the step. Twice: the arm stops now.
    """
    requested = threading.Event()

    def handle(_signal: int, _frame: FrameType | None) -> None:
        if requested.is_set():
            stop_arm()
            raise KeyboardInterrupt
        requested.set()

    if threading.current_thread() is not threading.main_thread():
        yield requested
        return
    previous = signal.signal(signal.SIGINT, handle)
    try:
        yield requested
    finally:
        signal.signal(signal.SIGINT, previous)


def perform(
    experiment: StepPerformer[B],
    bench: B,
    recording: Recording,
    stop_arm: Callable[[], None],
    progress: Progress,
) -> bool:
    """Perform and commit every remaining step; False where Ctrl-C ended it early.

    A step that fails is not committed and its exception goes on to the caller; the steps
    before it stay on the disk.
    """
    with interruptible(stop_arm) as interrupted:
        for step in experiment.steps(recording):
            if interrupted.is_set():
                return False
            progress.began(step)
            start = now()
            readings = experiment.perform(step, bench)
            seconds = now() - start
            recording.commit(step, readings, seconds)
            progress.ended(step, seconds)
    return not interrupted.is_set()
