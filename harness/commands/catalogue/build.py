"""``touchstone catalogue build``: every object of a catalogue becomes an ObjectFile."""

import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from harness.commands import options
from harness.commands.catalogue import chosen
from harness.commands.output import ANSWERS, CONSOLE, duration, emit, warn

if TYPE_CHECKING:
    from harness.authoring.catalogue.build import BuildPlan, Runner
    from harness.authoring.catalogue.layout import ObjectRecord
    from harness.authoring.catalogue.rows import ExcludedRow
    from harness.authoring.catalogue.spec import BuildSpec
    from harness.authoring.catalogue.worker import WorkerLimits


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
    from harness.authoring.catalogue.build import build_plan, held
    from harness.authoring.catalogue.layout import BuildFolder, BuildSettings
    from harness.authoring.catalogue.worker import Job, WorkerLimits
    from harness.basics.files.json_file import write_model
    from harness.basics.quantities import TIME

    begun = time.perf_counter()
    spec = _spec(senses, profile, seed, up_to, modes, edge, sensor)
    seconds = options.positive("--time-limit", time_limit, TIME)
    assert seconds is not None
    limits = WorkerLimits(seconds, None if memory is None else int(memory * 1e9))
    chosen_runner = _runner(runner, workers, address, limits)
    _, rows, excluded = chosen.read(catalogue, meshes, material)
    of = BuildFolder(out.resolve(), None if stages is None else stages.resolve())
    plan = build_plan(rows, spec, of, retry)
    records: list[ObjectRecord] = []
    with held(of):
        names = tuple(item.row.name for item in plan.items)
        settings = BuildSettings(catalogue=str(catalogue), names=names, excluded=tuple(excluded))
        write_model(settings, of.settings)
        if plan.waiting:
            with build_progress(len(plan.waiting)) as count:
                shutil.rmtree(of.aside, ignore_errors=True)
                of.aside.mkdir()
                for record in chosen_runner.run(Job(item, spec, of) for item in plan.waiting):
                    records.append(record)
                    count(record.name, record.built)
                    if not record.built:
                        warn(f"{record.name}: {record.outcome}: {record.reason}")
    outcome = _Outcome(of.folder, plan, records, excluded, time.perf_counter() - begun)
    if json:
        emit(outcome.as_json())
    else:
        _print(outcome)
    return 1 if outcome.failed or not plan.items else 0


def _spec(
    senses: str, profile: str, seed: int, up_to: str, modes: int, edge: str | None, sensor: str | None
) -> "BuildSpec":
    from harness.authoring.catalogue.spec import SENSES, BuildSpec
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest
    from harness.basics.quantities import FREQUENCY, LENGTH
    from harness.bench.sensor import DEFAULT_MAKE, described_sensor

    named = {name.strip() for name in senses.split(",") if name.strip()}
    for name in sorted(named - set(SENSES)):
        raise WrongUse(f"--senses {name}: {nearest(name, SENSES)}")
    return BuildSpec(
        senses=tuple(sense for sense in SENSES if sense in named),
        profile=profile,
        seed=seed,
        limit=options.positive("--up-to", up_to, FREQUENCY) or 0.0,
        most=modes,
        edge=options.positive("--edge", edge, LENGTH),
        sensor=described_sensor(sensor or DEFAULT_MAKE).sensor,
    )


def _runner(name: str, workers: int, address: str | None, limits: "WorkerLimits") -> "Runner":
    from harness.authoring.catalogue.build import LocalRunner
    from harness.basics.cores import own_cores
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest

    if name == "local":
        if address is not None:
            raise WrongUse(f"--address {address} is of --runner ray; leave it out, or say --runner ray")
        return LocalRunner(workers or own_cores(), limits)
    if name != "ray":
        raise WrongUse(f"no runner {name!r}; {nearest(name, ('local', 'ray'))}")
    from harness.authoring.catalogue.ray_runner import RayRunner

    return RayRunner(workers or None, limits, address)


@dataclass(frozen=True, eq=False)
class _Outcome:
    """What a build came to: its folder and plan, the objects tried in it, rows left out, and s it took."""

    folder: Path
    plan: "BuildPlan"
    records: "Sequence[ObjectRecord]"
    excluded: "Sequence[ExcludedRow]"
    seconds: float

    @property
    def built(self) -> int:
        return sum(record.built for record in self.records)

    @property
    def failed(self) -> "list[ObjectRecord]":
        """Before, and not tried again, or now."""
        return [*self.plan.known.values(), *(record for record in self.records if not record.built)]

    def as_json(self) -> dict[str, Any]:
        made = Counter(s for r in self.records for s, part in r.senses.items() if part.made)
        return {
            "schema": 1,
            "folder": str(self.folder),
            "objects": len(self.plan.items),
            "standing": len(self.plan.standing),
            "built": self.built,
            "failed": [{"name": r.name, "outcome": r.outcome, "reason": r.reason} for r in self.failed],
            "excluded": [{"name": row.name, "reason": row.reason} for row in self.excluded],
            "stages_made": dict(made),
            "seconds": self.seconds,
        }


def _print(outcome: _Outcome) -> None:
    plan = outcome.plan
    if not plan.waiting:
        ANSWERS.print(
            f"nothing to do: {len(plan.standing)} of {len(plan.items)} objects stand in {outcome.folder}",
            markup=False,
        )
    else:
        made = f"{outcome.built} of {len(plan.items)} objects built, {len(plan.standing)} stood already"
        ANSWERS.print(f"{made}; {duration(outcome.seconds)}", markup=False)
    for record in outcome.failed:
        log = outcome.folder / "failed" / record.name / "log.txt"
        ANSWERS.print(f"{record.name}: {record.outcome}: {record.reason} ({log})", markup=False)
    if plan.known:
        CONSOLE.print(
            f"{len(plan.known)} failed before and were not tried again; --retry tries them", markup=False
        )
    if outcome.excluded:
        ANSWERS.print(
            f"{len(outcome.excluded)} rows excluded; `touchstone catalogue check` lists the reasons",
            markup=False,
        )


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
