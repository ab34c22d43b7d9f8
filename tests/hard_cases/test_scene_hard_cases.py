"""Named mistakes that operators make in scene files: one clear sentence each, exit code 2."""

from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.scene import load_scene

GOOD = """
schema = 1
[object]
mesh = "builtin:mug"
[sensors]
touch = true
[localization]
depth = ["0.5 mm", "2 mm"]
"""

CASES = {
    "unknown key": ("touch = true", "tuoch = true", "'sensors.tuoch'.*'touch'"),
    "unknown table": ("[sensors]", "[senors]", "'senors'.*'sensors'"),
    "key in the wrong table": ("touch = true", "material = 'steel'", "'sensors.material'"),
    "bare number": ('"2 mm"', "2", r"'localization.depth\[1\]': 2 .*unit"),
    "wrong unit": ('"2 mm"', '"2 kg"', "'2 kg'.*'kg'.* m, mm"),
    "unit of another case": ('"2 mm"', '"2 MM"', "'MM'"),
    "comma as decimal point": ('"2 mm"', '"2,5 mm"', "'2,5 mm'"),
    "range upside down": ('"2 mm"', '"0.1 mm"', "upper end"),
    "range of three": ('"2 mm"', '"2 mm", "3 mm"', "at most 2"),
    "no press": ('"0.5 mm"', '"0 mm"', "above zero"),
    "text for a switch": ("touch = true", 'touch = "yes"', "'sensors.touch' = 'yes'.*boolean"),
    "another schema": ("schema = 1", "schema = 2", "'schema' = 2"),
    "schema left out": ("schema = 1", "", "'schema'"),
    "unknown object": ("builtin:mug", "builtin:cup", "'cup'.*bowl"),
    "no such mesh": (
        '"builtin:mug"',
        '"mgu.stl"\nmaterial = "wood"',
        "'object.mesh': .*mgu.stl",
    ),
    "mesh without a material": ("builtin:mug", "mgu.stl", "'object.material'"),
    "unknown material": ('"builtin:mug"', '"builtin:mug"\nmaterial = "wod"', "'wod'.*'wood'"),
    "no contacts": ("[localization]", "[localization]\ncontacts = 0", "greater than or equal to 1"),
    "half a contact": ("[localization]", "[localization]\ncontacts = 2.5", "'localization.contacts' = 2.5"),
    "infinite scale": ('"builtin:mug"', '"builtin:mug"\nscale = inf', "'object.scale' = inf"),
    "key twice": ("touch = true", "touch = true\ntouch = false", "TOML.*line 7"),
    "unclosed text": ('"builtin:mug"', '"builtin:mug', "TOML.*line 4"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_mistake_in_a_scene_is_named(tmp_path: Path, name: str) -> None:
    old, new, said = CASES[name]
    assert old in GOOD
    path = tmp_path / "scene.toml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(WrongUse, match=said) as caught:
        load_scene(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


def test_the_scene_without_the_mistakes_is_read(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(GOOD, encoding="utf-8")
    assert load_scene(tmp_path / "scene.toml").object.material == "ceramic"
