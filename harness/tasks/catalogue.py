"""Catalogues of objects: checked, built into ObjectFiles, reviewed and published."""

import shutil
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from harness.authoring.catalogue.build import LocalRunner, Runner, build_plan, held
from harness.authoring.catalogue.findings import IntakeFinding, intake_finding
from harness.authoring.catalogue.layout import (
    BuildFolder,
    BuildSettings,
    ObjectRecord,
    read_settings,
)
from harness.authoring.catalogue.publish import ObjectStore, SentObject, publish
from harness.authoring.catalogue.rows import (
    Catalogue,
    CatalogueRow,
    ExcludedRow,
    of_materials,
    read_catalogue,
    with_meshes,
)
from harness.authoring.catalogue.spec import SENSES, BuildSpec
from harness.authoring.catalogue.summary import ObjectSummary, summaries
from harness.authoring.catalogue.worker import Job, WorkerLimits
from harness.basics.cores import own_cores
from harness.basics.errors import WrongUse
from harness.basics.files.json_file import write_model
from harness.basics.files.named_file import nearest
from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.bench.sensor import DEFAULT_MAKE, described_sensor
from harness.report.catalogue_page import PAGE, write_catalogue_page
from harness.tasks.objects import Report

Count = Callable[[str, bool], None]
"""Called with the name of an object that is finished, and whether it is built."""


@dataclass(frozen=True)
class CheckedCatalogue(Result):
    """The objects of a catalogue, before anything is built."""

    catalogue: Path = field(metadata=JSON_ONLY)
    objects: int = field(metadata=JSON_ONLY)
    with_mesh: int = field(metadata=JSON_ONLY)
    materials: Mapping[str, int]  #: number of objects by material.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    excluded: tuple[ExcludedRow, ...]
    intake: tuple[IntakeFinding, ...]  #: findings of the intake; empty if no mesh was opened.

    @property
    def buildable(self) -> int:
        """Return the number of objects that can be built."""
        return sum(each.reason is None for each in self.intake) if self.intake else self.with_mesh

    def summary(self) -> tuple[str, ...]:
        """List the findings, and count the objects that are ready."""
        counts = Counter(each.verdict for each in self.intake)
        verdicts = ", ".join(
            f"{counts[name]} {name}" for name in ("ready", "look", "excluded") if counts[name]
        )
        remarks = [
            f"{each.name}: {sentence}"
            for each in self.intake
            for sentence in filter(None, (each.reason, *each.remarks))
        ]
        return (
            *remarks,
            f"{self.objects} objects, {self.with_mesh} with a mesh; {verdicts or 'none opened'}",
        )


@dataclass(frozen=True)
class FailedObject:
    """An object that was not built."""

    name: str
    outcome: str
    reason: str


@dataclass(frozen=True)
class BuiltCatalogue(Result):
    """The outcome of a build."""

    folder: Path
    objects: int  #: number of objects of the catalogue that have a mesh.
    standing: int  #: number of objects that were built before.
    built: int
    failed: tuple[FailedObject, ...]  #: objects that failed in this build, or before without another try.
    excluded: tuple[ExcludedRow, ...] = field(metadata=JSON_ONLY)
    stages_made: Mapping[str, int]  #: number of objects by sense.
    seconds: float
    tried: int = field(metadata=HIDDEN)  #: number of objects that this build tried.
    notes: tuple[str, ...] = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """Count the built objects."""
        if not self.tried:
            return (f"nothing to do: {self.standing} of {self.objects} objects are already in {self.folder}",)
        return (f"{self.built} of {self.objects} objects built, {self.standing} were built before",)


@dataclass(frozen=True)
class CatalogueStatus(Result):
    """The objects of a build, which may be running."""

    folder: Path
    counts: Mapping[str, int]  #: number of objects by outcome.
    objects: tuple[ObjectSummary, ...]
    excluded: tuple[ExcludedRow, ...] = field(metadata=JSON_ONLY)

    def summary(self) -> tuple[str, ...]:
        """State why objects are not built."""
        return (
            *(
                f"{each.name}: {each.outcome}: {each.reason}"
                for each in self.objects
                if each.reason and each.outcome != "waiting"
            ),
            f"{len(self.objects)} objects; {len(self.excluded)} rows excluded",
        )


@dataclass(frozen=True)
class PublishedCatalogue(Result):
    """The copy of a build."""

    url: str = field(metadata=JSON_ONLY)
    counts: Mapping[str, int] = field(metadata=JSON_ONLY)  #: number of objects by outcome.
    bytes: int = field(metadata=JSON_ONLY)  #: sent now.
    objects: tuple[SentObject, ...] = field(metadata=JSON_ONLY)

    def summary(self) -> tuple[str, ...]:
        """State the number of objects by outcome and the amount sent."""
        counts = ", ".join(f"{count} {outcome}" for outcome, count in self.counts.items())
        return (f"{len(self.objects)} objects: {counts}; {self.bytes / 1e6:.3g} MB sent to {self.url}",)


@dataclass(frozen=True)
class CataloguePage(Result):
    """The page of a build."""

    page: Path
    bytes: int


Rows = tuple[Catalogue, list[tuple[CatalogueRow, str]], tuple[ExcludedRow, ...]]


def _read(catalogue: Path, meshes: Path | None, materials: Sequence[str]) -> Rows:
    """Read the catalogue of the chosen materials, its rows with their meshes, and the excluded rows."""
    chosen = of_materials(read_catalogue(catalogue), list(materials))
    rows, without = with_meshes(chosen.rows, meshes or catalogue.parent)
    return chosen, rows, (*chosen.excluded, *without)


