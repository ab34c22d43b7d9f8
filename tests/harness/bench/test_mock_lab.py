"""The station's end of the lab's pipe: started, told, ended; never left behind."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import BenchFault
from harness.basics.mesh import Mesh
from harness.bench import mock_lab
from harness.bench.gap import gap_path
from harness.bench.mock_lab import LabAddresses, MockLab
from harness.bench.scene import SceneFile, load_scene, scene_from_json, scene_from_options
from harness.bench.station_file import load_station, station_from_json, station_path

FAKE = (sys.executable, str(Path(__file__).with_name("fake_lab.py")))
MESH = Mesh(np.vstack([np.zeros(3), np.eye(3)]) * 0.1, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
STATION = load_station(station_path("mock"))


def lab(folder: Path, behaviour: int = 0, scene: SceneFile | None = None) -> MockLab:
    scene = scene or scene_from_options("builtin:mug")
    return MockLab(scene, STATION, MESH, behaviour, gap_path("none"), folder / "truth.json", FAKE)


@pytest.fixture
def running(tmp_path: Path) -> Iterator[MockLab]:
    with lab(tmp_path) as made:
        made.start()
        yield made


def alive(process_id: int) -> bool:
    try:
        os.kill(process_id, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_lab_says_where_its_instruments_are_and_takes_marks_and_faults(tmp_path: Path) -> None:
    with lab(tmp_path) as made:
        where = LabAddresses({"arm": "127.7.7.7", "gel": "http://127.7.7.7:8080/?action=stream"})
        assert made.start() == where
        made.mark(3, -1)
        made.fault("gel", "stall", 2.0)
        assert made.ask({"mark": {"step": 1, "sample": 0}}) == {"marked": {"step": 1, "sample": 0}}
        process_id = made.process_id
    assert not alive(process_id)
    made.close()


def test_the_lab_is_told_scene_station_and_pose(running: MockLab) -> None:
    told = running.ask({"told": True})["told"]
    assert station_from_json(told["station"], "the lab") == STATION
    scene = scene_from_json(told["scene"], "the lab")
    assert scene == scene_from_options("builtin:mug")
    assert np.array_equal(told["base_from_object"], scene.base_from_object(MESH))
    assert told["mesh"] is None


def test_an_object_from_a_file_travels_as_its_repaired_mesh(tmp_path: Path) -> None:
    (tmp_path / "cup.stl").write_bytes(b"what the lab does not read again")
    (tmp_path / "s.toml").write_text(
        'schema = 1\n[object]\nmesh = "cup.stl"\nmaterial = "glass"', encoding="utf-8"
    )
    with lab(tmp_path, scene=load_scene(tmp_path / "s.toml")) as made:
        made.start()
        with np.load(made.ask({"told": True})["told"]["mesh"]) as archive:
            assert np.array_equal(archive["vertices"], MESH.vertices)
            assert np.array_equal(archive["faces"], MESH.faces)


@pytest.mark.parametrize(
    ("behaviour", "said"),
    [(1, "no loopback address is free"), (2, "it broke")],
)
def test_a_lab_that_does_not_start_says_why_and_is_gone(tmp_path: Path, behaviour: int, said: str) -> None:
    made = lab(tmp_path, behaviour)
    with pytest.raises(BenchFault, match=said):
        made.start()
    with pytest.raises(BenchFault, match="station"):
        made.mark(0, 0)


def test_a_silent_lab_is_given_up_and_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mock_lab, "READY_WITHIN", 0.3)
    monkeypatch.setattr(mock_lab, "END_WITHIN", 0.3)
    with pytest.raises(BenchFault, match=r"0\.3 s"):
        lab(tmp_path, 3).start()


def test_a_lab_that_dies_is_noticed_at_the_next_word(tmp_path: Path) -> None:
    with lab(tmp_path, 4) as made:
        made.start()
        with pytest.raises(BenchFault, match="the world ended"):
            made.mark(0, 0)
        with pytest.raises(BenchFault, match="mocked lab"):
            made.mark(0, 1)


def test_what_the_lab_refuses_is_passed_on(running: MockLab) -> None:
    with pytest.raises(BenchFault, match="'nonsense'"):
        running.fault("gel", "nonsense")
    running.mark(0, 0)


def test_a_lab_does_not_outlive_a_station_that_is_killed(tmp_path: Path) -> None:
    program = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_mock_lab import lab
made = lab(Path({str(tmp_path)!r}))
made.start()
print(made.process_id, flush=True)
time.sleep(600)
"""
    station = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert station.stdout is not None
    process_id = int(station.stdout.readline())
    station.kill()
    station.wait()
    station.stdout.close()
    end = time.monotonic() + 60.0
    while alive(process_id) and time.monotonic() < end:
        time.sleep(0.01)
    assert not alive(process_id)
