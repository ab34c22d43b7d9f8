"""``run --budget`` and ``--error``, and ``touchstone cost``: levels from the measured front."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from experiments.contact_localization.answer import ESTIMATOR, PROGRAM
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.estimate import METHOD, SPACING
from experiments.contact_localization.settings import (
    FINEST,
    KNOBS,
    setting_name,
    settings,
)
from experiments.scale_estimation.experiment import EXPERIMENT as SCALE
from experiments.shape_reconstruction.experiment import EXPERIMENT as SHAPE
from harness.basics.errors import WrongUse
from harness.basics.quantities import LENGTH, TIME
from harness.bench.scene import scene_from_json, scene_from_options
from harness.bench.station_file import Station, load_station, station_path
from harness.cli import invoke
from harness.commands.options import positive
from harness.cost.curve import Curve, Point, Sample
from harness.cost.file import curve_path, load, save
from harness.cost.provenance import code, machine
from harness.effects.accuracy import Accuracy, Level
from harness.experiment.begin import begin, require_reachable
from harness.experiment.budget import answer_as_asked, sentences
from harness.experiment.costing import AnswerList, gather_curve, join_curves, measure
from harness.experiment.front import Front, doubts, foresee, front_for, staleness
from harness.experiment.in_process import RunCell
from harness.experiment.measuring import measurement_of
from harness.experiment.solving import Target, target_of
from harness.experiment.subjects import object_key, objects
from harness.objects.household import build
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from tests.support import sessions as session_of
from tests.support.whole_run import copied, touch_scene

COARSE: dict[str, Level] = {
    METHOD.name: "grid",
    SPACING.name: 4e-3,
    "localization.rounds": 0,
    "localization.samples": 600,
}
DEFAULT: dict[str, Level] = {
    METHOD.name: "grid",
    SPACING.name: 2e-3,
    "localization.rounds": 3,
    "localization.samples": 600,
}


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of the test's own: no curve of this machine is there."""
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def curve_of(recording: Recording, coarse_cpu: float = 0.2, fine_cpu: float = 3.0) -> Curve:
    """Measured, it says, on this machine with this code: a coarse and a finer setting, on 40 runs each."""
    run = RunFiles(recording)
    name = object_key(run.scene.object.name, run.mesh)
    condition: dict[str, Level] = {
        "spacing": "spread",
        "gap": "default",
        "yaw": "known",
        "contacts": recording.committed,
    }

    def point(setting: dict[str, Level], cpu: float, error: float) -> Point:
        samples = tuple(
            Sample(f"r{k}", name, error, 0.1, 0.05, cpu * (1.0 + 1e-3 * k), cpu) for k in range(40)
        )
        return Point(setting_name(setting), setting, condition, samples)

    points = (point(COARSE, coarse_cpu, 4e-3), point(DEFAULT, fine_cpu, 1e-3))
    return Curve(PROGRAM, points, machine(), code(ESTIMATOR), "2026-01-01T00:00:00+00:00", "T")


def front_of_run(recording: Recording) -> Front:
    return front_for(EXPERIMENT, RunFiles(recording).scene, recording.committed)


def answered(recording: Recording, target: Target) -> dict[str, Any]:
    return dict(answer_as_asked(EXPERIMENT, RunFiles(recording), front_of_run(recording), target))


def test_a_budget_takes_what_keeps_it_and_says_what_it_took(done: Recording, cache: Path) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    assert front_of_run(done).trusted
    said = answered(done, Target(seconds=600.0))  # a busy machine reads pictures 20 times slower
    assert said["levels"] == DEFAULT
    assert said["cpu_s"] < 30.0
    assert said["kept"] is True
    assert said["error_m"] < 20e-3
    assert said["finest"]["error_m"] is not None
    assert "kept" in sentences(EXPERIMENT, said)[0]
    assert "not counted" in sentences(EXPERIMENT, said)[1]
    json.dumps(said, allow_nan=False)


def test_a_budget_too_small_for_the_finer_setting_takes_the_coarser(done: Recording, cache: Path) -> None:
    save(curve_of(done, 0.01, 1e4), curve_path(PROGRAM))
    found = answered(done, Target(seconds=20.0))
    assert found["levels"] == COARSE
    assert found["tried"] == [setting_name(COARSE)]


def test_the_answer_within_a_budget_is_the_run_s_answer_at_those_levels(
    done: Recording, cache: Path, tmp_path: Path
) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    recording = copied(done, tmp_path / "copy")
    found = answered(recording, Target(seconds=30.0))
    scored = session_of.score(recording, Accuracy.default(KNOBS).with_(found["levels"]))
    assert scored.found.last.position_in_object.tolist() == found["position_m"]


