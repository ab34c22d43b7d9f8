"""One folder and one row make an experiment: it is run, resumed, replayed, tabled, costed and reported."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.bench.experiments import EXPERIMENTS, ExperimentRow
from harness.cli import invoke
from tests.support.whole_run import in_process_run, touch_scene

ROW = ExperimentRow(
    about="How high did the gel stand?",
    value="tests.experiments.toy.experiment:EXPERIMENT",
    section="toy",
    model="tests.experiments.toy.experiment:Toy",
)
OWN = Path(__file__).with_name("experiment.py")


@pytest.fixture(autouse=True)
def added(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(EXPERIMENTS, "toy", ROW)
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)


def said(capsys: pytest.CaptureFixture[str], *words: str) -> dict[str, Any]:
    capsys.readouterr()
    assert invoke([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert isinstance(found, dict)
    return found


def test_it_is_written_in_120_lines() -> None:
    assert len(OWN.read_text().splitlines()) <= 120


def test_it_is_run_resumed_replayed_and_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run = str(tmp_path / "run")
    first = said(capsys, "run", "toy", "--object", "builtin:mug", "--set", "presses=1", "--out", run)
    assert first["experiment"] == "toy"
    assert first["error_m"] < 5e-3  # the gel is pressed up to 2 mm behind its first touch
    page = Path(first["report"]).read_text()
    assert "Toy" in page
    assert "touch.image" in page
    assert "touch.image" in first["observed"]
    again = said(capsys, "replay", run)
    assert again["height_m"] == first["height_m"]
    (Path(run) / "steps" / "000.mcap").unlink()
    resumed = said(capsys, "run", "--resume", run)
    assert resumed["height_m"] == pytest.approx(first["height_m"], abs=1e-4)


def test_it_has_a_table_and_a_cost_curve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = ["--only", "mug", "--seeds", "1", "--gap", "none"]
    table = said(capsys, "tables", "toy", *one, "--workers", "1", "--out", str(tmp_path / "table"))
    assert [row["method"] for row in table["rows"]] == ["default", "toy.stride = 8"]
    cost = said(capsys, "cost", "toy", *one, "--contacts", "2", "--out", str(tmp_path / "cost"))
    ((condition),) = cost["conditions"]
    assert condition["condition"] == {"gap": "none", "presses": 2}
    assert len(condition["settings"]) == 2


def test_another_experiments_run_is_one_clear_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = in_process_run(tmp_path / "other", touch_scene(contacts=1), seed=3).folder
    for words in (["run", "toy", "--resume", str(other)],):
        assert invoke(words) == 2
        assert "is a run of contact-localization, not of toy" in capsys.readouterr().err
