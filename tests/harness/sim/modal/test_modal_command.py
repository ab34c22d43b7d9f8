"""``touchstone sim modes``: one JSON object, a table a person can read, and errors that say what to do."""

import json
import re
from pathlib import Path

import meshio
import numpy as np
import pytest

from harness.basics.mesh import Mesh
from harness.cli import invoke
from harness.objects.household import build
from tests.oracles.exact_solids import exact_box


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> str:
    mesh = exact_box((100.0, 20.0, 10.0), (5, 2, 1))
    file = tmp_path_factory.mktemp("bar") / "bar.inp"
    root = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    meshio.write_points_cells(file, mesh.nodes, [("tetra10", mesh.cells)], point_sets={"ROOT": root})
    return str(file)


def answered(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, object]:
    code = invoke(["sim", "modes", *words, "--json"])
    answer: dict[str, object] = json.loads(capsys.readouterr().out)
    assert code == answer.get("exit_code", 0)
    return answer


def test_json_says_what_was_computed(bar: str, capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, bar, "--material", "steel", "--units", "mm", "--modes", "5")
    frequencies, rates = answer["frequencies_hz"], answer["dampings_per_s"]
    assert isinstance(frequencies, list)
    assert len(frequencies) == 5
    assert rates == pytest.approx([0.5 * (5.0 + 3e-8 * (2 * np.pi * f) ** 2) for f in frequencies])
    assert answer["mass_kg"] == pytest.approx(7850.0 * 2e-5)
    assert (answer["rigid_modes"], answer["bodies"], answer["certified"]) == (6, 1, True)
    assert answer["unknowns"] == 3 * 11 * 5 * 3
    seconds = answer["seconds"]
    assert isinstance(seconds, dict)
    assert set(seconds) == {"intake", "mesh", "assemble", "solve"}


def test_a_limit_and_own_elasticity(bar: str, capsys: pytest.CaptureFixture[str]) -> None:
    own = ("--young", "800GPa", "--poisson", "0.29", "--density", "7850")
    stiff = answered(capsys, bar, "--units", "mm", *own, "--up-to", "12kHz")
    plain = answered(capsys, bar, "--units", "mm", "--material", "steel", "--up-to", "6000")
    assert stiff["frequencies_hz"] == pytest.approx([2.0 * f for f in _floats(plain["frequencies_hz"])])
    assert stiff["complete_below_hz"] == pytest.approx(12e3)


def test_a_held_set_has_no_rigid_motion(bar: str, capsys: pytest.CaptureFixture[str]) -> None:
    held = ("--fixed", "ROOT")
    answer = answered(capsys, bar, "--material", "steel", "--units", "mm", "--modes", "3", *held)
    assert answer["rigid_modes"] == 0
    assert answer["held_nodes"] == 15


def test_the_table_says_how_sure_it_is(bar: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["sim", "modes", bar, "--material", "steel", "--units", "mm", "--modes", "3"]) == 0
    shown = capsys.readouterr().out
    assert "certified: exactly" in shown
    assert re.search(r"rigid modes +6\b", shown)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--units", "mm"), "--material, one of"),
        (("--units", "mm", "--material", "stele"), "did you mean 'steel'"),
        (("--material", "steel"), "say --units"),
        (("--units", "mm", "--material", "steel", "--poisson", "0.5"), "incompressible"),
        (("--units", "mm", "--material", "steel", "--up-to", "20 mm"), "--up-to"),
        (("--units", "mm", "--material", "steel", "--alpha", "-1"), "--alpha"),
        (("--units", "mm", "--material", "steel", "--fixed", "floor"), "x-min"),
    ],
)
def test_errors_say_what_to_do(
    options: tuple[str, ...], reason: str, bar: str, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answered(capsys, bar, *options)
    assert reason in str(answer["error"])
    assert answer["exit_code"] == 2


def test_a_file_that_is_not_there_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = answered(capsys, str(tmp_path / "none.inp"), "--material", "steel")
    assert "none.inp" in str(answer["error"])
    assert answer["exit_code"] == 2


@pytest.mark.slow  # a mug's modes; a block's are in quick tests
def test_a_built_in_object_is_its_own_file_and_of_its_own_material(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("--modes", "3", "--edge", "12mm")
    named = answered(capsys, "builtin:wrench", *asked)
    file = surface_file(tmp_path / "wrench.obj", build("wrench"))
    given = answered(capsys, file, "--units", "m", "--material", "steel", *asked)
    assert named["units"] == "m"
    # Two fillings of one surface differ by no more than coarse elements err.
    assert named["frequencies_hz"] == pytest.approx(given["frequencies_hz"], rel=0.05)
    assert named["mass_kg"] == pytest.approx(given["mass_kg"], rel=1e-2)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("builtin:mgu", "--material", "ceramic"), "no built-in object 'mgu'"),
        (("builtin:mgu",), "did you mean 'mug'?"),
        (("builtin:mug", "--units", "mm"), "leave --units out"),
        (("builtin:mug", "--wall", "2mm"), "leave --wall out"),
    ],
)
def test_of_a_built_in_object_nothing_else_is_asked(
    words: tuple[str, ...], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answered(capsys, *words)
    assert reason in str(answer["error"])
    assert answer["exit_code"] == 2


def surface_file(path: Path, mesh: Mesh) -> str:
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in mesh.vertices.tolist()]
    lines += ["f {} {} {}".format(*(face + 1)) for face in mesh.faces]
    path.write_text("\n".join(lines))
    return str(path)


def _floats(values: object) -> list[float]:
    assert isinstance(values, list)
    return [float(value) for value in values]
