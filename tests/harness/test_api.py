"""The scripts under examples/ run as they stand, and say what the functions of ``harness.api`` return."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from inspect import isfunction
from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import touchstone
from harness import api
from harness.api import answer, tactile_image
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.cli import invoke
from harness.picture.image_file import write_png
from harness.report.figures import shading
from tests.samples.drawn_presses import drawn_set
from tests.support.whole_run import in_process_run, touch_scene

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
FUNCTIONS = [name for name in api.__all__ if isfunction(getattr(api, name))]
COMMANDS = {
    "build_objectfile": "object build builtin:bowl --material ceramic --out bowl",
    "calibrate_taxim": "calibrate taxim . --ball-radius 2mm --pitch 0.1mm",
    "check_station": "check",
    "compare": "compare run",
    "compare_vision": "object compare vision mug --live a.png --camera 0.2 0 0 --out b.png",
    "depth": "depth a.png --calibration gelsight_r15_bench",
    "load_object": "object info mug",
    "modes": "sim modes builtin:bowl --material ceramic",
    "open_station": "check",
    "render_audio": "object render audio mug --vertex 0 --out a.wav",
    "render_touch": "sim touch builtin:mug --vertex 0 --out b.png",
    "render_vision": "object render vision mug --out b.png",
    "replay": "replay run",
    "run": "run --object mug",
    "take_picture": "camera gel --out b.png",
    "verify_object": "object verify mug",
}
"""A command for each function of the API."""

HOMES = {"open_station": "harness.tasks.bench"}
"""Modules through which a command reaches a function that it does not name itself."""


PROGRAM = """
import io, json, runpy, sys, traceback
from contextlib import redirect_stdout
results = {}
for name, script, arguments in json.loads(sys.argv[1]):
    sys.argv[1:], text = arguments, io.StringIO()
    try:
        with redirect_stdout(text):
            runpy.run_path(script, run_name="__main__")
        results[name] = [True, text.getvalue()]
    except BaseException:
        results[name] = [False, text.getvalue() + traceback.format_exc()]
print(json.dumps(results))
"""
"""Runs each script as ``python SCRIPT ARGUMENTS`` does, all in one process: they import the same modules."""


class Examples:
    """Folder and printed text of the example scripts."""

    def __init__(
        self, folder: Path, results: Mapping[str, tuple[bool, str]], before: Mapping[Path, bytes]
    ) -> None:
        self.folder = folder
        self.before = before  #: files of the recording before the scripts ran.
        self._results = results

    def printed(self, name: str) -> str:
        """Return what a script printed; fail with its traceback if it raised."""
        ended, text = self._results[name]
        assert ended, text
        return text


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two contacts, recorded and not answered; nothing may be written in its folder."""
    return in_process_run(tmp_path_factory.mktemp("recorded") / "run", touch_scene(contacts=2), seed=3).folder


