"""A build that is killed loses nothing, by processes and by a cluster of Ray."""

import os
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from harness.authoring.catalogue.build import LocalRunner
from harness.authoring.catalogue.layout import BuildFolder
from harness.authoring.catalogue.worker import WorkerLimits
from tests.samples.tiny_catalogue import all_bytes, block, tiny_job

PROGRAM = str(Path(sys.executable).with_name("touchstone"))


def catalogue(folder: Path, count: int) -> Path:
    names = [f"block{number}" for number in range(count)]
    for number, name in enumerate(names):
        block(folder, name, 0.08 + 0.002 * number)
    path = folder / "objects.csv"
    path.write_text("\n".join(["name,material,units", *(f"{name},wood,m" for name in names)]) + "\n")
    return path


def build(path: Path, out: Path, *more: str) -> list[str]:
    arguments = ["--out", str(out), "--senses", "touch", "--profile", "smoke"]
    return [PROGRAM, "catalogue", "build", str(path), *arguments, *more]


@pytest.mark.slow
def test_a_killed_driver_loses_nothing_and_nothing_is_built_twice(tmp_path: Path) -> None:
    path, out = catalogue(tmp_path, 4), tmp_path / "built"
    with subprocess.Popen(build(path, out, "--workers", "2"), stderr=subprocess.DEVNULL) as driver:
        while not list((out / "records").glob("*.json")):
            assert driver.poll() is None
            time.sleep(0.05)
        driver.send_signal(signal.SIGKILL)
    before = {each.name: each.stat().st_mtime_ns for each in (out / "records").glob("*.json")}
    subprocess.run(build(path, out), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    records = {each.name: each.stat().st_mtime_ns for each in (out / "records").glob("*.json")}
    assert len(records) == 4
    assert {name: records[name] for name in before} == before
    for log in (out / "logs").glob("*.txt"):
        assert log.read_text().count("touch is made") == 1


@pytest.mark.slow
@pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed: the extra cluster")
def test_ray_builds_the_same_bytes(tmp_path: Path) -> None:
    path, out = catalogue(tmp_path, 2), tmp_path / "built"
    subprocess.run(
        build(path, out, "--runner", "ray", "--workers", "1"),
        check=True,
        stdout=subprocess.DEVNULL,
        env={**os.environ, "RAY_USAGE_STATS_ENABLED": "0"},
    )
    of = BuildFolder(tmp_path / "local")
    (record,) = LocalRunner(1, WorkerLimits(600.0)).run([tiny_job(tmp_path, "block0", of)])
    assert record.outcome == "built"
    assert all_bytes(of.object("block0")) == all_bytes(BuildFolder(out).object("block0"))
