"""Workers that hang, crash or run out of memory are named, and the others go on."""

import os
import signal
from pathlib import Path

import pytest

from harness.authoring.catalogue.build import LocalRunner, wait_for
from harness.authoring.catalogue.layout import BuildFolder, read_record
from harness.authoring.catalogue.spec import BuildSpec
from harness.authoring.catalogue.worker import ObjectWorker, WorkerLimits
from tests.samples.tiny_catalogue import tiny_job

FINE = BuildSpec(("audio",), "smoke", edge=0.6e-3)
"""Elements so fine that filling a block takes minutes and gigabytes."""


def test_a_worker_that_is_killed_is_named_and_replaced(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path / "out")
    job = tiny_job(tmp_path, "block", of)
    worker = ObjectWorker(WorkerLimits(600.0))
    try:
        worker.begin(job)
        os.kill(worker.pid, signal.SIGKILL)
        record = None
        # What the child wrote before its end wakes the first of these waits.
        while record is None:
            wait_for([worker])
            record = worker.poll()
        assert record.outcome == "out of memory"
        assert "was killed" in record.reason
        first = worker.pid
        worker.begin(job, 2)
        assert worker.pid != first
    finally:
        worker.stop()
    assert read_record(of, "block") == record


def test_an_object_that_takes_too_long_is_killed(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path / "out")
    (record,) = LocalRunner(1, WorkerLimits(0.5)).run([tiny_job(tmp_path, "block", of)])
    assert record.outcome == "out of time"
    assert "0.5 s" in record.reason
    assert (of.failed("block") / "record.json").is_file()


def test_a_folder_that_a_node_does_not_see_is_named(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path / "out")
    job = tiny_job(tmp_path, "block", of)
    of.aside.rmdir()
    (record,) = LocalRunner(1, WorkerLimits(600.0)).run([job])
    assert record.outcome == "worker lost"
    assert "NFS" in record.reason


@pytest.mark.slow
def test_a_mesher_that_hangs_or_eats_all_memory_does_not_stop_the_others(tmp_path: Path) -> None:
    of = BuildFolder(tmp_path / "out")
    jobs = [tiny_job(tmp_path, "heavy", of, FINE), tiny_job(tmp_path, "block", of)]
    hung = {record.name: record for record in LocalRunner(1, WorkerLimits(60.0)).run(jobs)}
    assert hung["heavy"].outcome == "out of time"
    assert hung["block"].outcome == "built"
    assert "filling the mesh" in (of.failed("heavy") / "log.txt").read_text()
    starved = [*LocalRunner(1, WorkerLimits(200.0, memory=600_000_000)).run(jobs[:1])]
    assert starved[0].outcome in ("out of memory", "crashed")
    assert starved[0].attempts == 2
