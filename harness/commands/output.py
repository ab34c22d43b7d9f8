"""What commands say: prose and progress on standard error, one JSON object on standard output."""

import json
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

from harness.basics.answers import write_answer
from harness.basics.errors import TouchstoneError
from harness.commands.terminal import SafeConsole, escape_message

if TYPE_CHECKING:
    from harness.basics.result import Result
    from harness.recording.step_file import Step

WIDE = 132
"""Columns of a table where what it is written to is no terminal."""

CONSOLE = SafeConsole(stderr=True, width=None if sys.stderr.isatty() else WIDE)
A_MINUTE = 60.0
"""s after which a work that has no bar says how far it is."""

_REPEAT = 1.0
"""Seconds between checks whether a stage has been silent for a minute."""

_DIGITS = re.compile(r"[\d.]+")
"""What changes in what is being done without another stage beginning."""

MAX_ROWS = 40
"""Rows of a table in text."""

ANSWERS = SafeConsole(width=None if sys.stdout.isatty() else WIDE)


def emit(result: Mapping[str, Any]) -> None:
    """Print the one JSON object of a command, at once: some go on until they are told to end."""
    write_answer(json.dumps(result, allow_nan=False))


def print_result(result: "Result", as_json: bool) -> None:
    """Print a result: notes on standard error, then JSON or text on standard output.

    Text is the answer in words, a table of the vectors, and every other field with its unit.
    """
    from harness.basics.result import text_rows

    notes: Sequence[str] = getattr(result, "notes", ())
    for sentence in notes:
        warn(sentence)
    if as_json:
        emit(result.as_json())
        return
    for sentence in result.summary():
        ANSWERS.print(sentence, markup=False)
    for title, headings, lines in result.tables():
        table = Table(*headings, title=title or None)
        for line in lines[:MAX_ROWS]:
            table.add_row(*map(escape, line))
        ANSWERS.print(table)
        if len(lines) > MAX_ROWS:
            ANSWERS.print(f"... and {len(lines) - MAX_ROWS} more rows; --json has all")
    rows = list(text_rows(result))
    width = max((len(label) for label, _ in rows), default=0)
    for label, value in rows:
        ANSWERS.print(f"{label:<{width}}  {value}", markup=False)


def warn(sentence: str) -> None:
    """Something the operator should know."""
    CONSOLE.print(f"[yellow]note:[/] {escape(escape_message(sentence))}")


def print_stop(stop: TouchstoneError, folder: Path, as_json: bool) -> int:
    """Print that Ctrl-C ended a session, and the command that resumes it; return the exit code."""
    CONSOLE.print(str(stop), markup=False)
    if as_json:
        kind = {"kind": stop.kind(), "exit_code": stop.exit_code, "recording": str(folder)}
        emit({"schema": 1, "error": str(stop), **kind})
    return stop.exit_code


