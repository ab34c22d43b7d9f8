"""The program that plays on the null sink: as it is, at a time, meanwhile; on a library that a test calls."""

import os
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mocks.sound_card.player
from harness.basics.arrays import AnyArray
from mocks.sound_card.player import AT_ONCE, MEANWHILE, Queue

RATE, FRAMES = 48000, 512
AHEAD = 0.05


class Library:
    """Asks for blocks on time, on a clock that the test reads."""

    def __init__(self, queue: Queue, patch: pytest.MonkeyPatch) -> None:
        self.queue, self.time = queue, 500.0
        self.said: list[bytes] = []
        patch.setattr(mocks.sound_card.player, "now", lambda: self.time)
        patch.setattr(os, "write", lambda _, word: self.said.append(word))
        self.first = self.time + AHEAD

    def block(self, jump: float = 0.0) -> AnyArray:
        self.time += jump
        raw = bytearray(4 * FRAMES)
        times = SimpleNamespace(outputBufferDacTime=9.0 + AHEAD, currentTime=9.0)
        self.queue.fill(memoryview(raw), FRAMES, times, SimpleNamespace(output_underflow=False))
        self.time += FRAMES / RATE
        return np.frombuffer(bytes(raw), np.int32)

    def blocks(self, count: int) -> AnyArray:
        return np.concatenate([self.block() for _ in range(count)])


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Library:
    return Library(Queue(RATE, 1), monkeypatch)


def column(counts: AnyArray) -> AnyArray:
    return np.asarray(counts, np.int32).reshape(-1, 1)


def pulse(at: AnyArray) -> AnyArray:
    """Of 2 kHz at most, so that it is the same between two samples."""
    value: AnyArray = np.rint(2**28 * np.exp(-0.5 * ((at - 100.0) / 12.0) ** 2))
    return value


def test_what_is_played_at_once_comes_sample_by_sample_one_after_the_other(library: Library) -> None:
    first, second = (np.random.default_rng(k).integers(-(2**31), 2**31, 700) for k in (1, 2))
    library.block()
    for counts in (first, second):
        library.queue.take(AT_ONCE, column(counts))
    heard = library.blocks(4)
    np.testing.assert_array_equal(heard[:1400], np.concatenate([first, second]))
    assert not np.any(heard[1400:])


def test_meanwhile_is_repeated_and_gives_way(library: Library) -> None:
    library.queue.take(MEANWHILE, column(np.arange(1, 101)))
    np.testing.assert_array_equal(library.block(), 1 + np.arange(FRAMES) % 100)
    library.queue.take(AT_ONCE, column(np.full(10, -5)))
    heard = library.block()
    assert np.all(heard[:10] == -5)
    np.testing.assert_array_equal(heard[10:], 1 + (FRAMES + np.arange(10, FRAMES)) % 100)


@settings(deadline=None, max_examples=30)
@given(st.floats(0.02, 0.1))
def test_a_sound_begins_when_it_was_asked_to_to_a_fraction_of_a_sample(ahead: float) -> None:
    with pytest.MonkeyPatch.context() as patch:
        library = Library(Queue(RATE, 1), patch)
        library.blocks(3)
        at = library.time + AHEAD + ahead
        library.queue.take(at, column(pulse(np.arange(200.0))))
        heard = library.blocks(14)
        times = library.first + (3 * FRAMES + np.arange(len(heard))) / RATE
        expected = pulse((times - at) * RATE)
        assert np.abs(heard - expected).max() < 3e-4 * 2**28
        assert library.said == []


def test_what_comes_too_late_is_played_and_said(library: Library) -> None:
    library.blocks(3)
    library.queue.take(library.time, column(pulse(np.arange(200.0))))
    assert library.blocks(1).max() > 2**27
    assert library.said == [b"!"]


def test_after_a_gap_the_device_s_new_time_is_believed(library: Library) -> None:
    library.blocks(50)
    library.block(jump=0.03)
    library.blocks(10)
    at = library.time + AHEAD + 0.02
    library.queue.take(at, column(pulse(np.arange(200.0))))
    begun = library.time + AHEAD
    heard = library.blocks(6)
    peak = begun + int(np.argmax(heard)) / RATE
    assert peak == pytest.approx(at + 100.0 / RATE, abs=1.1 / RATE)
