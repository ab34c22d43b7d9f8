"""Missing input files are wrong use with exit code 2, and mistyped names are refused before heavy imports."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from harness.cli import invoke

MUG = ("builtin:mug", "--contact", "-0.04", "0", "0.05", "--out", "t.png")
COMMANDS = (
    ("run", "--object", "absent.obj", "--material", "steel"),
    ("run", "--object", "builtin:mug", "--station", "absent.toml"),
    ("run", "--object", "builtin:mug", "--gap", "absent.toml"),
    ("run", "--object", "builtin:mug", "--objectfile", "absent"),
    ("run", "--resume", "absent"),
    ("replay", "absent"),
    ("explain", "absent.toml"),
    ("check", "--station", "absent.toml"),
    ("tables", "contact-localization", "--gap", "absent.toml"),
    ("depth", "absent.png", "--calibration", "gelsight_r15_bench", "--out", "d.npz"),
    ("depth", "absent.png", "--calibration", "absent.npz", "--out", "d.npz"),
    ("object", "build", "absent.obj", "--material", "steel", "--out", "o"),
    ("object", "build", "absent.obj", "--material", "steel", "--only", "touch", "--out", "o"),
    ("object", "build", "absent.obj", "--material", "steel", "--only", "vision", "--out", "o"),
    ("object", "info", "absent"),
    ("object", "verify", "absent"),
    ("object", "view", "absent"),
    ("object", "render", "audio", "absent", "--vertex", "1", "--out", "a.wav"),
    ("object", "render", "touch", "absent", "--contact", "0", "0", "0", "--out", "a.png"),
    ("object", "render", "vision", "absent", "--camera", "1", "0", "0", "--out", "a.png"),
    ("calibrate", "markers", "absent.png", "--out", "m.json"),
    ("calibrate", "taxim", "absent", "--ball-radius", "2mm", "--pitch", "0.03mm", "--out", "c.npz"),
    ("sim", "modes", "absent.obj", "--material", "steel"),
    ("sim", "modes", "absent.inp", "--material", "steel"),
    ("sim", "touch", "absent.obj", "--contact", "0", "0", "0", "--out", "t.png"),
    ("sim", "touch", "--height", "absent.npy", "--out", "t.png"),
    ("sim", "touch", *MUG, "--calibration", "absent.npz"),
    ("sim", "touch", *MUG, "--background", "absent.png"),
    ("sim", "touch", *MUG, "--markers", "absent.json"),
    ("sim", "touch", *MUG, "--objectfile", "absent"),
    ("cost", "vision", "absent.obj"),
    ("camera", "scene", "--object", "absent.stl"),
    ("object", "render", "queries", "absent", "--out", "q"),
    ("object", "compare", "vision", "absent", "--out", "q.png"),
    ("compare", "absent"),
    ("mock-lab", "--scene", "absent"),
)


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_what_is_not_there_is_wrong_use(
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert invoke(list(words)) == 2
    assert "absent" in capsys.readouterr().err


MISTYPED = (
    ("there is no scene 'nosuch'", ("run", "--scene", "nosuch")),
    ("did you mean 'mug_touch'?", ("run", "--scene", "mug_tuch")),
    ("did you mean 'contact-localization'?", ("run", "contact-localizatoin")),
    ("did you mean 'shape-reconstruction'?", ("demo", "shape-reconstructoin")),
    ("there is no station 'mok'; did you mean 'mock'?", ("run", "--station", "mok")),
    ("--object: there is no built-in object 'mgu'; did you mean 'mug'?", ("run", "--object", "builtin:mgu")),
    ("there is no file", ("run", "--object", "nosuch.stl")),
    ("--objectfile: there is no ObjectFile", ("run", "--objectfile", "mgu")),
    ("there is no run nosuch", ("run", "--resume", "nosuch")),
    ("there is no run nosuch", ("replay", "nosuch")),
    ("there is no run nosuch", ("compare", "nosuch")),
    ("there is no scene 'nosuch'", ("explain", "nosuch")),
    ("there is no file", ("sim", "touch", "nosuch.stl", "--vertex", "1", "--out", "x.png")),
    ("there is no file", ("sim", "modes", "nosuch.stl")),
    ("there is no file", ("camera", "scene", "--object", "nosuch.stl")),
    ("there is no file", ("object", "build", "nosuch.stl", "--material", "steel", "--out", "x")),
    ("there is no ObjectFile", ("object", "info", "nosuch")),
    ("there is no ObjectFile", ("object", "view", "nosuch")),
    ("did you mean 'mug'?", ("object", "verify", "mgu")),
    ("there is no ObjectFile", ("object", "render", "vision", "nosuch", "--out", "x.png")),
    ("Did you mean 'run'?", ("runn",)),
)
LIGHT = frozenset(
    {"harness", "typer", "rich", "shellingham", "annotated_doc"}
    | {"pydantic", "pydantic_core", "annotated_types", "typing_extensions", "typing_inspection"}
)
"""Packages that a refused command may import: typer and those it imports itself. numpy takes 0.1 s of CPU."""
COUNTED = """
import json, sys
from harness.cli import invoke
answers = []
for words in json.loads(sys.argv[1]):
    code = invoke(words)
    files = [name for name, module in sys.modules.items() if getattr(module, "__file__", None)]
    roots = {name.partition(".")[0] for name in files}
    heavy = sorted(root for root in roots - set(sys.stdlib_module_names) if not root.startswith("_"))
    print("\\0", file=sys.stderr)
    answers.append((code, heavy))
