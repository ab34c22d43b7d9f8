"""``touchstone catalogue build``: every object of a catalogue becomes an ObjectFile."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from harness.commands import options
from harness.commands.catalogue import chosen
from harness.commands.output import CONSOLE, duration, print_result, warn


def build(
    catalogue: chosen.CatalogueFileArgument,
    out: chosen.Folder,
    meshes: chosen.Meshes = None,
    material: chosen.Materials = None,
    senses: chosen.Senses = "audio,touch",
    profile: Annotated[str, typer.Option(help="Of every sense: smoke, shipped or standard.")] = "standard",
    up_to: options.UpTo = "20kHz",
    modes: options.MostModes = 128,
    edge: options.LongestEdge = None,
    sensor: Annotated[
        str | None,
        typer.Option(help="Make of the gel that presses, or the path of its file.", metavar="NAME"),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
    runner: Annotated[str, typer.Option(help="local: processes of this machine; ray: a cluster.")] = "local",
    workers: Annotated[int, typer.Option(help="Objects side by side; cores if left out.", min=0)] = 0,
    address: Annotated[
        str | None,
        typer.Option(help="Of a running Ray cluster, HOST:6379 or auto; else one starts here.", metavar="A"),
    ] = None,
    time_limit: Annotated[
        str, typer.Option("--time-limit", help="An object that takes longer is killed.", metavar="TIME")
    ] = "120min",
    memory: Annotated[
        float | None,
        typer.Option(help="Gigabytes of data a worker may have; all there is if left out.", min=0.5),
    ] = None,
    retry: Annotated[bool, typer.Option("--retry", help="Try objects again that failed before.")] = False,
    stages: chosen.Stages = None,
    json: options.Json = False,
) -> int:
    """Build every object of a catalogue, as many side by side as there are workers.

    What stands is left alone: a second build of the same catalogue does nothing, and a changed material,
    profile or sense makes only what depends on it. A build that was killed goes on. An object that fails,
    hangs or kills its worker is kept apart in OUT/failed with its reason and its log, and the others go on.

    ObjectFiles are in OUT/objects. Exit code 0 where all objects with a mesh are built, else 1.

    Try: touchstone catalogue build objects.csv --meshes meshes --out built --profile smoke
    """
    options.require_folders(("--out", out), ("--stages", stages))
    from harness.authoring.catalogue.worker import WorkerLimits
    from harness.basics.quantities import FREQUENCY, LENGTH, TIME
    from harness.tasks.catalogue import build_catalogue

    seconds = options.positive("--time-limit", time_limit, TIME)
    built = build_catalogue(
        catalogue,
        out,
        meshes,
        material or (),
        senses,
        profile,
        options.positive("--up-to", up_to, FREQUENCY),
        modes,
        options.positive("--edge", edge, LENGTH),
        sensor,
        seed,
        runner,
        workers,
        address,
        WorkerLimits(seconds, None if memory is None else int(memory * 1e9)),
        retry,
        stages,
        build_progress,
        warn,
    )
    print_result(built, json)
    return 1 if built.failed or not built.objects else 0


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