def files_of(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def examples(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> Examples:
    """All example scripts, run."""
    folder = tmp_path_factory.mktemp("examples")
    drawn, _ = drawn_set(18)
    (folder / "presses").mkdir()
    for index, image in enumerate(drawn.images):
        write_png(folder / "presses" / f"{index:02d}.png", image)
    write_png(folder / "presses" / "empty.png", drawn.background)
    arguments = {
        "answer_of_a_recording": [str(recorded)],
        "calibration_of_a_gel": [str(folder / "presses")],
        "image_of_a_press": [str(folder / "press.png")],
        "instruments_of_a_bench": [str(folder / "gel.png")],
        "modes_of_a_mesh": [],
        "objectfile_of_a_mesh": [str(folder / "wrench")],
        "picture_of_an_object": [str(folder / "mug.png"), "mug"],
        "run_on_a_bench": [str(folder / "run")],
        "sound_of_a_strike": [str(folder / "mug.wav"), "mug"],
    }
    assert list(arguments) == [path.stem for path in SCRIPTS]
    before = files_of(recorded.parent)
    scripts = [(path.stem, str(path), arguments[path.stem]) for path in SCRIPTS]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(scripts)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr
    return Examples(folder, json.loads(done.stdout.splitlines()[-1]), before)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_has_at_most_15_lines(script: Path) -> None:
    assert len(script.read_text().splitlines()) <= 15


def test_modes_of_a_mesh_are_listed_with_what_they_took(examples: Examples) -> None:
    lines = examples.printed("modes_of_a_mesh").splitlines()
    frequencies = [float(line.split()[0]) for line in lines[:6]]
    assert frequencies == sorted(frequencies)
    assert lines[-1].startswith("none is missing: True")


def test_a_press_is_rendered_to_a_file_and_its_depth_is_read_again(examples: Examples) -> None:
    printed = examples.printed("image_of_a_press")
    assert "(120, 160, 3)" in printed
    rendered, read = (float(text) for text in re.findall(r"([\d.]+) mm at the deepest", printed))
    assert read == pytest.approx(rendered, rel=0.2)
    assert (examples.folder / "press.png").stat().st_size > 1000


def test_a_strike_is_written_as_a_sound(examples: Examples) -> None:
    assert "modes; the loudest" in examples.printed("sound_of_a_strike")
    assert (examples.folder / "mug.wav").stat().st_size > 60_000


def test_an_object_is_rendered_by_its_networks(examples: Examples) -> None:
    printed = examples.printed("picture_of_an_object")
    assert "160 x 120 pixels" in printed
    assert float(re.findall(r"SSIM ([\d.]+)", printed)[0]) > 0.98
    assert (examples.folder / "mug.png").stat().st_size > 1000


def test_a_run_is_made_replayed_and_compared(examples: Examples) -> None:
    printed = examples.printed("run_on_a_bench")
    assert "touch against the " in printed
    assert Path(printed.partition(": ")[0]).stat().st_size > 1000
    assert (examples.folder / "run-replay" / "result.json").exists()


def test_the_instruments_of_a_bench_are_checked(examples: Examples) -> None:
    assert "gel: " in examples.printed("instruments_of_a_bench")
    assert (examples.folder / "gel.png").stat().st_size > 1000


def test_an_objectfile_is_built_and_verified(examples: Examples) -> None:
    assert "checks hold" in examples.printed("objectfile_of_a_mesh")


def test_a_gel_is_calibrated_from_images(examples: Examples) -> None:
    assert "18 presses" in examples.printed("calibration_of_a_gel")
    assert (examples.folder / "presses" / "calibration.npz").exists()


def test_every_function_is_shown_in_an_example() -> None:
    text = "".join(path.read_text() for path in (*SCRIPTS, ROOT / "examples" / "tour.ipynb"))
    assert [name for name in FUNCTIONS if f"touchstone.{name}(" not in text] == []


class _Called(DataRefused):
    """The function of the API was called."""


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_a_command_calls_the_function_of_its_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command parses and prints; the work is the function's."""

    def called(*_: object, **__: object) -> None:
        raise _Called(f"{name} was called")

    monkeypatch.chdir(tmp_path)
    write_png(tmp_path / "a.png", np.zeros((120, 160, 3), np.uint8))
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_text("{}")
    monkeypatch.setattr(HOMES.get(name, "harness.api") + f".{name}", called)
    assert invoke(COMMANDS[name].split()) == 1
    assert f"{name} was called" in capsys.readouterr().err


def test_each_function_has_a_command() -> None:
    assert set(FUNCTIONS) - set(COMMANDS) == {"answer", "tactile_image"}


def test_the_other_two_are_shorter_forms(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shading, "_OVERSAMPLING", 1)
    replayed = touchstone.replay(recorded, out=tmp_path / "replay").result
    answered = answer(recorded)
    assert replayed["accuracy"] == answered["accuracy"]
    places = [each["estimates"]["touch"]["position_m"] for each in (replayed, answered)]
    assert places[0] == places[1]

    def called(*_: object, **__: object) -> None:
        raise _Called

    monkeypatch.setattr("harness.tasks.touch.render_touch", called)
    with pytest.raises(_Called):
        tactile_image("builtin:mug", (-0.04, 0.0, 0.05))


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


def test_a_recording_is_answered_and_nothing_is_written(recorded: Path, examples: Examples) -> None:
    assert examples.printed("answer_of_a_recording").startswith("touch: (")
    assert answer(recorded, ["localization.rounds=0"])["accuracy"]["localization.rounds"] == 0
    assert files_of(recorded.parent) == examples.before


def test_bad_input_is_named(tmp_path: Path) -> None:
    with pytest.raises(OutOfDomain, match=r" mm .* 2 mm"):
        tactile_image("builtin:mug", (0.5, 0.0, 0.0))
    for depth in (2.6e-3, 80e-3):
        with pytest.raises(OutOfDomain, match=r"2\.5 mm"):
            tactile_image("builtin:mug", (-0.04, 0.0, 0.05), depth)
    with pytest.raises(WrongUse, match=r"no run\.json"):
        answer(tmp_path)
