"""A worker process for one object at a time, which can hang or die without taking anything with it."""

import contextlib
import faulthandler
import os
import resource
import signal
import socket
import sys
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

import numba
from threadpoolctl import threadpool_limits

from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, Outcome, write_record
from harness.authoring.catalogue.spec import BuildItem, BuildSpec
from harness.authoring.catalogue.unit import build_object, failure
from harness.basics.worker_pool import end_without_parent


@dataclass(frozen=True)
class WorkerLimits:
    """What a worker may use."""

    seconds: float  #: on the clock, for one object; then its process is killed.
    memory: int | None = None  #: bytes of data; None for what the machine has.


@dataclass(frozen=True)
class Job:
    """One object to build."""

    item: BuildItem  #: the object.
    spec: BuildSpec  #: what is built of it.
    folder: BuildFolder  #: of the build.


class ObjectWorker:
    """A process that builds objects, replaced when it hangs or dies; one job at a time."""

    def __init__(self, limits: WorkerLimits) -> None:
        self._limits = limits
        self.job: Job | None = None  #: whose record was not taken yet; None while idle.
        self.attempt = 0  #: at that job, from 1.
        self._begun = 0.0
        self._start()

    @property
    def pid(self) -> int:
        """Number of the process."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def waitables(self) -> tuple[Connection, int]:
        """For ``multiprocessing.connection.wait``: ready when the job is over or the process has died."""
        return self._pipe, self._process.sentinel

    @property
    def seconds_left(self) -> float:
        """Until the job is out of time."""
        return max(0.0, self._begun + self._limits.seconds - time.monotonic())

    def begin(self, job: Job, attempt: int = 1) -> None:
        """Give the process a job."""
        if not self._process.is_alive():
            self._start()
        self.job, self.attempt, self._begun = job, attempt, time.monotonic()
        with contextlib.suppress(OSError):  # it died just now, which ``poll`` notices
            self._pipe.send(job)

    def poll(self) -> ObjectRecord | None:
        """The job's record, whatever came of it; None while it runs."""
        if self.job is None:
            return None
        if self._pipe.poll():
            with contextlib.suppress(EOFError, OSError):
                return self._ended(self._pipe.recv())
        if not self._process.is_alive():
            return self._lost()
        if self.seconds_left > 0.0:
            return None
        self.stop()
        reason = (
            f"it took more than {self._limits.seconds:.4g} s and was killed; look into its log for what it "
            "was doing, simplify its mesh, or allow more with --time-limit"
        )
        return self._ended(self._written("out of time", reason))

    def stop(self) -> None:
        """Kill the process, whatever it does."""
        self._process.kill()
        self._process.join()
        self._pipe.close()

    def _start(self) -> None:
        spawn = get_context("spawn")  # threads of compiled kernels do not survive a fork
        self._pipe, theirs = spawn.Pipe()
        self._process = spawn.Process(
            target=_serve, args=(theirs, self._limits.memory, os.getpid()), daemon=True
        )
        self._process.start()
        theirs.close()

    def _ended(self, record: ObjectRecord) -> ObjectRecord:
        self.job = None
        return record.model_copy(update={"attempts": self.attempt})

    def _lost(self) -> ObjectRecord:
        self._process.join()
        code = self._process.exitcode or 0
        self._pipe.close()
        if code == -signal.SIGKILL:
            reason = "its process was killed, as a machine does that is out of memory; run fewer --workers"
            return self._ended(self._written("out of memory", reason))
        name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        reason = f"its process ended with {name}; its log says where"
        return self._ended(self._written("crashed", reason))

    def _written(self, outcome: Outcome, reason: str) -> ObjectRecord:
        job = self.job
        assert job is not None
        record = failure(job.item, outcome, reason, time.monotonic() - self._begun)
        with contextlib.suppress(OSError):  # of a full disk; the record goes to the runner all the same
            write_record(record, job.folder)
        return record


def _serve(pipe: Connection, memory: int | None, parent: int) -> None:
    """Build one object after another until the parent is gone."""
    end_without_parent(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of the terminal: the parent decides
    # One thread each: workers share the cores, and sums of one order have one result.
    threadpool_limits(limits=1)
    numba.set_num_threads(1)
    if memory is not None:
        resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    while True:
        try:
            job = pipe.recv()
        except EOFError:
            return
        if job.folder.aside.is_dir():
            with _logged(job.folder.log(job.item.row.name)):
                record = _built(job)
        else:
            where = f"{socket.gethostname()} has no folder {job.folder.folder}"
            reason = f"{where}; all machines must see it under one path, as by NFS"
            record = failure(job.item, "worker lost", reason, 0.0)
        pipe.send(record)


def _built(job: Job) -> ObjectRecord:
    print(f"{job.item.row.name}, key {job.item.key}", flush=True)  # noqa: T201 - this is its log
    begun = time.perf_counter()
    try:
        return build_object(job.item, job.spec, job.folder, _log_progress)
    except Exception as error:  # noqa: BLE001 - a mistake of the program stops one object, not a thousand
        traceback.print_exc()
        reason = f"{type(error).__name__}: {error}; this is a mistake of the program, report it with the log"
        record = failure(job.item, "failed", reason, time.perf_counter() - begun)
    sys.stdout.flush()
    sys.stderr.flush()
    write_record(record, job.folder)
    return record


def _log_progress(doing: str, share: float) -> None:
    print(f"{time.strftime('%H:%M:%S')} {doing} ({share:.0%})", flush=True)  # noqa: T201 - this is its log


@contextlib.contextmanager
def _logged(path: Path) -> Iterator[None]:
    """All that the process prints meanwhile, compiled libraries too, and where it crashes, goes to a file.

    Attempts follow each other there.
    """
    try:
        log = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError:  # a full disk has no log
        log = os.open(os.devnull, os.O_WRONLY)
    os.dup2(log, 1)
    os.dup2(log, 2)
    os.close(log)
    faulthandler.enable(sys.stderr)
    yield
    sys.stdout.flush()
    sys.stderr.flush()
