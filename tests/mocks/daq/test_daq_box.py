"""The box at its own end of the cable, asked by plain bytes and without the driver."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mocks.daq.strike_counts import Wiring, skewed
from tests.support.daq_bench import Bench, mocked_box, numbered, numbered_source

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="pseudo-terminals as the mock uses them need Linux"
)

SETUP = b"slist 0 0\rslist 1 1\rsrate 600\rps 4\r"


class Cable:
    """A program's end of the box's port."""

    def __init__(self, port: str) -> None:
        self._end = os.open(port, os.O_RDWR | os.O_NOCTTY)

    def say(self, command: bytes) -> None:
        os.write(self._end, command)

    def hear(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            data += os.read(self._end, count - len(data))
        return data

    def hear_rest(self) -> bytes:
        """What comes until nothing does for 0.1 s."""
        data = b""
        os.set_blocking(self._end, False)
        quiet = time.monotonic()
        while time.monotonic() - quiet < 0.1:
            try:
                data += os.read(self._end, 1 << 16)
                quiet = time.monotonic()
            except BlockingIOError:
                time.sleep(2e-3)
        os.set_blocking(self._end, True)
        return data

    def close(self) -> None:
        os.close(self._end)


@pytest.fixture
def bench() -> Iterator[Bench]:
    with mocked_box(numbered_source) as bench:
        yield bench


@pytest.fixture
def cable(bench: Bench) -> Iterator[Cable]:
    cable = Cable(bench.box.port)
    yield cable
    cable.close()


def test_the_stream_is_the_sources_words_in_scan_list_order(bench: Bench, cable: Cable) -> None:
    cable.say(b"slist 0 1\rslist 1 5\rslist 2 0\rsrate 600\rps 4\r")
    cable.hear(len(b"slist 0 1\r\0slist 1 5\r\0slist 2 0\r\0srate 600\r\0ps 4\r\0"))
    cable.say(b"start 0\r")
    words = np.frombuffer(cable.hear(6 * 2000), "<i2").reshape(-1, 3)
    truth = numbered(np.arange(2000))
    assert np.array_equal(words[:, 0], truth[:, 1])
    assert np.array_equal(words[:, 2], truth[:, 0])
    assert not words[:, 1].any()


def test_the_echo_of_a_stop_comes_behind_all_data(cable: Cable) -> None:
    cable.say(SETUP + b"start 0\r")
    cable.hear(len(SETUP) + 4 + 4000)
    cable.say(b"stop\r")
    rest = cable.hear_rest()
    assert rest.endswith(b"stop\r\0")
    # What is in the box's memory at a stop need not be a whole packet, but it is whole words.
    assert len(rest) % 2 == 0
    cable.say(b"info 6\r")
    assert cable.hear(18) == b"info 6 mock-2108\r\0"


def test_samples_come_at_the_crystals_rate_whenever_they_are_fetched(cable: Cable) -> None:
    cable.say(SETUP + b"start 0\r")
    cable.hear(len(SETUP) + 4)
    began = time.monotonic()
    cable.hear(4 * 25_000)
    took = time.monotonic() - began
    assert took > 0.5 * 0.98  # never before they are due


def test_what_nobody_fetches_is_lost_and_counted() -> None:
    with mocked_box(numbered_source, memory=4096, host_memory=4096) as bench:
        cable = Cable(bench.box.port)
        cable.say(SETUP + b"start 0\r")
        cable.hear(len(SETUP) + 4 + 40_000)
        assert bench.box.lost == 0
        time.sleep(0.5)
        lost = bench.box.lost
        assert 0 < lost < 0.6 * 200e3
        kept = len(cable.hear(8192))
        assert kept == 8192
        cable.close()


def test_a_pulled_cable_hangs_up(bench: Bench, cable: Cable) -> None:
    bench.cue("unplug")
    with pytest.raises(OSError):  # noqa: PT012 - the first read or write after the hang-up fails
        for _ in range(200):
            time.sleep(0.01)
            cable.say(b"info 0\r")
    assert not Path(bench.box.port).exists()


def test_the_port_goes_with_the_box(bench: Bench) -> None:
    bench.child.kill()
    assert not Path(bench.box.port).exists()


@settings(deadline=None)
@given(st.floats(0.0, 1.0), st.floats(0.002, 0.4))
def test_a_converter_that_comes_later_sees_the_signal_later(fraction: float, frequency: float) -> None:
    t = np.arange(600.0)

    def burst(at: np.ndarray) -> np.ndarray:
        return np.exp(-0.5 * ((at - 300.0) / 30.0) ** 2) * np.cos(2 * np.pi * frequency * (at - 300.0))

    assert np.abs(skewed(burst(t), fraction) - burst(t + fraction)).max() < 1e-6


def test_newtons_and_pascals_become_counts() -> None:
    wiring = Wiring(73.0, 1638.0, (120.0, -180.0), (0.0, 0.0))
    counts = wiring.counts(np.array([0.0, 10.0, 1e4]), np.array([0.0, 0.5, -1e4]), np.random.default_rng(0))
    assert counts.tolist() == [[120, -180], [850, 639], [32767, -32768]]
