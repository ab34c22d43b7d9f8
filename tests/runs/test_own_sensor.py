"""A make is its TOML file and a calibration: with these two it is simulated, carried and pressed."""

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from drivers.camera.http_camera import gelsight
from harness.basics.errors import CalibrationRefused, DataRefused, WrongUse
from harness.bench.gap import gap_path
from harness.bench.mock_lab import MockLab
from harness.bench.sensor import described_sensor
from harness.bench.station_file import load_station
from harness.cli import invoke
from harness.objects.household import build
from harness.picture.image_file import read_image
from harness.recording.run_folder import RunFiles, station_calibration
from harness.sim.optics.known_gel import known_gel
from tests.support.touch_command import answered
from tests.support.toy_sensor import TOY_SENSOR, write_calibration, write_station, write_toy
from tests.support.whole_run import in_process_run, touch_scene

PRESS = ("builtin:mug", "--contact", "-0.04", "0", "0.05", "--depth", "0.8mm")


def test_sim_touch_draws_what_a_toy_sees(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, tmp_path, *PRESS, "--sensor", write_toy(tmp_path))
    picture = read_image(tmp_path / "a.png")
    assert picture.shape == (60, 80, 3)
    assert answer["contact"]
    assert np.abs(picture.astype(int) - 110).max() > 10


@pytest.mark.parametrize(("make", "rows", "columns"), [("digit", 320, 240), ("gelsight-mini", 240, 320)])
def test_a_shipped_make_without_a_calibration_takes_one_or_says_how(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], make: str, rows: int, columns: int
) -> None:
    sensor = described_sensor(make).sensor
    how = rf"touchstone calibrate taxim .* --pitch {1e3 * sensor.pitch:g}mm.* {rows} x {columns} pixels"
    with pytest.raises(WrongUse, match=f"{sensor.name}.*{how}"):
        known_gel(make, None)
    with pytest.raises((DataRefused, WrongUse)):
        known_gel(make, "gelsight_r15_bench")
    own = tmp_path / "own.npz"
    write_calibration(own, rows, columns, sensor.pitch)
    answer = answered(capsys, tmp_path, *PRESS, "--sensor", make, "--calibration", own)
    assert answer["contact"]
    assert read_image(tmp_path / "a.png").shape == (rows, columns, 3)
    station = load_station(write_station(tmp_path, make, "own.npz"))
    assert station.gel.sensor.window == sensor.window
    assert station_calibration(station).rows == rows
    other = load_station(write_station(tmp_path, make, "gelsight_r15_bench"))
    with pytest.raises(DataRefused, match=how):
        station_calibration(other)


def test_a_station_names_its_sensor_s_file_beside_it(tmp_path: Path) -> None:
    write_toy(tmp_path)
    station = load_station(write_station(tmp_path, "toy.toml", "toy.npz"))
    assert station.gel.sensor == TOY_SENSOR
    assert station.gel.make == str((tmp_path / "toy.toml").resolve())
    with pytest.raises(WrongUse, match=r"'gel.make' = 'digitt'.*'digit'"):
        load_station(write_station(tmp_path, "digitt", "toy.npz"))
    (tmp_path / "toy.toml").write_text("schema = 1", encoding="utf-8")
    with pytest.raises(WrongUse, match=r"toy\.toml"):
        load_station(write_station(tmp_path, "toy.toml", "toy.npz"))


def test_a_toy_presses_in_process_and_its_run_carries_it(tmp_path: Path) -> None:
    folder = tmp_path / "toy"
    folder.mkdir()
    write_toy(folder)
    station = write_station(folder, "toy.toml", "toy.npz")
    recording = in_process_run(tmp_path / "run", touch_scene(contacts=1), seed=3, station=str(station))
    shutil.rmtree(folder)
    run = RunFiles(recording)
    assert run.station.gel.sensor == TOY_SENSOR
    picture = recording.steps()[0].readings["gel.image"].values[-1]
    assert picture.shape == (60, 80, 3)
    assert np.abs(picture.astype(int) - 110).max() > 10
    world = json.loads(recording.truth_path.read_text())["differences"]
    assert world["calibration"] == "the estimator's"  # there are no other presses of a toy
    assert world["calibration_sha256"] == run.calibration.sha256


def test_an_object_s_touch_is_built_and_rendered_for_a_toy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    toy, out = str(write_toy(tmp_path)), str(tmp_path / "mug")
    built = ["object", "build", "builtin:mug", "--material", "ceramic", "--profile", "smoke", "--out", out]
    assert invoke([*built, "--only", "audio", "--sensor", toy]) == 2
    assert invoke([*built, "--only", "touch", "--sensor", toy]) == 0
    picture = tmp_path / "b.png"
    place = (*PRESS[1:], "--out", str(picture))
    assert invoke(["object", "render", "touch", out, *place]) == 2
    assert "60 x 80 pixels" in " ".join(capsys.readouterr().err.split())
    assert invoke(["object", "render", "touch", out, *place, "--sensor", toy]) == 0
    assert read_image(picture).shape == (60, 80, 3)


@pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux")
def test_a_toy_is_seen_over_its_wire(tmp_path: Path) -> None:
    write_toy(tmp_path)
    station = load_station(write_station(tmp_path, "toy.toml", "toy.npz"))
    mesh = build("mug")
    with MockLab(touch_scene(), station, mesh, 3, gap_path("default"), tmp_path / "truth.json") as lab:
        gel = gelsight(lab.start().addresses["gel"], station.gel.sensor)
        gel.open()
        assert gel.read(1, 5.0).values.shape == (1, 60, 80, 3)
        gel.close()


def test_a_toy_s_calibration_that_is_gone_is_missed_by_name(tmp_path: Path) -> None:
    path = write_toy(tmp_path)
    (tmp_path / "toy.npz").unlink()
    with pytest.raises((WrongUse, CalibrationRefused), match=r"toy\.npz"):
        known_gel(str(path), None)
