"""One folder and one row make an experiment: it is run, resumed, replayed, tabled, costed and reported."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.basics.errors import WrongUse
from harness.bench.experiments import EXPERIMENTS, ExperimentRow
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.cli import invoke
from harness.cost.curve import Curve, Point, Sample
from harness.cost.file import curve_path, save
from harness.cost.provenance import code, machine
from harness.effects.scene_object import known_object
from harness.experiment.in_process import RunCell, open_run
from harness.experiment.lookup import find_experiment
from harness.experiment.measuring import measurement_of
from harness.experiment.subjects import object_key
from harness.experiment.truth import read_true_surface
from harness.recording.recording import Recording
from tests.experiments.toy.experiment import CLAIMED, STRIDE
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


@pytest.mark.slow  # tables and curves of the others are tested by themselves
def test_it_has_a_table_and_a_cost_curve(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The row of the toy is in this process alone.
    monkeypatch.setattr("harness.tasks.measuring.own_cores", lambda: 1)
    one = ["--only", "mug", "--seeds", "1", "--gap", "none"]
    table = said(capsys, "tables", "toy", *one, "--workers", "1", "--out", str(tmp_path / "table"))
    assert [row["method"] for row in table["rows"]] == ["default", "toy.stride = 8"]
    cost = said(capsys, "cost", "toy", *one, "--contacts", "2", "--out", str(tmp_path / "cost"))
    ((condition),) = cost["conditions"]
    assert condition["condition"] == {"gap": "none", "presses": 2}
    assert len(condition["settings"]) == 2


def test_its_table_reproduces_from_its_recordings(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = tmp_path / "recordings"
    one = ["--only", "mug", "--seeds", "1", "--gap", "none", "--workers", "1", "--recordings", str(runs)]
    first = said(capsys, "tables", "toy", *one, "--out", str(tmp_path / "first"))
    (recorded,) = runs.glob("*/run.json")
    assert read_true_surface(Recording(recorded.parent)) is not None
    before = recorded.stat().st_mtime_ns
    again = said(capsys, "tables", "toy", *one, "--out", str(tmp_path / "again"))
    assert without_seconds(again["rows"]) == without_seconds(first["rows"])
    assert recorded.stat().st_mtime_ns == before
    replayed = said(capsys, "replay", str(recorded.parent))
    (answer,) = (tmp_path / "first").glob("*.json")
    assert replayed["height_m"] == json.loads(answer.read_text())["rows"]["default"]["height_m"]


def test_recordings_of_another_scene_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell, station = RunCell("mug", "none", 3), load_station(station_path("mock"))
    scene = scene_from_options("builtin:mug")
    with open_run(find_experiment("toy"), cell, scene, station, tmp_path):
        pass
    bowl = scene_from_options("builtin:bowl")
    refused = pytest.raises(WrongUse, match="differs in object")
    with refused, open_run(find_experiment("toy"), cell, bowl, station, tmp_path):
        pass


def without_seconds(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]


def save_a_curve() -> None:
    """Measured, it says, on this machine with this code: every pose is worth its seconds."""
    name = object_key("mug", known_object(scene_from_options("builtin:mug")).mesh)

    def point(stride: int, cpu: float, error: float) -> Point:
        samples = tuple(
            Sample(f"r{k}", name, error, CLAIMED, 0.0, cpu * (1.0 + 1e-3 * k), cpu) for k in range(40)
        )
        return Point(f"stride {stride}", {STRIDE.name: stride}, {"gap": "default", "presses": 1}, samples)

    points = (point(8, 0.5, 4e-3), point(1, 2.0, 1e-3))
    here = code(measurement_of(find_experiment("toy")).estimator)
    save(Curve("toy", points, machine(), here, "2026-01-01T00:00:00+00:00", "T"), curve_path("toy"))


@pytest.mark.slow  # budgets are in test_budget.py
def test_it_keeps_a_budget_and_an_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_a_curve()
    wanted = ["run", "toy", "--object", "builtin:mug", "--set", "presses=1"]
    assert invoke([*wanted, "--budget", "1 ms"]) == 2
    assert "0.5" in capsys.readouterr().err
    run = str(tmp_path / "run")
    plenty = said(capsys, *wanted, "--budget", "30 s", "--out", run)
    assert plenty["cost"]["kept"]
    assert plenty["cost"]["levels"] == {STRIDE.name: 1} == {STRIDE.name: plenty["accuracy"][STRIDE.name]}
    assert plenty["cost"]["error_m"] == plenty["error_m"]
    assert plenty["cost"]["finest"]["error_m"] == plenty["error_m"]
    little = said(capsys, "run", "--resume", run, "--budget", "1 s")
    assert little["cost"]["levels"] == {STRIDE.name: 8}
    for error, tried, kept in (
        ("5 mm", ["stride 8"], True),
        ("2 mm", ["stride 1"], True),
        ("1 um", [], False),
    ):
        met = said(capsys, "run", "--resume", run, "--error", error)["cost"]
        assert met["kept"] is kept
        assert not kept or met["tried"] == tried
        assert (met["promised_error_m"] <= met["asked"]["error_m"]) is kept


def test_a_budget_without_a_curve_says_how_to_measure_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["run", "toy", "--object", "builtin:mug", "--budget", "1 s"]) == 2
    assert "`touchstone cost toy`" in capsys.readouterr().err


def test_another_experiments_run_is_one_clear_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = in_process_run(tmp_path / "other", touch_scene(contacts=1), seed=3).folder
    for words in (["run", "toy", "--resume", str(other)],):
        assert invoke(words) == 2
        assert "contact-localization" in capsys.readouterr().err
