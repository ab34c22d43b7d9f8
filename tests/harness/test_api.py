"""The scripts under examples/ run as they stand, and say what the functions of ``harness.api`` return."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from harness.api import answer, tactile_image
from harness.basics.errors import OutOfDomain, WrongUse
from tests.support.whole_run import in_process_run, touch_scene

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))


def run(name: str, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / name), *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_has_at_most_15_lines(script: Path) -> None:
    assert len(script.read_text().splitlines()) <= 15


def test_modes_of_a_mesh_are_listed_with_what_they_took() -> None:
    lines = run("modes_of_a_mesh.py").splitlines()
    frequencies = [float(line.split()[0]) for line in lines[:6]]
    assert frequencies == sorted(frequencies)
    assert lines[-1].startswith("none is missing: True")


def test_a_press_is_drawn_to_a_file(tmp_path: Path) -> None:
    said = run("image_of_a_press.py", str(tmp_path / "press.png"))
    assert "(120, 160, 3)" in said
    assert (tmp_path / "press.png").stat().st_size > 1000


def test_a_recording_is_answered_and_nothing_is_written(tmp_path: Path) -> None:
    folder = in_process_run(tmp_path / "run", touch_scene(contacts=3), seed=3).folder
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert run("answer_of_a_recording.py", str(folder)).startswith("touch: (")
    assert answer(folder, ["localization.rounds=0"])["accuracy"]["localization.rounds"] == 0
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_bad_input_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutOfDomain, match=r" mm .* 2 mm"):
        tactile_image("builtin:mug", (0.5, 0.0, 0.0))
    for depth in (2.6e-3, 80e-3):
        with pytest.raises(OutOfDomain, match=r"2\.5 mm"):
            tactile_image("builtin:mug", (-0.04, 0.0, 0.05), depth)
    with pytest.raises(WrongUse, match=r"no run\.json"):
        answer(tmp_path)
