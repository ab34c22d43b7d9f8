"""The reality gap: the shipped files are the published table, and nothing is read that is not in it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.toml_file import validate
from harness.bench.gap import Gap, gap_path, lasting_name, load_gap


def test_the_default_gap_holds_the_table_it_was_measured_with() -> None:
    gap = load_gap("default")
    assert (gap.arm.translation, gap.arm.along_tool) == (0.3e-3, 0.15e-3)
    assert gap.object.yaw == pytest.approx(0.0261799, abs=1e-6)
    assert gap.object.tilt == pytest.approx(gap.object.yaw / 3)
    assert gap.sensor.gel_centre == 0.5e-3
    assert gap.gel.height_gain == 0.05
    assert (gap.gel.height_offset, gap.gel.pixel_noise, gap.gel.shading) == (0.03e-3, 0.02e-3, 0.03e-3)
    assert gap.gel.skirt == 1.2e-3
    assert gap.gel.calibration == "other presses"
    assert (gap.shape.scale, gap.shape.deviation, gap.shape.deviation_length) == (0.005, 0.25e-3, 25e-3)
    assert gap.sound.wall == (-0.05, 0.06)


def test_the_gap_switched_off_leaves_only_noise() -> None:
    gap = load_gap("none")
    assert (gap.arm.translation, gap.gel.pixel_noise, gap.gel.skirt) == (0.02e-3, 0.005e-3, 0.4e-3)
    systematic = [
        gap.arm.along_tool,
        *gap.object.model_dump().values(),
        *gap.sensor.model_dump(exclude={"housing"}).values(),
        gap.gel.height_gain,
        gap.gel.height_offset,
        gap.gel.shading,
        gap.shape.scale,
        gap.shape.deviation,
    ]
    assert not any(systematic)
    assert gap.sensor.housing == "rigid"


SHIPPED = ["default", "none", "doubled", "moved_microphone", "hand_held", "no_housing"]

VALUES_THEMSELVES = {
    *("schema", "title", "deviation_length", "calibration", "housing"),
    *("pulse", "reverberation_time", "direct_to_reverberant"),
}


def numbers(tree: Any, name: str = "") -> dict[str, Any]:
    """The leaves of a gap, by their dotted names."""
    if isinstance(tree, dict):
        return {
            key: leaf
            for part, branch in tree.items()
            for key, leaf in numbers(branch, f"{name}.{part}").items()
        }
    return {name: tree}


def test_the_doubled_gap_is_the_default_twice_over() -> None:
    once, twice = (numbers(load_gap(name).model_dump()) for name in ("default", "doubled"))
    for name, value in once.items():
        leaf = name.rpartition(".")[2]
        if leaf in VALUES_THEMSELVES:
            continue
        if leaf == "skirt":  # estimators assume a blur of 1 mm
            assert twice[name] - 1e-3 == pytest.approx(2 * (value - 1e-3))
        elif leaf == "signal_to_noise":
            assert twice[name] == pytest.approx(value - 20 * np.log10(2), abs=0.05)
        elif value is None or (isinstance(value, tuple) and not value):
            assert twice[name] == value
        else:
            assert twice[name] == pytest.approx(2 * np.array(value)), name


@pytest.mark.parametrize(
    ("name", "own"),
    [
        ("moved_microphone", {"gain_per_strike", "phase_per_strike"}),
        ("hand_held", {"extra_damping"}),
        ("no_housing", {"housing"}),
    ],
)
def test_a_gap_for_one_thing_differs_from_the_default_in_that_alone(name: str, own: set[str]) -> None:
    default, other = (numbers(load_gap(which).model_dump()) for which in ("default", name))
    differs = {key.rpartition(".")[2] for key in default if default[key] != other[key]}
    assert differs == {"title", *own}


@pytest.mark.parametrize("name", SHIPPED)
def test_a_gap_survives_json(name: str) -> None:
    gap = load_gap(name)
    assert validate(json.loads(gap.model_dump_json()), Gap, "recording") == gap


def test_a_gap_of_ones_own_is_read_by_path(tmp_path: Path) -> None:
    text = gap_path("none").read_text(encoding="utf-8").replace("0.02 mm", "1 mm")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    assert load_gap(str(tmp_path / "mine.toml")).arm.translation == 1e-3


def test_a_run_keeps_a_shipped_gap_by_name_and_any_other_by_its_whole_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert lasting_name("default") == "default"
    (tmp_path / "own.toml").write_text(gap_path("none").read_text())
    monkeypatch.chdir(tmp_path)
    assert lasting_name("own.toml") == str(tmp_path / "own.toml")
    with pytest.raises(WrongUse, match="'other'"):
        lasting_name("other")


def test_an_unknown_gap_names_the_shipped_ones() -> None:
    with pytest.raises(WrongUse, match=r"'defualt'.*'default'"):
        load_gap("defualt")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"0.02 mm"', '"-0.02 mm"', "negative"),
        ('["0 %", "0 %"]', '["3 %", "0 %"]', "upper end"),
        ("[arm]", "[arms]", "'arms'.*'arm'"),
    ],
)
def test_a_gap_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = gap_path("none").read_text(encoding="utf-8").replace(old, new)
    (tmp_path / "bad.toml").write_text(text, encoding="utf-8")
    with pytest.raises(WrongUse, match=said):
        load_gap(str(tmp_path / "bad.toml"))
