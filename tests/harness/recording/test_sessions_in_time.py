"""A run resumed after a reboot is stamped with the time of day; steps that go backwards are reported."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness.basics.clock import clock_offset_ns
from harness.basics.errors import WrongUse
from harness.bench.device import Channel, Reading
from harness.recording import recording as recording_module
from harness.recording.recording import Recording
from harness.recording.step_file import Step, read_wall_span
from tests.samples.recorded_step import sample_header

HOUR = 3600 * 10**9
CHANNEL = Channel("test.numbers", "m", (1,), "float64", "base", 10.0)


def commit(recording: Recording, index: int, times: list[float]) -> None:
    reading = Reading(CHANNEL, np.array(times), np.zeros((len(times), 1)))
    recording.commit(Step(index, "press", {}), [reading], 1.0)


@pytest.fixture
def run(tmp_path: Path) -> Recording:
    """One step, recorded 5000 s after the computer was started."""
    run = Recording.create(tmp_path / "run", sample_header())
    run.begin_session(1_800_000_000 * 10**9)
    commit(run, 0, [5000.0, 5010.0])
    return run


def test_the_offset_is_the_wall_clock_minus_the_bench_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.time_ns", lambda: 5 * HOUR)
    assert clock_offset_ns(lambda: 2.5) == 5 * HOUR - 2_500_000_000


def test_a_run_resumed_after_a_reboot_is_stamped_with_the_time_of_day(
    run: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reboot was at 5100 s: the bench clock starts again at zero."""
    monkeypatch.setattr(recording_module, "now", lambda: 20.0)
    resumed = Recording(run.folder)
    resumed.begin_session((1_800_000_000 + 5100) * 10**9)
    commit(resumed, 1, [21.0, 30.0])
    spans = [read_wall_span(run.folder / "steps" / name) for name in ("000.mcap", "001.mcap")]
    assert spans == [
        (1_800_005_000 * 10**9, 1_800_005_010 * 10**9),
        (1_800_005_121 * 10**9, 1_800_005_130 * 10**9),
    ]
    assert resumed.order_notes() == ()
    records = Recording(run.folder).steps()
    assert records[0].readings["test.numbers"].times.tolist() == [5000.0, 5010.0]
    assert records[1].readings["test.numbers"].times.tolist() == [21.0, 30.0]


def test_a_session_before_the_last_step_is_refused(run: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_module, "now", lambda: 20.0)
    with pytest.raises(WrongUse, match=r"2027-01-15 08:00:20\+00:00.*step 1"):
        Recording(run.folder).begin_session(1_800_000_000 * 10**9)


def test_a_simulated_session_goes_on_where_the_last_step_ended(run: Recording) -> None:
    resumed = Recording(run.folder)
    resumed.begin_session(1_800_000_000 * 10**9, is_simulated=True)
    commit(resumed, 1, [0.0, 3.0])
    assert read_wall_span(run.folder / "steps" / "001.mcap") == (
        1_800_005_010 * 10**9,
        1_800_005_013 * 10**9,
    )
    assert resumed.order_notes() == ()


def test_steps_that_go_backwards_are_reported(run: Recording) -> None:
    """As an earlier version stamped them: with the offset of the first session."""
    commit(run, 1, [20.0, 30.0])
    commit(run, 2, [31.0])
    commit(run, 3, [30.5])
    (note,) = run.order_notes()
    assert re.search("step 2 .*83 min .*step 1 ", note)
