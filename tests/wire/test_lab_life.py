"""The mocked lab as a program: it starts, is told things, and leaves nothing behind."""

import json
import os
import select
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.camera.http_camera import gelsight
from harness.basics.errors import BenchFault
from harness.bench.gap import gap_path
from harness.bench.mock_lab import LabAddresses, MockLab
from harness.bench.scene import SceneFile
from harness.bench.sensor import GELSIGHT_R15
from harness.bench.station_file import Station
from harness.objects.household import build

ROOT = Path(__file__).parents[2]
PORTS = (29999, 30001, 30002, 30003, 30004, 30011, 8080, 8081)

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux")


def make_lab(scene: SceneFile, station: Station, truth: Path, seed: int = 3) -> MockLab:
    return MockLab(scene, station, build("mug"), seed, gap_path("default"), truth)


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("truth") / "truth.json"


@pytest.fixture(scope="module")
def lab(scene: SceneFile, station: Station, truth: Path) -> Iterator[tuple[MockLab, LabAddresses]]:
    with make_lab(scene, station, truth) as lab:
        yield lab, lab.start()


def answers(address: str, port: int) -> bool:
    try:
        socket.create_connection((address, port), 1.0).close()
    except OSError:
        return False
    return True


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def children(pid: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def gone(pids: list[int], address: str, seconds: float = 60.0) -> bool:
    """Whether every process has ended and every port is free again, within so many seconds.

    A process whose first thread is dead may hold its ports until the others are.
    """
    end = time.monotonic() + seconds
    while any(alive(pid) for pid in pids) or any(answers(address, port) for port in PORTS):
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def test_every_instrument_answers_on_an_address_of_its_own(lab: tuple[MockLab, LabAddresses]) -> None:
    _, where = lab
    assert where.addresses["arm"].startswith("127.")
    assert list(where.addresses) == ["arm", "gel"]
    assert all(answers(where.addresses["arm"], port) for port in (29999, 30003, 30004, 8080))


def test_a_mark_is_shown_before_it_is_answered(lab: tuple[MockLab, LabAddresses], truth: Path) -> None:
    program, _ = lab
    assert program.ask({"mark": {"step": 2, "sample": -1}}) == {"marked": {"step": 2, "sample": -1}}
    program.mark(2, 0)
    written = json.loads(truth.read_text())
    assert [contact["step"] for contact in written["contacts"]] == [2]
    assert np.array(written["base_from_object"]).shape == (4, 4)
    assert written["contacts"][0]["penetration_m"] == 0.0  # the arm is at home
    assert "object_yaw_rad" in written["differences"]


@pytest.mark.parametrize(
    "request_",
    [
        {"mark": {"step": 1}},
        {"marc": {}},
        {"mark": {"step": 1.5, "sample": 0}},
        {"fault": {"instrument": "gel"}},
    ],
    ids=str,
)
def test_a_request_it_does_not_know_is_refused(
    lab: tuple[MockLab, LabAddresses], request_: dict[str, object]
) -> None:
    with pytest.raises(BenchFault, match="refused"):
        lab[0].ask(request_)


def test_a_fault_reaches_the_instrument(lab: tuple[MockLab, LabAddresses]) -> None:
    program, where = lab
    gel = gelsight(where.addresses["gel"], GELSIGHT_R15)
    gel.open()
    program.fault("gel", "stall", 0.8)
    with pytest.raises(BenchFault, match=r"of 6 frames.*0\.4 s"):
        gel.read(6, 0.4)
    assert gel.read(2, 5.0).values.shape == (2, 120, 160, 3)
    gel.close()


def test_the_gel_shows_the_untouched_gel_at_home(lab: tuple[MockLab, LabAddresses]) -> None:
    gel = gelsight(lab[1].addresses["gel"], GELSIGHT_R15)
    gel.open()
    first, second = gel.read(2, 2.0).encoded
    gel.close()
    assert first == second


_RUN = """
import sys, time
sys.path.insert(0, {tests!r})
from pathlib import Path
import test_lab_life as t
from harness.bench.scene import load_scene
from harness.bench.station_file import load_station, station_path
scene, station = load_scene(Path("mug_touch")), load_station(station_path("mock"))
lab = t.make_lab(scene, station, Path({truth!r}))
where = lab.start()
print(lab.process_id, where.addresses["arm"], lab._folder.path, flush=True)
time.sleep(60.0)
"""


@pytest.mark.parametrize("victim", ["run", "lab"])
def test_kill_leaves_no_process_and_no_port(tmp_path: Path, victim: str) -> None:
    code = _RUN.format(tests=str(Path(__file__).parent), truth=str(tmp_path / "truth.json"))
    run = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert run.stdout is not None
    lab_pid, address, folder = run.stdout.readline().split()
    pids = [int(lab_pid), *children(int(lab_pid))]
    assert len(pids) == 3
    try:
        os.kill(run.pid if victim == "run" else int(lab_pid), signal.SIGKILL)
        assert gone(pids, address)
    finally:
        run.kill()
        run.wait()
        run.stdout.close()
        shutil.rmtree(folder)


def test_two_labs_live_side_by_side_and_end_of_file_ends_one(
    lab: tuple[MockLab, LabAddresses], scene: SceneFile, station: Station, tmp_path: Path
) -> None:
    other = make_lab(scene, station, tmp_path / "truth.json", seed=4)
    where = other.start()
    assert where.addresses["arm"] != lab[1].addresses["arm"]
    assert answers(where.addresses["arm"], 30004)
    pids = [other.process_id, *children(other.process_id)]
    assert len(pids) == 3
    other.close()
    assert gone(pids, where.addresses["arm"])
    assert answers(lab[1].addresses["arm"], 30004)


def test_a_script_reads_where_the_instruments_are_while_they_run_and_ends_them() -> None:
    """What it waits for may not stay in a buffer, as a pipe's does unless the environment says otherwise."""
    # As at a terminal: a test run in the background hands on that Ctrl-C is ignored.
    heed = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{heed}; import sys; from harness.cli import invoke; sys.exit(invoke(sys.argv[1:]))"
    command = [sys.executable, "-c", program, "mock-lab", "--json"]
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT, env=buffered) as bench:
        assert bench.stdout is not None
        try:
            assert select.select([bench.stdout], [], [], 60.0)[0], "no line was said"
            where = json.loads(bench.stdout.readline())
            assert bench.poll() is None
            assert answers(where["arm"], 30004)
            (lab_pid,) = children(bench.pid)
            pids = [lab_pid, *children(lab_pid)]
            bench.send_signal(signal.SIGINT)
            assert bench.wait(20.0) == 0
            assert bench.stdout.read() == b"", "one object, and no more"
            assert gone(pids, where["arm"])
        finally:
            bench.kill()
