"""Objects built by a Ray cluster: one that runs already, or one started on this machine.

Each Ray worker holds one process of its own that builds (``worker.ObjectWorker``), so that an object that
hangs or crashes is killed and named as on one machine. Ray hands a lost node's objects to others; what a lost
driver had built is on the disk, and the next build begins there.
"""

import contextlib
import logging
import os
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from harness.authoring.catalogue.build import ATTEMPTS, RETRIED, wait_for
from harness.authoring.catalogue.layout import ObjectRecord
from harness.authoring.catalogue.unit import failure
from harness.authoring.catalogue.worker import Job, ObjectWorker, WorkerLimits
from harness.basics.errors import BenchFault, WrongUse

NODES_LOST = 3
"""Times that an object goes to another node after its own was lost; after that it may be what loses them."""

_AHEAD = 2
"""Objects handed to the cluster for each of its cores, so that none waits for the driver."""

_LOOK = 5.0
"""S between two looks at how many cores there are: nodes come and go."""


class RayRunner:
    """A Ray cluster, each core with one object at a time.

    Args:
        workers: objects side by side; None for as many as the cluster has cores.
        limits: of each.
        address: of a cluster that runs, as Ray takes it; None to start one on this machine.
    """

    def __init__(self, workers: int | None, limits: WorkerLimits, address: str | None) -> None:
        self._workers = workers
        self._limits = limits
        self._address = address

    def run(self, jobs: Iterable[Job]) -> Iterator[ObjectRecord]:
        """As ``runner.Runner.run``.

        Raises:
            WrongUse: Ray is not installed.
            BenchFault: there is no cluster at the address.
        """
        ray = _import_ray()
        self._connect(ray)
        remote = ray.remote(num_cpus=1, max_retries=NODES_LOST)(_build)
        waiting, running = iter(jobs), dict[Any, Job]()
        try:
            while True:
                most = self._in_flight(ray)
                while len(running) < most and (job := next(waiting, None)) is not None:
                    running[remote.remote(job, self._limits)] = job
                if not running:
                    return
                done, _ = ray.wait(list(running), timeout=_LOOK)
                for reference in done:
                    yield _record(ray, reference, running.pop(reference))
        finally:
            for reference in running:
                with contextlib.suppress(Exception):  # a cluster that is gone runs nothing
                    ray.cancel(reference, force=True)
            ray.shutdown()

    def _connect(self, ray: Any) -> None:
        own = {"num_cpus": self._workers, "include_dashboard": False} if self._address is None else {}
        try:
            ray.init(
                address=self._address or "local",
                log_to_driver=False,
                logging_level=logging.WARNING,
                **own,
            )
        # Ray raises whatever its parts meet: there is no common class to name.
        except Exception as error:
            where = self._address or "this machine"
            raise BenchFault(
                f"no Ray cluster at {where}: {' '.join(str(error).split())[:200]}; start one with `ray start "
                "--head`, or leave --address out"
            ) from error

    def _in_flight(self, ray: Any) -> int:
        """Objects handed out: each takes a core, and in a cluster of others no more than wanted."""
        if self._workers is not None and self._address is not None:
            return self._workers
        return _AHEAD * max(1, int(ray.cluster_resources().get("CPU", 1)))


def _import_ray() -> Any:
    # Ray reports its use over the network unless this is set before it is imported.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError:
        raise WrongUse("--runner ray needs Ray; install Touchstone with its extra `cluster`") from None
    return ray


def _record(ray: Any, reference: Any, job: Job) -> ObjectRecord:
    """What came of a job, or of the nodes that had it."""
    try:
        record: ObjectRecord = ray.get(reference)
    # Ray names the end of a worker by classes of its own, which are not there to be named without it.
    except Exception as error:  # noqa: BLE001
        reason = (
            f"its nodes or workers were lost {NODES_LOST + 1} times ({type(error).__name__}); build again"
        )
        return failure(job.item, "worker lost", reason, 0.0)
    return record


def _build(job: Job, limits: WorkerLimits) -> ObjectRecord:
    """On a node: build one object in this Ray worker's own process."""
    worker = _own_worker(limits)
    attempt = 0
    while True:
        attempt += 1
        worker.begin(job, attempt)
        while (record := worker.poll()) is None:
            wait_for([worker])
        if record.outcome not in RETRIED or attempt == ATTEMPTS:
            return record


@cache
def _own_worker(limits: WorkerLimits) -> ObjectWorker:
    """One for the life of the Ray worker: it ends when that is gone."""
    return ObjectWorker(limits)
