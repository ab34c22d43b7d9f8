"""The scripts under examples/ run as they stand, and say what the functions of ``harness.api`` return."""

import os
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import touchstone
from harness import api
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


def test_a_strike_is_written_as_a_sound(tmp_path: Path) -> None:
    said = run("sound_of_a_strike.py", str(tmp_path / "a.wav"), "mug")
    assert "modes; the loudest" in said
    assert (tmp_path / "a.wav").stat().st_size > 60_000


def test_an_object_is_drawn_by_its_networks(tmp_path: Path) -> None:
    said = run("picture_of_an_object.py", str(tmp_path / "a.png"), "mug")
    assert "160 x 120 pixels" in said
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_the_notebook_runs() -> None:
    notebook = nbformat.read(ROOT / "examples" / "tour.ipynb", as_version=4)  # type: ignore[no-untyped-call]
    NotebookClient(notebook, resources={"metadata": {"path": str(ROOT)}}).execute()
    pictures = [output for cell in notebook.cells for output in cell.get("outputs", ()) if "data" in output]
    assert sum("image/png" in picture["data"] for picture in pictures) == 3


def test_touchstone_hands_on_every_name() -> None:
    assert touchstone.__all__ == api.__all__ == dir(api)
    for name in api.__all__:
        assert getattr(touchstone, name) is getattr(api, name)
    with pytest.raises(AttributeError, match="no attribute 'mode'"):
        touchstone.mode  # noqa: B018 - mypy sees __getattr__


def test_importing_touchstone_imports_nothing_else() -> None:
    program = "import sys, touchstone; print({'numpy', 'harness.tasks'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


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