class Pace:
    """Time taken and time left of a work whose share done is known; says so in lines where there is no bar.

    Args:
        clock: s, of a clock that does not go back.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._began = self._printed = clock()
        self._first: float | None = None
        self._stage = ""

    def left(self, share: float) -> str:
        """``"; 3 min left"`` at a share done from 0 to 1, at the pace so far; nothing before there is one."""
        if self._first is None:
            self._first = share
        done = share - self._first
        if done <= 0.0 or share >= 1.0:
            return ""
        return f"; {duration((self._clock() - self._began) * (1.0 - share) / done)} left"

    def line(self, doing: str, share: float) -> str | None:
        """What to print of it now: a line where a new stage begins, and one a minute; else None."""
        left, stage = self.left(share), _DIGITS.sub("", doing)
        new = stage != self._stage
        if not new and self._clock() - self._printed < A_MINUTE:
            return None
        if new:
            # Another stage has a pace of its own.
            self._began, self._first, left = self._clock(), share, ""
        self._stage, self._printed = stage, self._clock()
        return f"{doing}: {100.0 * share:.0f} %{left}" if share > 0.0 else doing


def duration(seconds: float) -> str:
    """A time as people say it: seconds below two minutes, then minutes, hours, days."""
    for limit, unit, name in ((120.0, 1.0, "s"), (7200.0, 60.0, "min"), (172800.0, 3600.0, "h")):
        if seconds < limit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds / 86400.0:.1f} days"


class StepProgress:
    """A bar over the steps of a run, and a line after each."""

    def __init__(self, bar: Progress, done: int, total: int, noun: str) -> None:
        self._bar = bar
        self._noun = noun
        self._done, self._total = done, total
        self._pace: Pace | None = None
        self._task = bar.add_task(f"{noun}s", completed=done, total=total)

    def began(self, step: "Step") -> None:
        """Say which step is performed."""
        if self._pace is None:
            # From the first step on: what opening a bench and loading kernels takes comes once.
            self._pace = Pace()
            self._pace.left(self._done / self._total)
        self._bar.update(self._task, description=f"{self._noun} {step.index + 1}: {step.kind}")

    def ended(self, step: "Step", seconds: float) -> None:
        """Count it, and say how long it took and how long the rest will take."""
        self._done += 1
        left = "" if self._pace is None else self._pace.left(self._done / self._total)
        line = f"  {self._noun} {step.index + 1} of {self._total} recorded in {seconds:.1f} s{left}"
        self._bar.console.print(line, markup=False)
        self._bar.advance(self._task)


@contextmanager
def step_progress(done: int, total: int, noun: str = "step") -> Iterator[StepProgress]:
    """A progress bar for the length of a session."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=CONSOLE, transient=True) as bar:
        yield StepProgress(bar, done, total, noun)


@contextmanager
def run_progress(total: int) -> Iterator[Callable[[], None]]:
    """Show how many of many runs are finished; the yielded function counts one."""
    finished = count(1)
    with share_progress() as report:

        def advance() -> None:
            at = next(finished)
            report(f"run {at} of {total}", at / total)

        yield advance


@contextmanager
def share_progress(quiet: bool = False) -> Iterator[Callable[[str, float], None]]:
    """Show the stages of a computation on standard error: a bar on a terminal, else lines.

    The yielded function takes the name of the stage and the fraction of it that is done, 0 where that is not
    known. A line is printed as each stage begins and once a minute, with the time since the start.

    Args:
        quiet: whether nothing is shown, as with ``--json``.
    """
    if quiet:
        yield lambda _doing, _share: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    lines = _StageLines()
    with Progress(*columns, console=CONSOLE, transient=True) as bar, lines.repeated():
        task = bar.add_task("", total=1.0)

        def report(doing: str, share: float) -> None:
            bar.update(task, description=doing, completed=share, total=1.0 if share > 0.0 else None)
            lines.report(doing, share)

        yield report


class _StageLines:
    """Lines about the stages of a computation where there is no terminal."""

    def __init__(self) -> None:
        self._pace, self._began = Pace(), time.monotonic()
        self._now = ("", 0.0)

    def report(self, doing: str, share: float) -> None:
        """Print a line if the stage is a new one, or a minute after the last line."""
        self._now = (doing, share)
        if not CONSOLE.is_terminal and doing:
            elapsed = time.monotonic() - self._began
            _print_line(self._pace, doing, share, f" ({duration(elapsed)} elapsed)" if elapsed >= 1.0 else "")

    @contextmanager
    def repeated(self) -> Iterator[None]:
        """Repeat the stage's line once a minute, also while a long stage reports nothing."""
        ended = threading.Event()

        def repeat() -> None:
            while not ended.wait(_REPEAT):
                self.report(*self._now)

        thread = threading.Thread(target=repeat, name="progress", daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


def _print_line(pace: Pace, doing: str, share: float, suffix: str = "") -> None:
    if not CONSOLE.is_terminal:
        line = pace.line(doing, share)
        if line is not None:
            CONSOLE.print(f"{line}{suffix}", markup=False)
