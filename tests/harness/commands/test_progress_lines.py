"""How far a work is, in lines where there is no terminal: at every stage, and once a minute."""

import threading

import pytest

from harness.commands import output
from harness.commands.output import A_MINUTE, Pace, duration


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_a_stage_is_said_as_it_begins_and_once_a_minute(clock: Clock) -> None:
    pace = Pace(clock)
    lines = []
    for second in range(150):
        clock.now = float(second)
        lines.append(pace.line(f"training, epoch {second}", second / 300.0))
    spoken = {second: line for second, line in enumerate(lines) if line is not None}
    assert list(spoken) == [0, 60, 120]
    assert spoken[60] == "training, epoch 60: 20 %; 4 min left"
    assert pace.line("measuring", 0.5) == "measuring: 50 %"


def test_time_left_is_at_the_pace_since_it_began_and_not_of_what_was_done_before(clock: Clock) -> None:
    """A run that was resumed at its fourth step of six took nothing for the first three."""
    pace = Pace(clock)
    assert pace.left(3.0 / 6.0) == ""
    clock.now = 10.0
    assert pace.left(4.0 / 6.0) == "; 20 s left"
    clock.now = 30.0
    assert pace.left(1.0) == ""


def test_nothing_is_said_of_a_pace_that_there_is_not(clock: Clock) -> None:
    pace = Pace(clock)
    assert pace.left(0.0) == ""
    clock.now = 2.0 * A_MINUTE
    assert pace.left(0.0) == ""


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.4, "0 s"),
        (119.0, "119 s"),
        (120.0, "2 min"),
        (7100.0, "118 min"),
        (7200.0, "2 h"),
        (864e3, "10.0 days"),
    ],
)
def test_a_duration_is_in_the_unit_that_people_use(seconds: float, words: str) -> None:
    assert duration(seconds) == words


def test_a_stage_that_reports_nothing_is_repeated_with_the_time_since_the_start(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = Clock()
    monkeypatch.setattr(output, "_REPEAT", 0.01)
    monkeypatch.setattr("time.monotonic", now)
    monkeypatch.setattr(output, "Pace", lambda: Pace(now))
    with output.share_progress() as report:
        report("filling the mesh", 0.0)
        report("solving", 0.0)
        assert capsys.readouterr().err.splitlines() == ["filling the mesh", "solving"]
        now.now = 75.0
        for _ in range(200):
            threading.Event().wait(0.01)
            written = capsys.readouterr().err
            if "elapsed" in written:
                break
    assert written.strip() == "solving (75 s elapsed)"
