"""What goes wrong between the acquisition box and the driver is noticed, and named with what to look at."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.dataq.hammer import DataqHammer
from harness.basics.arrays import AnyArray
from harness.basics.errors import BenchFault
from harness.bench.acquisition_channels import FORCE, PRESSURE
from tests.support.daq_bench import (
    CALIBRATION,
    Bench,
    idle_counts,
    mocked_box,
    numbered,
    numbered_begin,
    numbered_source,
    opened,
    played,
)

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="pseudo-terminals as the mock uses them need Linux"
)


@pytest.fixture
def bench() -> Iterator[Bench]:
    with mocked_box(numbered_source) as bench:
        yield bench


def captured(hammer: DataqHammer, seconds: float) -> AnyArray:
    """``(n, 2)`` counts of about the next ``seconds``."""
    readings = {r.channel.name: r for r in hammer.capture(lambda: None, 0.1, seconds, seconds)}
    return np.stack([readings[name].values.ravel() for name in (FORCE, PRESSURE)], axis=1)


def read_whole(hammer: DataqHammer, seconds: float = 0.3) -> None:
    """Reads for a while, and every count is the one that follows the one before."""
    counts = captured(hammer, seconds)
    begin = numbered_begin(counts, 1e6)
    assert np.array_equal(counts, numbered(np.arange(begin, begin + len(counts))))


# A lost byte is told from what both channels rest at, so the sound must rest too.
QUIET = (("lost_byte", "byte"), ("lost_word", "word"))


@pytest.mark.parametrize(("kind", "said"), QUIET)
def test_lost_bytes_during_a_strike_are_named_and_the_order_is_found_again(kind: str, said: str) -> None:
    truth = idle_counts(3, 40_000)
    truth[3000:3050, 0] += np.rint(4000 * np.sin(np.pi * np.arange(50) / 50)).astype(np.int16)
    with mocked_box(played([truth, truth])) as bench, opened(bench) as hammer:

        def fire() -> None:
            bench.fire()
            bench.cue(kind)

        with pytest.raises(BenchFault, match=said) as fault:
            hammer.capture(fire, 0.02, 0.3, 2.0)
        assert "USB" in str(fault.value)
        readings = {r.channel.name: r for r in hammer.capture(bench.fire, 0.02, 0.3, 2.0)}
        counts = np.stack([readings[name].values.ravel() for name in (FORCE, PRESSURE)], axis=1)
        first = next(k for k in range(1900, 2100) if np.array_equal(truth[k], counts[0]))
        assert np.array_equal(counts, truth[first : first + len(counts)])
        health = hammer.health()
        assert health.drops > 0
        assert said in health.detail


def test_an_overflow_is_named_and_the_stream_begins_anew(bench: Bench) -> None:
    with opened(bench) as hammer:
        with pytest.raises(BenchFault, match=r"\d+ samples") as fault:
            hammer.capture(lambda: bench.cue("overflow", 0.3), 0.05, 0.6, 0.6)
        lost = bench.box.lost
        assert lost > 0
        named = float(str(fault.value).split("about ")[1].split(" ")[0])
        assert named == pytest.approx(lost / 4, rel=0.02)
        read_whole(hammer)


def held_up(hammer: DataqHammer, seconds: float) -> None:
    """Keep the process that fetches from running, as a busy computer does."""
    assert hammer._stream is not None
    fetcher = hammer._stream._fetcher.pid
    os.kill(fetcher, signal.SIGSTOP)
    time.sleep(seconds)
    os.kill(fetcher, signal.SIGCONT)


def test_a_driver_that_does_not_get_to_read_overflows_the_box() -> None:
    """The far end must lose what a pseudo-terminal alone would have kept waiting."""
    with mocked_box(numbered_source, host_memory=4096) as bench, opened(bench) as hammer:
        hammer.capture(lambda: None, 0.1, 0.1, 0.1)
        assert bench.box.lost == 0
        with pytest.raises(BenchFault, match=r"\d+ samples"):
            hammer.capture(lambda: held_up(hammer, 0.6), 0.05, 0.6, 0.6)
        assert bench.box.lost > 0
        read_whole(hammer)


@pytest.mark.slow  # as one that keeps its lock
def test_a_driver_that_is_briefly_away_loses_nothing(bench: Bench) -> None:
    with opened(bench) as hammer:
        counts = captured(hammer, 0.1)
        held_up(hammer, 0.3)
        read_whole(hammer)
        assert len(counts)
        assert bench.box.lost == 0
        assert hammer.health().drops == 0


def test_a_program_that_keeps_its_lock_loses_nothing(bench: Bench) -> None:
    """Compiling and planning hold the interpreter; the process that fetches has its own."""
    with opened(bench) as hammer:
        switching = sys.getswitchinterval()
        try:
            sys.setswitchinterval(5.0)
            ends = time.monotonic() + 3.0
            while time.monotonic() < ends:
                sum(range(1000))
        finally:
            sys.setswitchinterval(switching)
        read_whole(hammer)
        assert bench.box.lost == 0
        assert hammer.health().drops == 0


def test_a_fetching_process_that_dies_is_named(bench: Bench) -> None:
    with opened(bench) as hammer:
        hammer.capture(lambda: None, 0.1, 0.1, 0.1)
        assert hammer._stream is not None
        os.kill(hammer._stream._fetcher.pid, signal.SIGKILL)
        with pytest.raises(BenchFault, match="process"):
            hammer.capture(lambda: None, 0.1, 0.1, 5.0)
    with opened(bench) as hammer:
        read_whole(hammer)


def test_a_driver_that_is_killed_leaves_no_process_and_a_quiet_box(bench: Bench) -> None:
    program = (
        "import os; from tests.support.daq_bench import CALIBRATION\n"
        "from drivers.dataq.hammer import DataqHammer\n"
        f"h = DataqHammer(CALIBRATION, port={bench.box.port!r}); h.open()\n"
        "print(h._stream._fetcher.pid, flush=True); os.kill(os.getpid(), 9)"
    )
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": root},
        check=False,
    )
    fetcher = Path("/proc") / done.stdout.strip()
    ends = time.monotonic() + 60.0
    while fetcher.exists() and fetcher.name not in ("", "proc") and time.monotonic() < ends:
        time.sleep(0.05)
    assert done.returncode == -9
    assert not fetcher.exists()
    with opened(bench) as hammer:
        read_whole(hammer)


def test_a_stalled_box_is_named_and_read_again(bench: Bench) -> None:
    with opened(bench) as hammer:
        with pytest.raises(BenchFault, match=r"\b2 s"):
            hammer.capture(lambda: bench.cue("stall", 2.3), 0.05, 0.6, 3.0)
        read_whole(hammer)


def test_an_unplugged_box_is_named_with_its_cable(bench: Bench) -> None:
    with opened(bench) as hammer:
        began = time.monotonic()
        with pytest.raises(BenchFault, match=f"{bench.box.port} .*USB") as fault:
            hammer.capture(lambda: bench.cue("unplug"), 0.05, 0.6, 10.0)
        assert time.monotonic() - began < 5.0  # of the 10 s that no trigger would be waited for
        assert bench.box.port in str(fault.value)
        assert "USB" in hammer.health().detail
        with pytest.raises(BenchFault, match=bench.box.port):
            hammer.capture(lambda: None, 0.05, 0.6, 1.0)
    with pytest.raises(BenchFault, match=f"port {bench.box.port}"):
        opened(bench).__enter__()


@pytest.mark.slow  # losses during a strike stay
def test_a_loss_between_two_strikes_does_not_spoil_the_next(bench: Bench) -> None:
    with opened(bench) as hammer:
        read_whole(hammer)
        bench.cue("overflow", 0.2)
        ends = time.monotonic() + 120.0
        while not hammer.health().drops and time.monotonic() < ends:
            time.sleep(0.05)
        read_whole(hammer)
        assert "samples" in hammer.health().detail


def test_a_leant_on_hammer_is_named_before_it_strikes() -> None:
    with (
        mocked_box(played([], idle_counts() + np.array([300, 0], np.int16))) as bench,
        opened(bench) as hammer,
    ):
        fired: list[bool] = []
        with pytest.raises(BenchFault, match=r"before .* counts"):
            hammer.capture(lambda: fired.append(True), 0.02, 0.2, 1.0)
        assert not fired


def test_a_hammer_that_stays_pressed_is_named_after_it_struck() -> None:
    truth = idle_counts(3, 500_000)
    truth[3000:, 0] += 900
    pressed = pytest.raises(BenchFault, match=r"after .*\b10\d+ counts")
    with mocked_box(played([truth])) as bench, opened(bench) as hammer, pressed:
        hammer.capture(bench.fire, 0.02, 0.2, 1.0)


def test_channels_that_rest_alike_are_begun_anew_before_every_strike() -> None:
    from dataclasses import replace

    alike = replace(CALIBRATION, microphone_offset=100.0)
    with mocked_box(numbered_source) as bench, opened(bench, calibration=alike) as hammer:
        read_whole(hammer)
        read_whole(hammer)
        detail = hammer.health().detail
        assert "too much alike" in detail


def test_a_capture_that_is_not_kept_is_refused(bench: Bench) -> None:
    with opened(bench) as hammer, pytest.raises(ValueError, match=r"\b10 s"):
        hammer.capture(lambda: None, 1.0, 9.5, 1.0)


def test_a_closed_hammer_says_so(bench: Bench) -> None:
    hammer = DataqHammer(CALIBRATION, port=bench.box.port)
    with pytest.raises(BenchFault, match="opened"):
        hammer.capture(lambda: None, 0.1, 0.1, 0.1)
    hammer.open()
    hammer.open()
    hammer.close()
    hammer.close()
    hammer.open()
    hammer.close()


def test_a_failing_striker_is_not_hidden(bench: Bench) -> None:
    def fire() -> None:
        raise BenchFault("arm: no output 0")

    with opened(bench) as hammer:
        with pytest.raises(BenchFault, match="no output 0"):
            hammer.capture(fire, 0.05, 0.1, 0.1)
        read_whole(hammer)
