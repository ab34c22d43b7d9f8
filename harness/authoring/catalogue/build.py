"""A catalogue is built: what stands is left alone, the rest goes to a runner."""

import fcntl
import os
import socket
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Protocol

from harness.authoring.catalogue.layout import (
    PASSING,
    BuildFolder,
    ObjectRecord,
    Outcome,
    read_record,
    stands,
)
from harness.authoring.catalogue.rows import CatalogueRow
from harness.authoring.catalogue.spec import BuildItem, BuildSpec, build_item
from harness.authoring.catalogue.worker import Job, ObjectWorker, WorkerLimits
from harness.basics.errors import WrongUse

ATTEMPTS = 2
"""Of an object whose process died: the first may have died of its neighbours' hunger for memory."""

RETRIED: frozenset[Outcome] = frozenset({"crashed", "out of memory"})
"""Outcomes after which an object gets another attempt."""


@dataclass(frozen=True, eq=False)
class BuildPlan:
    """What a build will do."""

    items: tuple[BuildItem, ...]  #: of the catalogue, in its order.
    standing: frozenset[str]  #: names that are built as wanted.
    known: Mapping[str, ObjectRecord]
    """records of objects that failed with the same key, and are not tried again."""
    waiting: tuple[BuildItem, ...]  #: items that are to be built.


def build_plan(
    rows: Sequence[tuple[CatalogueRow, str]], spec: BuildSpec, of: BuildFolder, retry: bool = False
) -> BuildPlan:
    """Compare a catalogue with the files on the disk; every mesh is read once, for its hash.

    With ``retry`` objects that failed are tried again.

    Raises:
        WrongUse: a specification that cannot be built, or a missing mesh.
    """
    spec.check()
    items = tuple(build_item(row, mesh, spec) for row, mesh in rows)
    standing: set[str] = set()
    known: dict[str, ObjectRecord] = {}
    for item in items:
        record = read_record(of, item.row.name)
        if stands(of, record, item.key):
            standing.add(item.row.name)
        elif (
            record is not None
            and not retry
            and (not record.built and record.key == item.key and record.outcome not in PASSING)
        ):
            known[item.row.name] = record
    waiting = tuple(item for item in items if item.row.name not in standing and item.row.name not in known)
    return BuildPlan(items, frozenset(standing), known, waiting)


class Runner(Protocol):
    """Builds objects side by side."""

    def run(self, jobs: Iterable[Job]) -> Iterator[ObjectRecord]:
        """The record of every job, each when it is over, in any order; each is on the disk by then.

        Whoever stops taking records, or is interrupted, stops the jobs that run.
        """


@contextmanager
def held(of: BuildFolder) -> Iterator[None]:
    """Hold a build's folder, creating what must be there; the lock ends with the process.

    Raises:
        WrongUse: another program of this machine holds it.
    """
    of.prepare()
    with of.lock.open("a+") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.seek(0)
            raise WrongUse(
                f"{of.folder} is being built by {lock.read().strip() or 'another program'}; wait for it, or "
                "name another --out"
            ) from None
        lock.truncate(0)
        lock.write(f"process {os.getpid()} on {socket.gethostname()}\n")
        lock.flush()
        yield


class LocalRunner:
    """Processes of this machine, each with one object at a time."""

    def __init__(self, workers: int, limits: WorkerLimits) -> None:
        self._workers, self._limits = workers, limits

    def run(self, jobs: Iterable[Job]) -> Iterator[ObjectRecord]:
        """As ``Runner.run``."""
        waiting = deque((job, 1) for job in jobs)
        workers: list[ObjectWorker] = []
        try:
            while waiting or any(worker.job for worker in workers):
                idle = [worker for worker in workers if worker.job is None]
                while waiting and (idle or len(workers) < self._workers):
                    if not idle:
                        workers.append(ObjectWorker(self._limits))
                        idle.append(workers[-1])
                    idle.pop().begin(*waiting.popleft())
                yield from self._wait_for_jobs(waiting, workers)
        finally:
            for worker in workers:
                worker.stop()

    def _wait_for_jobs(
        self, waiting: deque[tuple[Job, int]], workers: list[ObjectWorker]
    ) -> Iterator[ObjectRecord]:
        """Wait until a job ends, and yield the records of finished jobs; a job that died once is repeated."""
        busy = [worker for worker in workers if worker.job is not None]
        wait_for(busy)
        for worker in busy:
            job, attempt = worker.job, worker.attempt
            record = worker.poll()
            if record is None or job is None:
                continue
            if record.outcome in RETRIED and attempt < ATTEMPTS:
                waiting.append((job, attempt + 1))
            else:
                yield record


def wait_for(busy: Sequence[ObjectWorker]) -> None:
    """Wait until one of some busy workers has ended its job, died, or is out of time."""
    ends = [end for worker in busy for end in worker.waitables]
    wait(ends, timeout=min(worker.seconds_left for worker in busy))
