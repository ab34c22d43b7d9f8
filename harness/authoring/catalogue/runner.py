"""What a runner is, and the one that needs nothing: processes of this machine."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from multiprocessing.connection import wait
from typing import Protocol

from harness.authoring.catalogue.record import ObjectRecord, Outcome
from harness.authoring.catalogue.worker import Job, ObjectWorker, WorkerLimits

ATTEMPTS = 2
"""Of an object whose process died: the first may have died of its neighbours' hunger for memory."""

RETRIED: frozenset[Outcome] = frozenset({"crashed", "out of memory"})
"""Outcomes after which an object gets another attempt."""


class Runner(Protocol):
    """Builds objects side by side."""

    def run(self, jobs: Iterable[Job]) -> Iterator[ObjectRecord]:
        """The record of every job, each when it is over, in any order; each is on the disk by then.

        Whoever stops taking records, or is interrupted, stops the jobs that run.
        """


class LocalRunner:
    """Processes of this machine, each with one object at a time.

    Args:
        workers: how many.
        limits: of each.
    """

    def __init__(self, workers: int, limits: WorkerLimits) -> None:
        self._workers = workers
        self._limits = limits

    def run(self, jobs: Iterable[Job]) -> Iterator[ObjectRecord]:
        """As ``Runner.run``."""
        waiting = deque((job, 1) for job in jobs)
        workers: list[ObjectWorker] = []
        try:
            while waiting or any(worker.job for worker in workers):
                self._hand_out(waiting, workers)
                yield from self._finished(waiting, workers)
        finally:
            for worker in workers:
                worker.stop()

    def _hand_out(self, waiting: deque[tuple[Job, int]], workers: list[ObjectWorker]) -> None:
        """A job for every idle worker; a worker for every job, up to their number."""
        idle = [worker for worker in workers if worker.job is None]
        while waiting and (idle or len(workers) < self._workers):
            if not idle:
                workers.append(ObjectWorker(self._limits))
                idle.append(workers[-1])
            idle.pop().begin(*waiting.popleft())

    def _finished(
        self, waiting: deque[tuple[Job, int]], workers: list[ObjectWorker]
    ) -> Iterator[ObjectRecord]:
        """Wait for something to end, and take all that has; what died once waits again."""
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