def test_an_error_is_promised_from_the_answer_s_own_radius_or_not_at_all(
    done: Recording, cache: Path
) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    generous = answered(done, Target(error=0.1))
    assert generous["tried"] == [setting_name(COARSE)]
    assert generous["kept"]
    assert generous["promised_error_m"] <= 0.1
    strict = answered(done, Target(error=1e-6))
    assert not strict["kept"]
    assert "0.001 mm" in sentences(EXPERIMENT, strict)[0]


def test_nothing_is_promised_from_more_contacts_than_the_run_has(done: Recording, cache: Path) -> None:
    measured = curve_of(done)
    more = tuple(replace(point, condition={**point.condition, "contacts": 6}) for point in measured.points)
    save(replace(measured, points=more), curve_path(PROGRAM))
    front, target = front_of_run(done), Target(error=0.1)
    assert front.scale == 0.5
    assert any("6 contacts" in said for said in doubts(EXPERIMENT, front, target))
    found = answered(done, target)
    assert not found["kept"]
    assert found["promised_error_m"] is None


def test_a_budget_that_cannot_be_kept_is_refused_before_anything_moves(done: Recording, cache: Path) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    scene = RunFiles(done).scene
    with pytest.raises(WrongUse, match=r"\b0\.001 s"):
        foresee(EXPERIMENT, scene, Target(seconds=1e-3))
    assert "30 s" in foresee(EXPERIMENT, scene, Target(seconds=30.0))


def test_an_error_that_no_setting_promises_is_refused_before_anything_moves(
    done: Recording, cache: Path
) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    scene = RunFiles(done).scene
    with pytest.raises(WrongUse, match=r"0\.001 mm.* mm \("):
        foresee(EXPERIMENT, scene, Target(error=1e-6))
    assert "100 mm" in foresee(EXPERIMENT, scene, Target(error=0.1))


def test_a_stale_curve_refuses_a_budget_that_a_ten_times_faster_machine_could_not_keep(
    done: Recording, cache: Path
) -> None:
    old = curve_of(done, coarse_cpu=0.2)
    save(Curve(PROGRAM, old.points, old.machine, {**old.code, "sha256": "0"}, old.made), curve_path(PROGRAM))
    scene = RunFiles(done).scene
    with pytest.raises(WrongUse, match=r"1e-06 s.*0\.2. s.*code"):
        foresee(EXPERIMENT, scene, Target(seconds=1e-6))
    assert "0.1 s" in foresee(EXPERIMENT, scene, Target(seconds=0.1))


