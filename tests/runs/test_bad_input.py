"""What an operator gets wrong before anything moves: one sentence, the exit code, one JSON object."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from harness.basics.mesh import Mesh
from harness.cli import invoke
from harness.objects.household import build

SCENE = """
schema = 1
[object]
mesh = "builtin:mug"
{object}
[localization]
contacts = 2
{localization}
"""


@dataclass(frozen=True)
class Said:
    """What a command that failed told."""

    code: int
    error: str


@pytest.fixture
def refused(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> "Refused":
    monkeypatch.chdir(tmp_path)
    return Refused(capsys, tmp_path)


@dataclass(frozen=True)
class Refused:
    """Runs commands that must fail, and holds them to what every failure owes the operator."""

    capsys: pytest.CaptureFixture[str]
    folder: Path

    def __call__(self, arguments: Sequence[str]) -> Said:
        before = sorted(self.folder.rglob("*"))
        code = invoke([*arguments, "--json"])
        captured = self.capsys.readouterr()
        answer = json.loads(captured.out)
        assert answer["schema"] == 1
        assert answer["exit_code"] == code
        assert "Traceback" not in captured.err
        assert captured.err.count("error:") == 1
        assert answer["error"].strip()
        assert "\n" not in answer["error"]
        assert " ".join(answer["error"].split()) in " ".join(captured.err.split())
        assert sorted(self.folder.rglob("*")) == before, "a refused command leaves nothing behind"
        return Said(code, answer["error"])


def written(folder: Path, name: str, text: str) -> str:
    (folder / name).write_text(text)
    return str(folder / name)


def mesh_file(path: Path, mesh: Mesh, factor: float) -> str:
    """An OBJ file, whose numbers say nothing of their unit."""
    lines = ["v {} {} {}".format(*(factor * vertex)) for vertex in mesh.vertices]
    lines += ["f {} {} {}".format(*(face + 1)) for face in mesh.faces]
    path.write_text("\n".join(lines))
    return str(path)


def test_an_unreadable_mesh(refused: Refused, tmp_path: Path) -> None:
    path = written(tmp_path, "mug.obj", "\x00 this was never a mesh \x7f")
    said = refused(["run", "--object", path, "--material", "ceramic", "--units", "mm"])
    assert said.code == 1
    assert "mug.obj" in said.error


def test_a_mesh_cut_off_in_the_middle(refused: Refused, tmp_path: Path) -> None:
    whole = mesh_file(tmp_path / "mug.ply", build("mug"), 1e3)
    path = written(
        tmp_path, "half.ply", "ply\nformat ascii 1.0\nelement vertex 9000\n" + Path(whole).read_text()[:500]
    )
    said = refused(["run", "--object", path, "--material", "ceramic", "--units", "mm"])
    assert said.code == 1
    assert "half.ply" in said.error


def test_no_such_file(refused: Refused, tmp_path: Path) -> None:
    said = refused(["run", "--object", str(tmp_path / "absent.obj"), "--material", "ceramic"])
    assert said.code == 2
    assert "absent.obj" in said.error


def test_ambiguous_units_are_an_error_with_both_readings(refused: Refused, tmp_path: Path) -> None:
    path = mesh_file(tmp_path / "mug.obj", build("mug"), 10.0)  # about 1.2 units: metres, or centimetres
    said = refused(["run", "--object", path, "--material", "ceramic"])
    assert said.code == 2
    assert "--units" in said.error
    assert " cm" in said.error
    assert " m" in said.error.replace(" mm", "").replace(" cm", "")


def test_an_unknown_unit_of_a_mesh(refused: Refused, tmp_path: Path) -> None:
    path = mesh_file(tmp_path / "mug.obj", build("mug"), 1e3)
    said = refused(["run", "--object", path, "--material", "ceramic", "--units", "furlong"])
    assert said.code == 2
    assert "furlong" in said.error
    assert "mm" in said.error


@pytest.mark.parametrize(
    ("object_", "localization", "named"),
    [
        ("matrial = 'ceramic'", "", ("object.matrial", "did you mean 'material'?")),
        ("", "spacng = 'close'", ("localization.spacng", "did you mean 'spacing'?")),
        ("", "step = '25 kg'", ("localization.step", "'kg'", "mm")),
        ("", "step = 0.025", ("localization.step", "no unit", "mm")),
        ("", "depth = ['0.5 mm', 2]", ("localization.depth", "no unit")),
        ("", "spacing = 'spred'", ("localization.spacing", "did you mean 'spread'?")),
        ("material = 'ceramc'", "", ("object.material", "did you mean 'ceramic'?")),
    ],
)
def test_a_mistake_in_a_scene(
    refused: Refused, tmp_path: Path, object_: str, localization: str, named: tuple[str, ...]
) -> None:
    path = written(tmp_path, "scene.toml", SCENE.format(object=object_, localization=localization))
    said = refused(["run", "--scene", path])
    assert said.code == 2
    assert all(word in said.error for word in ("scene.toml", *named)), said.error


def test_a_scene_that_is_no_toml(refused: Refused, tmp_path: Path) -> None:
    said = refused(["run", "--scene", written(tmp_path, "scene.toml", "[object\nmesh=")])
    assert said.code == 2
    assert "scene.toml" in said.error


MUG = ("run", "--object", "builtin:mug")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["run", "--object", "builtin:mag"], ("did you mean 'mug'?",)),
        ([*MUG, "--material", "ceramc"], ("did you mean 'ceramic'?",)),
        ([*MUG, "--wall", "2"], ("no unit", "mm")),
        ([*MUG, "--wall", "2 s"], ("'s'", "mm")),
        ([*MUG, "--level", "localization.round=1"], ("did you mean 'localization.rounds'?",)),
        ([*MUG, "--level", "localization.rounds=9"], ("localization.rounds", "9")),
        ([*MUG, "--level", "localization.rounds"], ("localization.rounds",)),
        ([*MUG, "--station", "mok"], ("did you mean 'mock'?",)),
        ([*MUG, "--gap", "nune"], ("did you mean 'none'?",)),
        ([*MUG, "--seed", "-1"], ("--seed",)),
        ([*MUG, "--contacts", "0"], ("--contacts",)),
        ([*MUG, "--contcts", "2"], ("--contcts",)),
        (["run", "contact-localisation", "--object", "builtin:mug"], ("contact-localisation",)),
        (["run"], ("--scene", "--object")),
        (["run", "--scene", "mug_touch", "--object", "builtin:mug"], ("--scene", "--object")),
        (["run", "--object", "mug.obj"], ("there is no file", "mug.obj")),
        (["replay", "nowhere"], ("nowhere", "run.json")),
        (["run", "--resume", "nowhere"], ("nowhere", "run.json")),
        (["explain", "nowhere.toml"], ("nowhere.toml",)),
        (["check", "--station", "mok"], ("did you mean 'mock'?",)),
        (["mock-lab", "--object", "builtin:mag"], ("did you mean 'mug'?",)),
        (["tables", "contact-localization", "--only", "mag"], ("did you mean 'mug'?",)),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_use(refused: Refused, arguments: list[str], named: tuple[str, ...]) -> None:
    said = refused(arguments)
    assert said.code == 2
    assert all(word in said.error for word in named), said.error


@pytest.mark.parametrize(
    "option",
    [
        ("--seed", "4"),
        ("--station", "mock"),
        ("--gap", "none"),
        ("--contacts", "2"),
        ("--material", "ceramic"),
        ("--units", "mm"),
        ("--wall", "2 mm"),
        ("--yaw", "unknown"),
        ("--object", "builtin:mug"),
    ],
    ids=lambda option: option[0],
)
def test_a_run_that_is_resumed_is_the_run_that_was_planned(
    refused: Refused, tmp_path: Path, option: tuple[str, str]
) -> None:
    (tmp_path / "run").mkdir()
    written(tmp_path / "run", "run.json", "{}")
    said = refused(["run", "--resume", "run", *option])
    assert said.code == 2
    assert option[0] in said.error


def test_a_run_whose_header_is_damaged(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    written(tmp_path / "run", "run.json", '{"schema": 1, "experi')
    said = refused(["run", "--resume", str(tmp_path / "run")])
    assert said.code == 1
    assert "run.json" in said.error


@pytest.mark.parametrize(
    "sizes", [("1e-320m", "1m"), ("5cm", "1e300m"), ("5cm", "5cm"), ("0.1mm", "1m"), ("1m", "11m")]
)
def test_a_range_of_sizes_that_no_object_has(refused: Refused, sizes: tuple[str, str]) -> None:
    said = refused(["run", "scale-estimation", "--object", "builtin:mug", "--range", *sizes])
    assert said.code == 2
    assert "'object.sizes'" in said.error
    assert "between 1 mm and 10 m" in said.error
