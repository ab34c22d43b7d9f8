"""What commands say: prose and progress on standard error, one JSON object on standard output."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from harness.basics.errors import TouchstoneError
from harness.recording.step_file import Step

WIDE = 132
"""Columns of a table where what it is written to is no terminal."""

CONSOLE = Console(stderr=True, highlight=False, soft_wrap=True, width=None if sys.stderr.isatty() else WIDE)
ANSWERS = Console(highlight=False, soft_wrap=True, width=None if sys.stdout.isatty() else WIDE)


def emit(result: Mapping[str, Any]) -> None:
    """Print the one JSON object of a command, at once: some go on until they are told to end."""
    sys.stdout.write(json.dumps(result, allow_nan=False) + "\n")
    sys.stdout.flush()


def warn(sentence: str) -> None:
    """Something the operator should know."""
    CONSOLE.print(f"[yellow]note:[/] {escape(sentence)}")


@contextmanager
def resumable(how: str) -> Iterator[None]:
    """Where a bench fails within it, say with which command the run goes on; the failure is raised on."""
    try:
        yield
    except TouchstoneError:
        warn(f"what was recorded is kept; go on with `{how}`")
        raise


def stopped(step: str, folder: Path, how: str, as_json: bool) -> int:
    """Ctrl-C ended a session after a step: say with which command the run goes on; the exit code."""
    said = f"stopped after {step}; go on with `{how}`"
    CONSOLE.print(said, markup=False)
    if as_json:
        emit({"schema": 1, "error": said, "exit_code": 130, "recording": str(folder)})
    return 130


class StepProgress:
    """A bar over the steps of a run."""

    def __init__(self, bar: Progress, done: int, total: int, noun: str) -> None:
        self._bar = bar
        self._noun = noun
        self._task = bar.add_task(f"{noun}s", completed=done, total=total)

    def began(self, step: Step) -> None:
        """Say which step is performed."""
        self._bar.update(self._task, description=f"{self._noun} {step.index + 1}: {step.kind}")

    def ended(self, step: Step, seconds: float) -> None:
        """Count it, and say how long it took."""
        self._bar.console.print(f"  {self._noun} {step.index + 1} recorded in {seconds:.1f} s")
        self._bar.advance(self._task)

    def say(self, sentence: str) -> None:
        """How the step that is being performed goes."""
        self._bar.console.print(f"  {escape(sentence)}")


@contextmanager
def step_progress(done: int, total: int, noun: str = "step") -> Iterator[StepProgress]:
    """A progress bar for the length of a session."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=CONSOLE, transient=True) as bar:
        yield StepProgress(bar, done, total, noun)


@contextmanager
def run_progress(total: int) -> Iterator[Callable[[], None]]:
    """A progress bar over many runs, and what counts one of them as done."""
    columns = (
        TextColumn("runs"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("left:"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=CONSOLE, transient=True) as bar:
        task = bar.add_task("runs", total=total)
        yield lambda: bar.advance(task)


@contextmanager
def share_progress() -> Iterator[Callable[[str, float], None]]:
    """A progress bar for the length of a work, and what tells it: what is being done, and the share done."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=CONSOLE, transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def report(doing: str, share: float) -> None:
            bar.update(task, description=doing, completed=share)

        yield report