def test_an_error_is_refused_with_the_smallest_promise_and_where_the_run_has_too_few_contacts(
    done: Recording, cache: Path
) -> None:
    measured = curve_of(done)
    save(measured, curve_path(PROGRAM))
    scene = RunFiles(done).scene
    with pytest.raises(WrongUse, match=r"0\.5 mm.*\b1 mm"):
        foresee(EXPERIMENT, scene, Target(error=0.5e-3))
    more = tuple(replace(point, condition={**point.condition, "contacts": 6}) for point in measured.points)
    save(replace(measured, points=more), curve_path(PROGRAM))
    with pytest.raises(WrongUse, match=r"100 mm.*6 contacts.*6 contacts"):
        foresee(EXPERIMENT, scene, Target(error=0.1))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("contact-localization --budget 1us", "a budget of 1e-06 s cannot be kept: the cheapest setting"),
        ("contact-localization --error 1um", "the smallest error that is promised is"),
        ("scale-estimation --range 6cm 24cm --error 0.29mm", "this run can state 0.3 mm at best"),
        ("scale-estimation --budget 1us", "was not measured on this machine; measure it with"),
        ("shape-reconstruction --error 0.14mm", "this run can state 0.15 mm at best, the mean deviation"),
        ("shape-reconstruction --budget 1us", "was not measured on this machine; measure it with"),
    ],
)
def test_what_no_run_reaches_is_refused_before_the_arm_moves(
    words: str, said: str, cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    assert invoke(["run", *words.split(), "--object", "builtin:mug", "--out", str(out), "--json"]) == 2
    assert said in json.loads(capsys.readouterr().out)["error"]
    assert not out.exists()


def test_an_error_that_a_run_may_reach_is_not_refused() -> None:
    mug = build("mug")
    for experiment, error in ((SCALE, 0.31e-3), (SHAPE, 0.16e-3)):
        assert experiment.section is not None
        scene = scene_from_options("builtin:mug")
        tree = scene.model_dump(mode="json", by_alias=True)
        tree["object"] |= {"scale": "hidden", "sizes": ["6 cm", "24 cm"]}
        tree["sensors"] |= {"camera": True}
        tree[experiment.section.table] = {"until": f"{1e3 * error} mm"}
        require_reachable(experiment, scene_from_json(tree, "the test"), mug)


@pytest.mark.parametrize("target", [Target(seconds=2.0), Target(error=5e-3)])
def test_what_was_asked_is_with_the_plan_and_is_asked_again_when_the_run_goes_on(
    target: Target, station: Station, tmp_path: Path
) -> None:
    begin(EXPERIMENT, touch_scene(contacts=1), station, 3, folder=tmp_path / "run", target=target)
    assert target_of(Recording(tmp_path / "run").header.plan) == target


def test_a_run_that_was_asked_for_nothing_goes_on_so(done: Recording) -> None:
    assert target_of(done.header.plan) is None


def test_without_a_curve_of_this_machine_the_one_that_came_along_is_gone_by_and_said_to_be_stale(
    done: Recording, cache: Path
) -> None:
    front = front_of_run(done)
    assert front.shipped
    shipped = measurement_of(EXPERIMENT).shipped_curve()
    assert shipped is not None
    for point in shipped.points:
        Accuracy.default(KNOBS).with_(point.levels)  # levels that today's dials have
    if not front.trusted:
        assert "touchstone cost" in staleness(EXPERIMENT, front)
    assert not curve_path(PROGRAM).exists()


def test_settings_measured_in_one_run_give_no_bound_and_the_shipped_curve_is_used(
    done: Recording, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve = curve_of(done)
    single, full = replace(curve.points[0], samples=curve.points[0].samples[:1]), curve.points[1]
    save(replace(curve, points=(single, full)), curve_path(PROGRAM))
    assert [point.name for point in front_of_run(done).points] == [full.name]
    save(replace(curve, points=(single,)), curve_path(PROGRAM))
    assert front_of_run(done).shipped
    monkeypatch.setattr(type(measurement_of(EXPERIMENT)), "shipped_curve", lambda _: None)
    with pytest.raises(WrongUse, match=r"has one run.*--seeds 2"):
        front_of_run(done)


def test_a_curve_of_other_code_is_used_but_not_trusted(done: Recording, cache: Path) -> None:
    old = curve_of(done)
    save(Curve(PROGRAM, old.points, old.machine, {**old.code, "sha256": "0"}, old.made), curve_path(PROGRAM))
    front = front_of_run(done)
    assert not front.trusted
    assert not front.shipped
    assert "code" in staleness(EXPERIMENT, front)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--budget", "2"], "has no unit"),
        (["--budget", "2 mm"], "is not a time"),
        (["--error", "5 s"], "is not a length"),
        (["--budget", "-1 s"], "above zero"),
        (["--budget", "0 s"], "above zero"),
        (["--budget", "2s", "--error", "5mm"], "give one of them"),
        (["--budget", "2s", "--level", "localization.rounds=1"], "leave --level out"),
    ],
)
def test_what_cannot_be_asked_is_refused_before_a_folder_is_made(
    options: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    arguments = [
        "run",
        "contact-localization",
        "--object",
        "builtin:mug",
        *options,
        "--out",
        str(out),
        "--json",
    ]
    assert invoke(arguments) == 2
    assert said in json.loads(capsys.readouterr().out)["error"]
    assert not out.exists()


@pytest.mark.parametrize("text", ["2s", "2 s", "2000ms", "2000 ms"])
def test_a_budget_may_be_written_with_or_without_a_space(text: str) -> None:
    assert positive("--budget", text, TIME) == 2.0
    assert positive("--error", "5mm", LENGTH) == 5e-3


@pytest.mark.slow  # resuming and budgets are tested each by themselves
def test_a_resumed_run_answers_within_a_budget(
    done: Recording, cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(curve_of(done), curve_path(PROGRAM))
    recording = copied(done, tmp_path / "copy")
    assert (
        invoke(
            ["run", "contact-localization", "--resume", str(recording.folder), "--budget", "600s", "--json"]
        )
        == 0
    )
    result = json.loads(capsys.readouterr().out)
    assert result["cost"]["asked"] == {"budget_s": 600.0, "error_m": None}
    assert result["cost"]["cpu_s"] < 30.0
    assert result["cost"]["position_m"] == result["estimates"]["touch"]["position_m"]
    assert result["accuracy"][SPACING.name] == 2e-3
    assert json.loads((recording.folder / "result.json").read_text()) == result


def test_settings_hold_the_default_and_the_finest_and_each_once() -> None:
    for thorough in (False, True):
        found = settings(thorough)
        assert FINEST in found
        assert all(found.count(setting) == 1 for setting in found)
        assert any(all(setting.get(k, v) == v for k, v in DEFAULT.items()) for setting in found)
        assert len({setting_name(setting) for setting in found}) == len(found)
    assert all(setting in settings(True) for setting in settings(False))


def test_fewer_contacts_are_measured_at_few_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    module = "experiments.contact_localization.accuracy.measurement"
    monkeypatch.setattr(f"{module}.settings", lambda *_asked: [COARSE, DEFAULT])
    monkeypatch.setattr(f"{module}.settings_by_count", lambda _sound: [DEFAULT])
    few = measurement_of(EXPERIMENT).list_answers(False, {"sense": ["touch"]}, objects(None), (2, 4, 6))
    assert few == [(2, DEFAULT), (4, DEFAULT), (6, COARSE), (6, DEFAULT)]


def test_a_measurement_performs_once_answers_everywhere_and_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: AnswerList = [(count, setting) for count in (2, 3) for setting in (COARSE, DEFAULT)]
    wanted = [ContactCell("wrench", "default", 5, "spread")]

    def measured() -> list[tuple[RunCell, list[Point]]]:
        station = load_station(station_path("mock"))
        own = measurement_of(EXPERIMENT)
        return list(measure(own, wanted, asked, objects(None), station, tmp_path, pytest.fail))

    ((_, points),) = measured()
    assert len(points) == 4
    assert {int(point.condition["contacts"]) for point in points} == {2, 3}
    assert all(point.samples[0].cpu > 0.0 and point.samples[0].error < 0.5 for point in points)

    def again(*_: object) -> None:
        raise AssertionError("the run was performed again")

    monkeypatch.setattr("harness.experiment.measuring.record_run", again)
    ((_, resumed),) = measured()
    assert [point.samples for point in resumed] == [point.samples for point in points]
    (kept,) = tmp_path.glob("*.json")
    whole = kept.read_text(encoding="utf-8")
    tree = json.loads(whole)
    for point in tree["points"]:
        del point["sample"]["work"]
    kept.write_text(json.dumps({**tree, "schema": 1}), encoding="utf-8")
    with pytest.raises(AssertionError, match="performed again"):
        measured()
    kept.write_text(whole, encoding="utf-8")
    monkeypatch.setattr("harness.experiment.costing.code", lambda _: {"sha256": "other"})
    with pytest.raises(AssertionError, match="performed again"):
        measured()
    monkeypatch.undo()
    curve = gather_curve(EXPERIMENT, points, "T")
    assert len(join_curves(EXPERIMENT, curve, curve).points) == 4


@pytest.mark.slow  # a measurement of a whole run; its parts stay
def test_the_command_measures_keeps_and_draws(
    cache: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "experiments.contact_localization.accuracy.measurement.settings", lambda *_asked: [COARSE, DEFAULT]
    )
    arguments = ["cost", "contact-localization", "--only", "wrench", "--seeds", "1", "--spacing", "spread"]
    arguments += ["--sense", "touch"]
    arguments += ["--contacts", "2", "--out", str(tmp_path / "out"), "--json"]
    assert invoke(arguments) == 0
    result = json.loads(capsys.readouterr().out)
    (condition,) = result["conditions"]
    assert [set(s["levels"]) for s in condition["settings"]] == [set(COARSE), set(DEFAULT)]
    assert any(setting["front"] for setting in condition["settings"])
    assert load(Path(result["curve"])).machine == machine()
    assert Path(result["curve"]).is_relative_to(cache)
    page = Path(result["report"]).read_text()
    assert "STALE" not in page
    assert "http" not in page.replace("http://www.w3.org", "")  # nothing is loaded from elsewhere
    assert (tmp_path / "out" / "cost_1.png").stat().st_size > 1000


@pytest.mark.parametrize(
    "option",
    [["--only", "mog"], ["--spacing", "wide"], ["--yaw", "any"], ["--gap", "big"], ["--sense", "smell"]],
)
def test_a_mistyped_option_of_the_command_is_named(
    option: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["cost", "contact-localization", *option, "--out", str(tmp_path), "--json"]) == 2
    assert option[1] in json.loads(capsys.readouterr().out)["error"]


def test_a_stale_curve_is_drawn_as_stale(done: Recording, tmp_path: Path) -> None:
    from harness.report.cost_page import write_cost_page

    page = write_cost_page(curve_of(done), ("cores was 2, is 4",), (METHOD.name,), "contacts", tmp_path)
    assert "STALE" in page.read_text()
    assert "cores was 2, is 4" in page.read_text()


def test_a_target_is_one_of_the_two() -> None:
    with pytest.raises(WrongUse):
        Target()
    with pytest.raises(WrongUse):
        Target(seconds=1.0, error=1e-3)
    assert isinstance(Front((), 1.0, 6, (), "", shipped=False).trusted, bool)
