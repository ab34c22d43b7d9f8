"""What a power cut leaves of a run: every step that was committed, and all that the run is answered from."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, create_run, station_calibration
from tests.samples.recorded_step import sample_header, sample_step
from tests.support.power_cut import PowerCut


@pytest.fixture
def cut(monkeypatch: pytest.MonkeyPatch) -> Iterator[PowerCut]:
    power = PowerCut(monkeypatch)
    yield power
    power.close()


@pytest.fixture
def there(tmp_path: Path) -> Path:
    """A folder that was on the disk before."""
    folder = tmp_path / "there"
    folder.mkdir()
    return folder


def test_a_new_run_survives(cut: PowerCut, there: Path, tmp_path: Path) -> None:
    Recording.create(there / "runs" / "one", sample_header())
    left = cut.left_of(there, tmp_path / "left")
    assert Recording(left / "runs" / "one").header == sample_header()


def test_a_committed_step_survives(cut: PowerCut, there: Path, tmp_path: Path) -> None:
    recording = Recording.create(there / "run", sample_header())
    for index in range(2):
        record = sample_step(index)
        recording.commit(record.step, list(record.readings.values()), record.seconds)
    left = Recording(cut.left_of(there, tmp_path / "left") / "run")
    assert [record.step for record in left.steps()] == [sample_step(0).step, sample_step(1).step]


def test_what_a_run_is_answered_from_survives(cut: PowerCut, there: Path, tmp_path: Path) -> None:
    scene, station = scene_from_options("builtin:mug"), load_station(station_path("mock"))
    mesh, gel = known_object(scene).mesh, station_calibration(station)
    box = station.hammer.acquisition if station.hammer else None
    create_run(there / "run", "contact-localization", scene, station, mesh, gel, {}, 0, None, box)
    run = RunFiles(Recording(cut.left_of(there, tmp_path / "left") / "run"))
    assert np.array_equal(run.mesh.vertices, mesh.vertices)
    assert run.calibration.sha256 == gel.sha256
    assert isinstance(run.acquisition, AcquisitionCalibration)
    assert run.station == station


def test_a_run_that_cannot_be_made_leaves_nothing(there: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, station = scene_from_options("builtin:mug"), load_station(station_path("mock"))
    mesh, gel = known_object(scene).mesh, station_calibration(station)
    (there / "mine").mkdir()
    (there / "mine" / "notes.txt").write_text("of before")
    for folder in (there / "run", there / "mine"):
        with pytest.raises(ValueError, match="not JSON compliant"):
            create_run(
                folder, "contact-localization", scene, station, mesh, gel, {"at": float("nan")}, 0, None
            )
    assert [path.relative_to(there).as_posix() for path in there.rglob("*")] == ["mine", "mine/notes.txt"]


def test_a_run_without_header_is_none(there: Path) -> None:
    with pytest.raises(WrongUse, match=r"no run\.json"):
        Recording(there)