def check_catalogue(
    catalogue: Path,
    meshes: Path | None,
    materials: Sequence[str],
    senses: str,
    rows_only: bool,
    report: Report,
) -> CheckedCatalogue:
    """Check every object of a catalogue and report its units, size, openings, walls and mass.

    Raises:
        WrongUse: no such catalogue, or an unknown material.
    """
    chosen, rows, excluded = _read(catalogue, meshes, materials)
    found = []
    for index, (row, mesh) in enumerate([] if rows_only else rows):
        report(row.name, index / len(rows))
        found.append(intake_finding(row, mesh, "audio" in senses.split(",")))
    materials_of = Counter(row.material for row in chosen.rows)
    return CheckedCatalogue(
        chosen.path, len(chosen.rows), len(rows), materials_of, chosen.notes, excluded, tuple(found)
    )


def build_catalogue(
    catalogue: Path,
    out: Path,
    meshes: Path | None,
    materials: Sequence[str],
    senses: str,
    profile: str,
    up_to: float,
    count: int,
    edge: float | None,
    sensor: str | None,
    seed: int,
    runner: str,
    workers: int,
    address: str | None,
    limits: WorkerLimits,
    retry: bool,
    stages: Path | None,
    progress: Callable[[int], AbstractContextManager[Count]],
    warn: Callable[[str], None],
) -> BuiltCatalogue:
    """Build every object of a catalogue into an ObjectFile; a build that was stopped is resumed.

    The arguments are the options of ``touchstone catalogue build``. ``progress`` is called with the number
    of objects and yields their counter, ``warn`` receives failures.

    Raises:
        WrongUse: no such catalogue, or an unknown sense, profile, sensor, runner or material.
    """
    begun = time.perf_counter()
    wanted = {name.strip() for name in senses.split(",") if name.strip()}
    for name in sorted(wanted - set(SENSES)):
        raise WrongUse(f"--senses {name}: {nearest(name, SENSES)}")
    spec = BuildSpec(
        senses=tuple(sense for sense in SENSES if sense in wanted),
        profile=profile,
        seed=seed,
        limit=up_to,
        most=count,
        edge=edge,
        sensor=described_sensor(sensor or DEFAULT_MAKE).sensor,
    )
    builder = _runner(runner, workers, address, limits)
    _, rows, excluded = _read(catalogue, meshes, materials)
    of = BuildFolder(out.resolve(), None if stages is None else stages.resolve())
    plan = build_plan(rows, spec, of, retry)
    records: list[ObjectRecord] = []
    with held(of):
        names = tuple(item.row.name for item in plan.items)
        settings = BuildSettings(catalogue=str(catalogue), names=names, excluded=excluded)
        write_model(settings, of.settings)
        if plan.waiting:
            with progress(len(plan.waiting)) as counted:
                shutil.rmtree(of.aside, ignore_errors=True)
                of.aside.mkdir()
                for record in builder.run(Job(item, spec, of) for item in plan.waiting):
                    records.append(record)
                    counted(record.name, record.built)
                    if not record.built:
                        warn(f"{record.name}: {record.outcome}: {record.reason}")
    failed = [*plan.known.values(), *(record for record in records if not record.built)]
    notes = [f"{each.name}: the log is {of.folder / 'failed' / each.name / 'log.txt'}" for each in failed]
    if plan.known:
        notes.append(f"{len(plan.known)} failed before and were not tried again; --retry tries them")
    if excluded:
        notes.append(f"{len(excluded)} rows excluded; `touchstone catalogue check` lists the reasons")
    return BuiltCatalogue(
        folder=of.folder,
        objects=len(plan.items),
        standing=len(plan.standing),
        built=sum(record.built for record in records),
        failed=tuple(FailedObject(each.name, each.outcome, each.reason) for each in failed),
        excluded=excluded,
        stages_made=Counter(sense for each in records for sense, part in each.senses.items() if part.made),
        seconds=time.perf_counter() - begun,
        tried=len(records),
        notes=tuple(notes),
    )


def _runner(name: str, workers: int, address: str | None, limits: WorkerLimits) -> Runner:
    if name == "local":
        if address is not None:
            raise WrongUse(f"--address {address} is of --runner ray; leave it out, or say --runner ray")
        return LocalRunner(workers or own_cores(), limits)
    if name != "ray":
        raise WrongUse(f"no runner {name!r}; {nearest(name, ('local', 'ray'))}")
    from harness.authoring.catalogue.ray_runner import RayRunner

    return RayRunner(workers or None, limits, address)


def catalogue_status(folder: Path) -> CatalogueStatus:
    """Describe every object of a build, which may be running.

    Raises:
        WrongUse: nothing was built into the folder.
    """
    excluded = read_settings(BuildFolder(folder)).excluded
    objects = tuple(summaries(BuildFolder(folder)))
    return CatalogueStatus(
        folder,
        Counter(each.outcome for each in objects),
        objects,
        excluded,
    )


def draw_catalogue(folder: Path, out: Path | None = None) -> CataloguePage:
    """Write a page of all objects of a build, with a picture of each.

    Raises:
        WrongUse: nothing was built into the folder.
    """
    settings = read_settings(BuildFolder(folder))
    excluded = [(row.name, row.reason) for row in settings.excluded]
    found = summaries(BuildFolder(folder))
    path = write_catalogue_page(found, excluded, settings.catalogue, out or folder / PAGE)
    return CataloguePage(path, path.stat().st_size)


def publish_catalogue(folder: Path, url: str, report: Report) -> PublishedCatalogue:
    """Copy the ObjectFiles of a build to another folder or an object store; a stopped copy is resumed.

    Raises:
        WrongUse: no driver for the URL, or nothing was built into the folder.
    """
    found = tuple(publish(BuildFolder(folder), ObjectStore(url), report))
    counts = Counter(each.outcome for each in found)
    return PublishedCatalogue(url, counts, sum(each.bytes for each in found), found)
