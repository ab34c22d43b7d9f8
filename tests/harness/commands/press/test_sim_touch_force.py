"""``sim touch --force``: what it answers, and what it refuses."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.cli import invoke
from tests.support.touch_command import answered, bump, saved

KNOWN = ("--force", "--gel-modulus", "0.435MPa", "--gel-modulus-error", "5%")


def _refused(capsys: pytest.CaptureFixture[str], folder: Path, *words: str | Path) -> str:
    height = saved(folder, bump(0.5e-3))
    given = ["sim", "touch", "--height", height, "--out", folder / "a.png", *words, "--json"]
    assert invoke([str(word) for word in given]) in (1, 2)
    return capsys.readouterr().err


def test_without_being_asked_there_is_no_force(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, bump(0.5e-3)))
    assert answer["force_n"] is answer["force_uncertainty_n"] is answer["force"] is None
    assert "touch.force" not in answer["seconds"]
    assert "touch.force" in json.dumps(answer["effects"]["skipped"])


def test_a_force_comes_with_its_uncertainty_level_seconds_and_place(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    height = saved(tmp_path, bump(0.5e-3))
    pressure = tmp_path / "p.npy"
    answer = answered(capsys, tmp_path, "--height", height, *KNOWN, "--pressure-out", pressure)
    force = answer["force"]
    assert 0.0 < answer["force_uncertainty_n"] < 0.3 * answer["force_n"]
    assert force["level"] == answer["levels"]["touch.force"] == "layer"
    assert force["young_pa"] == pytest.approx(0.435e6)
    assert force["source"] == "given"
    assert force["uncertainty_shares"]["modulus"] == pytest.approx(0.05)
    assert answer["seconds"]["touch.force"] > 0.0
    assert not force["lower_bound"]
    assert not force["beyond_checked"]
    pascals = np.load(pressure)
    assert pascals.sum() * answer["pitch_m"] ** 2 == pytest.approx(answer["force_n"])
    assert pascals.max() == pytest.approx(force["largest_pressure_pa"])
    assert force["centre_m"] == pytest.approx([-0.5 * answer["pitch_m"]] * 2, abs=1.01 * answer["pitch_m"])


def test_a_gel_that_nobody_measured_is_said_to_be(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, bump(0.5e-3)), "--force")
    assert answer["force_uncertainty_n"] > 0.5 * answer["force_n"]
    assert any("--gel-modulus" in note for note in answer["notes"])


def test_missing_heights_and_a_cut_contact_make_it_a_lower_bound(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    holed = bump(0.5e-3)
    holed[50, 70] = np.nan
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, holed), *KNOWN)
    assert answer["force"]["lower_bound"]
    assert any("lower bound" in note for note in answer["notes"])


def test_no_contact_is_no_force_to_the_bit(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    answer = answered(capsys, tmp_path, "--height", saved(tmp_path, np.zeros((120, 160))), "--force")
    assert answer["force_n"] == 0.0 == answer["force_uncertainty_n"]
    assert answer["force"]["centre_m"] is None
    assert not any("modulus" in note for note in answer["notes"])


def test_a_table_of_measured_forces_is_read_where_it_is_given(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rows = [{"at": k * 1e-3, "force_n": 2.0 * k, "sigma_n": 0.1} for k in (0.2, 0.4, 0.8)]
    said = {"sensor": "R1.5", "serial": "7", "indenter": "a ball", "made_from": "forty presses"}
    table: dict[str, Any] = {"schema": 1, **said, "of": "depth_m", "rows": rows}
    (tmp_path / "f.json").write_text(json.dumps(table))
    height = saved(tmp_path, bump(0.4e-3))
    answer = answered(capsys, tmp_path, "--height", height, "--force", "--force-table", tmp_path / "f.json")
    assert answer["force"]["level"] == "table"
    assert (answer["force_n"], answer["force_uncertainty_n"]) == pytest.approx((0.8, 0.1))
    assert answer["force"]["young_pa"] is None
    assert "forty presses" in answer["force"]["source"]
    where = ("--pressure-out", tmp_path / "p.npy")
    refused = _refused(capsys, tmp_path, "--force", "--force-table", tmp_path / "f.json", *where)
    assert "--pressure-out" in refused


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--gel-modulus", "0.4MPa"], "add --force"),
        (["--level", "touch.force=winkler"], "add --force"),
        (["--force", "--gel-modulus", "0.4MPa"], "say both"),
        (["--force", "--gel-modulus", "0.4", "--gel-modulus-error", "5%"], "has no unit"),
        (["--force", "--gel-modulus", "0Pa", "--gel-modulus-error", "5%"], "above zero"),
        (["--force", "--gel-poisson", "0.6"], "0 to 0.5"),
        (["--force", "--level", "touch.force=hertz"], "touch.force has no level 'hertz'"),
        (["--force", "--level", "touch.force=table"], "--force-table"),
        (["--force", "--thickness", "0.4mm"], "the gel 0.4 mm thick"),
        (["--force", "--force-table", "none.json"], "none.json cannot be read: no such file"),
    ],
)
def test_what_cannot_be_answered_is_refused_with_what_to_do(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, words: list[str], said: str
) -> None:
    assert said in _refused(capsys, tmp_path, *words)
