"""A stream that is whole, late, short or out of order, on a clock of the test's own."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.dataq.link import MODELS
from drivers.dataq.monitor import PROMPT, STEADY, STEADY_COUNT, Rests, StreamMonitor
from harness.basics.arrays import AnyArray

RATE = 50e3
STEP = 128
OFFSETS = np.array([120.0, -180.0])


class Stream:
    """Sends blocks of ``STEP`` scans to a monitor when they are full."""

    def __init__(self, seed: int, ppm: float = 0.0) -> None:
        self._rng = np.random.default_rng(seed)
        self.monitor = StreamMonitor(RATE, MODELS["DI-2108"], Rests(OFFSETS, 60.0))
        self.taken = 0
        self.sent = 0
        self._rate = RATE * (1.0 + 1e-6 * ppm)
        self.swap = False
        self.ahead = 0.0

    def lose(self, scans: int) -> None:
        self.taken += scans

    def run(self, seconds: float, late: float = 0.0, emptied: bool = True) -> None:
        for _ in range(round(seconds * self._rate / STEP)):
            self.taken += STEP
            words = np.rint(self._rng.normal(size=(STEP, 2)) * (2.0, 30.0) + OFFSETS).astype(np.int16)
            self.sent += STEP
            time = 50.0 + self.taken / self._rate + late + self._rng.exponential(2e-4)
            self.monitor.take(self._wired(words), self.sent, time, emptied)

    def _wired(self, words: AnyArray) -> AnyArray:
        return words[:, ::-1] if self.swap else words


@settings(deadline=None, max_examples=10)
@given(st.floats(-100.0, 100.0), st.integers(0, 2**31))
def test_a_whole_stream_is_proven_whole(ppm: float, seed: int) -> None:
    stream = Stream(seed, ppm)
    stream.run(4.0)
    assert stream.monitor.fault == ""
    assert stream.monitor.prompt > stream.sent - 10 * STEP
    assert stream.monitor.ordered > stream.sent - 0.06 * RATE


@settings(deadline=None, max_examples=10)
@given(st.integers(int(1.2 * PROMPT * RATE), int(RATE)), st.integers(0, 2**31))
def test_missing_samples_are_noticed_and_counted(lost: int, seed: int) -> None:
    stream = Stream(seed, 60.0)
    stream.run(2.0)
    stream.lose(lost)
    before = stream.sent
    stream.run((STEADY_COUNT + 1) * STEADY)
    assert "samples" in stream.monitor.fault
    named = float(stream.monitor.fault.split("about ")[1].split(" ")[0])
    assert named == pytest.approx(lost, abs=0.002 * RATE)
    assert stream.monitor.prompt <= before


def test_a_host_that_is_slow_and_catches_up_has_lost_nothing() -> None:
    stream = Stream(3)
    stream.run(2.0)
    stream.run(0.8, late=0.3)
    assert stream.monitor.fault == ""
    stream.run(0.5)
    assert stream.monitor.fault == ""
    assert stream.monitor.prompt > stream.sent - 10 * STEP


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**31))
def test_a_sender_that_falls_behind_and_comes_back_has_lost_nothing(seed: int) -> None:
    stream, rng = Stream(seed), np.random.default_rng(seed)
    stream.run(2.0)
    for late in rng.uniform(0.05, 2.0, 40):
        stream.run(0.1, late=late)
    assert stream.monitor.fault == ""
    stream.run(0.5)
    assert stream.monitor.prompt > stream.sent - 10 * STEP


def test_a_port_that_is_not_emptied_says_nothing_about_time() -> None:
    stream = Stream(4)
    stream.run(2.0)
    stream.run(3.0, late=2.0, emptied=False)
    assert stream.monitor.fault == ""


def test_a_rate_far_from_nominal_is_not_taken_for_a_loss() -> None:
    stream = Stream(5, ppm=300.0)
    stream.run(10.0)
    assert stream.monitor.fault == ""
    assert stream.monitor.clock.fit().rate == pytest.approx(RATE * 1.0003, rel=2e-5)


def test_swapped_channels_are_noticed() -> None:
    stream = Stream(6)
    stream.run(1.0)
    stream.swap = True
    before = stream.sent
    stream.run(0.2)
    assert "a word" in stream.monitor.fault
    assert stream.monitor.ordered < before + 0.06 * RATE


def test_offsets_too_alike_to_tell_a_swap_are_known_as_such() -> None:
    assert Rests(OFFSETS, 60.0).distinct
    assert not Rests(np.array([10.0, 60.0]), 60.0).distinct