print(json.dumps(answers))
"""


def test_a_mistyped_name_is_refused_before_anything_heavy_is_imported() -> None:
    """One process refuses all of them: what the first imports too much, all would."""
    words = json.dumps([words for _, words in MISTYPED])
    done = subprocess.run([sys.executable, "-c", COUNTED, words], capture_output=True, text=True, check=True)
    answers = json.loads(done.stdout.splitlines()[-1])
    errors = done.stderr.split("\0")
    for (message, refused), (code, packages), error in zip(MISTYPED, answers, errors[:-1], strict=True):
        assert (refused, code) == (refused, 2)
        assert message in error
        assert (refused, set(packages) - LIGHT) == (refused, set())


OUTPUTS = (
    "sim touch builtin:mug --vertex 1 --out absent/x.png",
    "sim touch builtin:mug --vertex 1 --out x.png --picture absent/x.png",
    "sim touch builtin:mug --vertex 1 --out x.png --height-out absent/x.npy",
    "sim touch builtin:mug --vertex 1 --out x.png --force --pressure-out absent/x.npy",
    "object render audio mug --vertex 1 --out absent/x.wav",
    "object render audio mug --vertex 1 --out x.wav --picture absent/x.png",
    "object render touch mug --vertex 1 --out absent/x.png",
    "object render touch mug --vertex 1 --out x.png --height-out absent/x.npy",
    "object render vision mug --out absent/x.png",
    "object render vision mug --out x.png --depth-out absent/x.npy",
    "object render vision mug --out x.png --alpha-out absent/x.npy",
    "object compare vision mug --live x.png --out absent/x.png",
    "camera gel --out absent/x.png",
    "catalogue page built --out absent/x.html",
    "calibrate markers x.png --out absent/x.json",
    "calibrate taxim presses --ball-radius 2mm --out absent/x.npz",
    "calibrate taxim presses --ball-radius 2mm --polycalib absent/x.npz",
    "calibrate taxim presses --ball-radius 2mm --shadow-table absent/x.npz",
)
FOLDERS = (
    "run --object builtin:mug --out file/run",
    "object build builtin:mug --material ceramic --out file",
    "object render queries mug --out file/q",
    "object import x.pth --out file/q",
    "catalogue build x.csv --out file/q",
    "cost vision builtin:mug --out file/q",
    "cost contact-localization --out file/q",
    "tables contact-localization --out file/q",
    "tables contact-localization --recordings file/q",
    "tables rendering --out file/q",
    "calibrate markers x.png --report file/q",
    "calibrate taxim --station mock --run file/q",
)


def test_an_unknown_setting_is_named_by_the_option_that_gave_it(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["run", "contact-localization", "--object", "builtin:mug"]
    assert invoke([*words, "--set", "nosuch=1"]) == 2
    assert "error: --set nosuch" in capsys.readouterr().err
    assert invoke([*words, "--presses", "3"]) == 2
    assert "error: --presses" in capsys.readouterr().err


@pytest.mark.parametrize("words", OUTPUTS)
def test_a_missing_output_folder_is_named_before_anything_is_computed(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert invoke(words.split()) == 2
    assert "`mkdir -p absent`" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", FOLDERS)
def test_a_file_in_the_way_of_an_output_folder_is_named_before_anything_is_computed(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    assert invoke(words.split()) == 2
    assert "file" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
