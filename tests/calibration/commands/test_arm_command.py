"""The command of calibrations by the arm: one way to the presses at a time; what it cannot know, it says."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.arm.record import read_arm_run
from calibration.taxim.result import MeasuredScale, scale_notes
from harness.cli import invoke
from harness.recording.recording import Recording
from tests.support.arm_presses import begun, performed


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return performed(tmp_path_factory.mktemp("arm") / "run", 16, seed=7)


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The error of a command that must be wrong use."""
    assert invoke(["calibrate", "taxim", *arguments, "--json"]) == 2
    said: str = json.loads(capsys.readouterr().out)["error"]
    return said


def test_one_way_to_the_presses_and_no_more(
    done: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "FOLDER" in refused(["--ball-radius", "2mm"], capsys)
    both = refused([str(done.folder), "--station", "mock"], capsys)
    assert "FOLDER and --station" in both
    late = refused(["--resume", str(done.folder), "--presses", "20", "--gap", "none"], capsys)
    assert "--presses, --gap" in late
    assert "--ball-radius" in refused(["--station", "mock"], capsys)
    assert "--depth 0 mm" not in refused(["--station", "mock", "--ball-radius", "-2mm"], capsys)
    few = ["--station", "mock", "--ball-radius", "2mm", "--presses", "3", "--run", str(tmp_path / "r")]
    assert "--presses 3" in refused(few, capsys)
    assert not (tmp_path / "r").exists()


def test_a_run_keeps_its_ball_and_its_order_of_colours(
    done: Recording, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "--ball-radius 3 mm" in refused([str(done.folder), "--ball-radius", "3mm"], capsys)
    assert "--channels" in refused([str(done.folder), "--channels", "bgr"], capsys)


def test_every_number_of_the_answer_has_its_error(done: Recording) -> None:
    run = read_arm_run(done.folder)
    scale = vars(MeasuredScale.of(run.scale(), run))
    for name, unit in (
        ("pitch", "_m"),
        ("wide", "_m"),
        ("high", "_m"),
        ("aspect", ""),
        ("rotation", "_rad"),
        ("skew", "_rad"),
    ):
        assert scale[f"{name}_within95{unit}"] > scale[f"{name}_sigma{unit}"] > 0.0
    assert scale["pitch_m"] == pytest.approx(0.1245e-3, rel=0.05)
    assert np.array(scale["gel_from_pixels_m"]).shape == (2, 2)
    assert not run.scale().off


def test_it_is_told_that_pictures_were_made_square_and_when_another_aspect_was_taken(done: Recording) -> None:
    run = read_arm_run(done.folder)
    scale = run.scale()
    assert not any(f"{scale.aspect.value:.4f}" in said for said in scale_notes(scale, run, 1.0))
    assert any("1.0300" in said for said in scale_notes(scale, run, 1.03))
    far = scale.aspect.value + 2.0 * scale.aspect.within95
    assert any("--aspect" in said for said in scale_notes(scale, run, far))


def test_a_finished_run_is_resumed_without_a_bench(
    done: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And gives the answer of the folder: the artefact has the arm's pitch, the page its moves."""
    folder = tmp_path / "run"
    shutil.copytree(done.folder, folder)
    assert invoke(["calibrate", "taxim", "--resume", str(folder), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["pitch_m"] == answer["scale"]["pitch_m"]
    assert answer["scale_reason"] is None
    assert answer["presses"] + len(answer["refused"]) == 16
    assert answer["psnr_contact_db"] > answer["psnr_untouched_db"] + 12.0
    assert Path(answer["artefact"]) == folder / "fitted.npz"
    kept = json.loads((folder / "fitted.scale.json").read_text())
    assert kept["rotation_rad"] == answer["scale"]["rotation_rad"]
    assert kept["made_square_by"] == answer["made_square_by"]
    page = Path(answer["report"]).read_text(encoding="utf-8")
    assert "By the arm's moves" in page


def test_a_run_that_has_not_begun_tells_its_folder_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = begun(tmp_path / "run").recording
    assert invoke(["calibrate", "taxim", str(recording.folder), "--json"]) == 1
    assert f"--resume {recording.folder}" in json.loads(capsys.readouterr().out)["error"]
