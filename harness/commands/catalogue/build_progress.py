"""How far a build of many objects is, on a terminal and without one: throughput and time left."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from harness.commands.output import CONSOLE, duration

PERIOD = 30.0
"""S between two lines where there is no terminal."""


class Throughput:
    """Objects an hour and seconds left, from what this build has done so far.

    Args:
        total: objects to build.
        clock: s, never running backwards.
    """

    def __init__(self, total: int, clock: Callable[[], float] = time.monotonic) -> None:
        self.total = total
        self.done = 0
        self.failed = 0
        self._clock = clock
        self._begun = clock()

    def count(self, built: bool) -> None:
        """One more object is over."""
        self.done += 1
        self.failed += not built

    @property
    def seconds(self) -> float:
        """Since the build began."""
        return self._clock() - self._begun

    @property
    def hourly(self) -> float | None:
        """Objects an hour; None before the first."""
        return 3600.0 * self.done / self.seconds if self.done and self.seconds > 0.0 else None

    @property
    def seconds_left(self) -> float | None:
        """None before the first object is over."""
        return None if self.hourly is None else (self.total - self.done) * 3600.0 / self.hourly

    def sentence(self) -> str:
        """All of it in one line."""
        failed = f", {self.failed} failed" if self.failed else ""
        rate = "" if self.hourly is None else f", {self.hourly:.3g} an hour"
        left = "" if self.seconds_left is None else f", {duration(self.seconds_left)} left"
        return f"{self.done} of {self.total} objects{failed}{rate}{left}"


@contextmanager
def build_progress(total: int) -> Iterator[Callable[[str, bool], None]]:
    """A bar, or a line every ``PERIOD`` where there is no terminal; call it with each object that is over."""
    throughput = Throughput(total)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=CONSOLE, transient=True, disable=not CONSOLE.is_terminal) as bar:
        task = bar.add_task("objects", total=total)
        last = 0.0

        def count(name: str, built: bool) -> None:
            nonlocal last
            throughput.count(built)
            bar.update(task, description=throughput.sentence(), completed=throughput.done)
            due = throughput.seconds - last >= PERIOD or throughput.done in (1, total)
            if due and not CONSOLE.is_terminal:
                last = throughput.seconds
                CONSOLE.print(f"{throughput.sentence()}; last: {name}", markup=False)

        yield count
