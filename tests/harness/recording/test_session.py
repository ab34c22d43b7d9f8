"""Steps are committed one by one; Ctrl-C once ends after the step, twice stops the arm."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import BenchFault
from harness.bench.device import Channel, Reading
from harness.recording.recording import Recording, RunHeader
from harness.recording.session import Quiet, perform
from harness.recording.step_file import Step

CHANNEL = Channel("arm.joints", "rad", (6,), "float64")


class Counting:
    """Five steps that read their own index; something may happen in each."""

    def __init__(self, during: Callable[[int], None] = lambda index: None) -> None:
        self.during = during
        self.performed: list[int] = []

    def steps(self, recording: Recording) -> Iterator[Step]:
        for index in range(recording.committed, 5):
            yield Step(index, "press", {})

    def perform(self, step: Step, bench: None) -> Sequence[Reading]:
        self.performed.append(step.index)
        self.during(step.index)
        return [Reading(CHANNEL, np.array([1.0]), np.full((1, 6), float(step.index)))]


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    header = RunHeader("test", {}, {}, {}, {}, {}, 0, None, 0, "2026-01-01T00:00:00+00:00")
    return Recording.create(tmp_path / "run", header)


def stop() -> None:
    stopped.append(True)


stopped: list[bool] = []


def test_every_step_is_performed_and_committed(recording: Recording) -> None:
    assert perform(Counting(), None, recording, stop, Quiet())
    assert recording.committed == 5


def test_a_failing_step_keeps_those_before_it_and_resume_goes_on(recording: Recording) -> None:
    def fail(index: int) -> None:
        if index == 3:
            raise BenchFault("the cable came off")

    with pytest.raises(BenchFault):
        perform(Counting(fail), None, recording, stop, Quiet())
    assert recording.committed == 3
    again = Counting()
    assert perform(again, None, recording, stop, Quiet())
    assert again.performed == [3, 4]


def test_one_interrupt_ends_after_the_step(recording: Recording) -> None:
    def interrupt(index: int) -> None:
        if index == 1:
            os.kill(os.getpid(), signal.SIGINT)

    assert not perform(Counting(interrupt), None, recording, stop, Quiet())
    assert recording.committed == 2


def test_two_interrupts_stop_the_arm(recording: Recording) -> None:
    def interrupt(index: int) -> None:
        if index == 1:
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)

    stopped.clear()
    with pytest.raises(KeyboardInterrupt):
        perform(Counting(interrupt), None, recording, stop, Quiet())
    assert stopped == [True]
    assert recording.committed == 1


def test_the_interrupt_handler_is_put_back(recording: Recording) -> None:
    before = signal.getsignal(signal.SIGINT)
    perform(Counting(), None, recording, stop, Quiet())
    assert signal.getsignal(signal.SIGINT) is before
