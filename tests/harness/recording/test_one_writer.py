"""Two processes and one run folder: one of them writes, the other is refused and destroys nothing."""

import multiprocessing
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from harness.basics.errors import WrongUse
from harness.basics.files.lock_file import FOLDER_LOCK, hold_folder
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.scene_object import known_object
from harness.recording.recording import Recording
from harness.recording.run_folder import OBJECT, RunFiles, create_run, station_calibration
from harness.sim.optics.tactile_calibration import TactileCalibration

PAIRS = 12


@cache
def inputs() -> tuple[SceneFile, Station, Mesh, TactileCalibration]:
    scene, station = scene_from_options("builtin:mug"), load_station(station_path("mock"))
    return scene, station, known_object(scene).mesh, station_calibration(station)


def create(folder: Path, seed: int) -> Recording:
    scene, station, mesh, gel = inputs()
    return create_run(folder, "contact-localization", scene, station, mesh, gel, {}, seed, None)


def create_all(folders: list[Path], seed: int, barrier: Any, queue: Any) -> None:
    """Create a run in each folder at the same moment as the other process; puts what came of each."""
    create(folders[0].with_name(f"warm-{seed}"), seed)
    for folder in folders:
        barrier.wait(300)
        try:
            create(folder, seed)
            queue.put((folder, seed, None))
        except Exception as error:  # noqa: BLE001 - whatever it is, the test names it
            queue.put((folder, seed, (type(error).__name__, str(error))))


def test_of_two_starts_in_one_folder_exactly_one_creates_the_run(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    barrier, queue = context.Barrier(2), context.Queue()
    folders = [tmp_path / f"run{k}" for k in range(PAIRS)]
    starters = [context.Process(target=create_all, args=(folders, seed, barrier, queue)) for seed in (1, 2)]
    for starter in starters:
        starter.start()
    outcomes = [queue.get(timeout=120) for _ in range(2 * PAIRS)]
    for starter in starters:
        starter.join(300)
    for folder in folders:
        mine = [(seed, refusal) for where, seed, refusal in outcomes if where == folder]
        (winner,) = [seed for seed, refusal in mine if refusal is None]
        ((kind, sentence),) = [refusal for _, refusal in mine if refusal is not None]
        assert kind == "WrongUse"
        assert str(folder) in sentence
        assert "holds a run already" in sentence or "is writing to" in sentence
        files = RunFiles(Recording(folder))
        assert files.recording.header.seed == winner
        assert len(files.mesh.vertices) > 100
        assert files.calibration.sha256
        assert sorted(path.name for path in folder.iterdir()) == [
            "calibration.npz",
            "object.npz",
            "run.json",
            "steps",
        ]


def test_a_start_in_a_held_folder_is_refused_and_leaves_everything(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with hold_folder(folder):
        (folder / OBJECT).write_text("of the first")
        with pytest.raises(WrongUse, match=f"process {os.getpid()} .*run"):
            create(folder, 1)
        assert (folder / OBJECT).read_text() == "of the first"


def test_files_that_a_run_would_replace_are_refused(tmp_path: Path) -> None:
    (tmp_path / OBJECT).write_text("of before")
    with pytest.raises(WrongUse, match=r"object\.npz"):
        create(tmp_path, 1)
    assert [path.name for path in tmp_path.iterdir()] == [OBJECT]


def test_a_second_session_on_one_run_is_refused(tmp_path: Path) -> None:
    create(tmp_path / "run", 1)
    first, second = Recording(tmp_path / "run"), Recording(tmp_path / "run")
    with first.hold(), pytest.raises(WrongUse, match="process"), second.hold():
        pass
    with second.hold():
        pass
    assert not (tmp_path / "run" / FOLDER_LOCK).exists()


def test_the_lock_of_a_killed_process_is_taken_over(tmp_path: Path) -> None:
    create(tmp_path / "run", 1)
    program = (
        "import sys, time; from pathlib import Path; from harness.recording.recording import Recording\n"
        "with Recording(Path(sys.argv[1])).hold(): print('held', flush=True); time.sleep(600)"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "run")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        said = f"process {holder.pid} "
        with pytest.raises(WrongUse, match=said), Recording(tmp_path / "run").hold():
            pass
        holder.kill()
    assert (tmp_path / "run" / FOLDER_LOCK).exists()
    with Recording(tmp_path / "run").hold():
        pass


def test_a_folder_that_the_holder_created_and_left_empty_is_removed(tmp_path: Path) -> None:
    with hold_folder(tmp_path / "a" / "new"):
        pass
    assert not (tmp_path / "a" / "new").exists()
    (tmp_path / "old").mkdir()
    with hold_folder(tmp_path / "old"):
        pass
    assert (tmp_path / "old").is_dir()
