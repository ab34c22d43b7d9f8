"""Parameters have the types of their quantities: checked by the catalogue, and by mypy from end to end."""

import ast
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.mesh import Mesh
from harness.effects.accuracy import Knob
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, build_catalogue
from tests.harness.effects.wiring import WIRED, current, wiring

ROOT = Path(__file__).parents[3]
SIDES = Knob("toy.sides", (1, 2), "", "number", 1)

TOY = """
from harness.basics.arrays import {kind}, FloatArray
from harness.effects.effect import Effect
from harness.effects.quantities import Quantities


class ToyQuantities(Quantities, total=False):
    toy_brightness: FloatArray


def measure_brightness(touch_image: {kind}) -> FloatArray:
    raise NotImplementedError


EFFECT = Effect("toy.brightness", measure_brightness)
"""


def test_every_effect_is_in_the_module_that_mypy_checks() -> None:
    assert ast.dump(ast.parse(WIRED.read_text())) == ast.dump(ast.parse(current())), "run `make reference`"


def test_mypy_rejects_an_effect_whose_parameter_has_the_wrong_type(tmp_path: Path) -> None:
    for name, kind in (("toy_right", "ByteArray"), ("toy_wrong", "IntArray")):
        path = tmp_path / f"{name}.py"
        path.write_text(TOY.format(kind=kind))
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        toy = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(toy)
        (tmp_path / f"{name}_wired.py").write_text(wiring([toy.EFFECT], toy.ToyQuantities))
    said = subprocess.run(
        [sys.executable, "-m", "mypy", *sorted(map(str, tmp_path.glob("*.py")))],
        cwd=ROOT,
        env={**os.environ, "MYPYPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    errors = [line for line in said.stdout.splitlines() if ": error: " in line]
    assert len(errors) == 1, said.stdout + said.stderr
    assert "toy_wrong_wired.py" in errors[0]
    assert 'Argument "touch_image" to "measure_brightness"' in errors[0]


def right(touch_image: ByteArray) -> FloatArray:
    raise NotImplementedError


def of_a_mesh(touch_image: Mesh) -> FloatArray:
    raise NotImplementedError


def of_nothing(touch_imgae: ByteArray) -> FloatArray:
    raise NotImplementedError


def at_a_level(touch_image: ByteArray, *, toy_sides: int) -> FloatArray:
    raise NotImplementedError


def unstated(touch_image: ByteArray, toy_sides: int) -> FloatArray:
    raise NotImplementedError


def of_the_toy(toy_brightness: ByteArray) -> ByteArray:
    raise NotImplementedError


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (
            Effect("toy.brightness", of_a_mesh),
            r"toy\.brightness .*touch_image is Mesh, and touch\.image is",
        ),
        (Effect("toy.brightness", of_nothing), r"toy\.brightness .*touch\.imgae"),
        (Effect("touch.image", right), r"touch\.image .*returns .*float64.*uint8"),
        (Effect("toy.brightness", at_a_level), r"toy\.brightness .*toy\.sides"),
        (Effect("toy.brightness", unstated, knobs=(SIDES,)), r"toy\.brightness .*toy\.sides"),
        (Effect("toy.brightness", right, knobs=(SIDES,)), r"toy\.brightness .*toy\.sides"),
        (
            Effect("toy.brightness", right, choice=SIDES, ways={2: Effect("toy.brightness", of_a_mesh)}),
            r"toy\.brightness \(of_a_mesh\).*Mesh",
        ),
    ],
    ids=lambda case: case.compute.__name__ if isinstance(case, Effect) else "",
)
def test_a_function_that_does_not_fit_its_row_is_refused(row: Effect, said: str) -> None:
    others = [effect for effect in EFFECTS if effect.provides != row.provides]
    with pytest.raises(ValueError, match=said):
        build_catalogue(*others, row)


def test_a_parameter_has_the_type_that_the_effect_before_it_returns() -> None:
    brightness = Effect("toy.brightness", right)
    with pytest.raises(ValueError, match=r"toy\.half .*toy_brightness is .*uint8.* is .*float64"):
        build_catalogue(*EFFECTS, brightness, Effect("toy.half", of_the_toy))


def test_no_signature_of_the_effects_has_any() -> None:
    for path in sorted((ROOT / "harness" / "effects").glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            stated: list[ast.expr | None] = []
            if isinstance(node, ast.FunctionDef):
                arguments = node.args
                every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
                stated = [node.returns, *(each.annotation for each in every)]
            if isinstance(node, ast.AnnAssign):
                stated = [node.annotation]
            for each in stated:
                text = "" if each is None else ast.unparse(each)
                assert "Any" not in text.replace("AnyArray", ""), f"{path.name}: {text}"
