"""The result and the report of a run: every promised key, null without the truth, both sides named."""

import importlib
import json
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.report.result import result_of
from harness.agreement.compare_run import agreement_of
from harness.cli import invoke
from harness.effects import catalogue
from harness.effects.effect import Effect
from harness.experiment import answer as answers
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.sim.optics.optics import Optics
from tests.support import sessions as session_of
from tests.support.localization import chosen
from tests.support.whole_run import copied

KERNELS = (
    "harness.sim.gel.height_map:height_maps",
    "harness.sim.gel.gel:deform",
    "harness.sim.optics.optics:with_camera_noise",
)
"""Simulation of readings; the estimator has its own cheaper terms, and calls none of these."""

NOT_CALLED_FOR = (
    "touch.shadow",
    "touch.markers",
    "touch.noise",
    "object.modes",
    "object.sound",
    "room.reverberation",
    "microphone.pressure",
    "camera.seen",
    "camera.shadow",
    "camera.image",
)


class Counting:
    """Counts the calls of every effect and kernel for as long as it is in place."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.effects: Counter[str] = Counter()
        self.kernels: Counter[str] = Counter()
        original = catalogue.EFFECTS
        effects = tuple(self._effect(effect) for effect in original)
        for module in list(sys.modules.values()):
            if vars(module).get("EFFECTS") is original:
                patch.setattr(module, "EFFECTS", effects)
        for target in KERNELS:
            home, _, name = target.partition(":")
            kernel = vars(importlib.import_module(home))[name]
            counted = self._counted(name, kernel, self.kernels)
            for module in list(sys.modules.values()):
                if vars(module).get(name) is kernel:
                    patch.setattr(module, name, counted)
        patch.setattr(Optics, "render", self._counted("render", Optics.render, self.kernels))

    def _effect(self, effect: Effect) -> Effect:
        return replace(effect, compute=self._counted(effect.provides, effect.compute, self.effects))

    def uncounted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """What it calls is no part of the plan: it simulates presses of its own, to compare readings with."""

        def called(*arguments: Any, **named: Any) -> Any:
            before = [(counter, Counter(counter)) for counter in (self.effects, self.kernels)]
            found = function(*arguments, **named)
            for counter, counts in before:
                counter.clear()
                counter.update(counts)
            return found

        return called

    @staticmethod
    def _counted(name: str, function: Callable[..., Any], counter: Counter[str]) -> Callable[..., Any]:
        @wraps(function)
        def counted(*arguments: Any, **named: Any) -> Any:
            counter[name] += 1
            return function(*arguments, **named)

        return counted


@pytest.fixture(scope="module")
def finished(
    done: Recording, tmp_path_factory: pytest.TempPathFactory
) -> tuple[dict[str, Any], Counting, Path]:
    """A real ``finish``, report and all, with every call counted."""
    folder = tmp_path_factory.mktemp("finished")
    recording = copied(done, folder / "run")
    with pytest.MonkeyPatch.context() as patch:
        counting = Counting(patch)
        patch.setattr(answers, "agreement_of", counting.uncounted(agreement_of))
        result = session_of.finish(recording, chosen([]), None)
    return result, counting, recording.folder


@pytest.fixture(scope="module")
def result(finished: tuple[dict[str, Any], Counting, Path]) -> dict[str, Any]:
    return finished[0]


def test_every_promised_key_is_there(result: dict[str, Any]) -> None:
    touch = result["estimates"]["touch"]
    assert len(touch["position_m"]) == 3
    for key in ("error_m", "error_mean_m", "error_top10_m", "credible90_m", "seconds"):
        assert isinstance(touch[key], float), key
        assert touch[key] > 0.0, key
    assert touch["modes"]
    assert sum(mode["weight"] for mode in touch["modes"]) <= 1.0 + 1e-9
    assert isinstance(result["random_baseline_m"], float)
    assert isinstance(result["geometry_baseline_m"], float)
    assert set(result["plan"]) == {"ran", "skipped"}
    assert set(result["accuracy"]) >= {"localization.method", "touch.optics"}
    assert Path(result["recording"]).is_dir()
    assert Path(result["report"]).is_file()
    assert result["schema"] == 1
    json.dumps(result, allow_nan=False)


def test_the_error_is_the_distance_to_the_true_contact(result: dict[str, Any], done: Recording) -> None:
    truth = json.loads(done.truth_path.read_text())
    points = np.array([contact["point_in_object_m"] for contact in truth["contacts"]])
    touch = result["estimates"]["touch"]
    contacts = np.array([contact["position_m"] for contact in touch["contacts"]])
    assert touch["error_m"] == pytest.approx(np.linalg.norm(touch["position_m"] - points[-1]), abs=1e-15)
    assert touch["error_mean_m"] == pytest.approx(np.linalg.norm(contacts - points, axis=1).mean(), abs=1e-15)


def test_the_result_lies_beside_the_readings(finished: tuple[dict[str, Any], Counting, Path]) -> None:
    result, _, folder = finished
    assert json.loads((folder / "result.json").read_text()) == json.loads(json.dumps(result))
    page = Path(result["report"]).read_text()
    assert "<script src" not in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert list(Path(result["report"]).parent.glob("*.png"))


def test_exactly_the_plan_ran(finished: tuple[dict[str, Any], Counting, Path]) -> None:
    result, counting, _ = finished
    ran = [step["effect"] for step in result["plan"]["ran"]]
    assert dict(counting.effects) == dict.fromkeys(ran, 1)
    assert [step["calls"] for step in result["plan"]["ran"]] == [1] * len(ran)
    skipped = {step["effect"]: step["reason"] for step in result["plan"]["skipped"]}
    assert set(NOT_CALLED_FOR) <= set(skipped)
    assert all(skipped.values())
    assert set(skipped) | set(ran) == {effect.provides for effect in catalogue.EFFECTS}
    assert dict(counting.kernels) == {"height_maps": 1, "deform": 1, "render": 1}


def test_what_is_not_planned_would_be_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The control: the counters stand where an evaluation looks for its effects."""
    counting = Counting(monkeypatch)
    effects: tuple[Effect, ...] = vars(importlib.import_module("harness.effects.explain"))["EFFECTS"]
    shadow = next(effect for effect in effects if effect.provides == "touch.shadow")
    with pytest.raises(TypeError):
        shadow.compute()
    assert counting.effects == {"touch.shadow": 1}


def test_world_and_estimator_differ_and_both_are_named(
    finished: tuple[dict[str, Any], Counting, Path], done: Recording
) -> None:
    result, _, _ = finished
    world, run = result["world"], RunFiles(done)
    assert world["mesh_vertices"] != len(run.mesh.vertices)
    assert world["mesh_faces"] != len(run.mesh.faces)
    assert world["optics_level"] != result["accuracy"]["touch.optics"]
    assert world["calibration_sha256"] != run.calibration.sha256
    page = Path(result["report"]).read_text()
    for named in (
        world["mesh_faces"],
        len(run.mesh.faces),
        world["optics_level"],
        result["accuracy"]["touch.optics"],
        world["calibration_sha256"][:8],
        run.calibration.sha256[:8],
    ):
        assert str(named) in page, f"the report does not name {named}"


def without_what_may_differ(result: Any) -> Any:
    """A result less its seconds and paths."""
    if isinstance(result, dict):
        left_out = ("seconds", "seconds_by_stage", "recording", "report")
        return {key: without_what_may_differ(v) for key, v in result.items() if key not in left_out}
    return [without_what_may_differ(item) for item in result] if isinstance(result, list) else result


def test_a_replay_gives_the_same_numbers_to_the_bit(finished: tuple[dict[str, Any], Counting, Path]) -> None:
    first, _, folder = finished
    again = result_of(session_of.score(Recording(folder), chosen([])))
    mine = {key: first[key] for key in again}
    assert without_what_may_differ(again) == without_what_may_differ(mine)


SCORES = ("error_m", "error_symmetric_m", "error_mean_m", "error_top10_m", "in_region90")


@pytest.mark.slow  # a whole replay; that the truth is not looked at stays in test_estimates_of_a_recording.py
def test_a_replay_without_the_truth_has_the_same_answer_and_no_scores(
    finished: tuple[dict[str, Any], Counting, Path],
    done: Recording,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    first = without_what_may_differ(json.loads(json.dumps(finished[0])))["estimates"]["touch"]
    folder = copied(done, tmp_path / "run", truth=False).folder
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert invoke(["replay", str(folder), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    again = without_what_may_differ(result)["estimates"]["touch"]
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    assert [again.pop(key) for key in SCORES] == [None] * len(SCORES)
    assert [contact.pop("error_m") for contact in again["contacts"]] == [None] * 3
    for key in SCORES:
        del first[key]
    for contact in first["contacts"]:
        del contact["error_m"]
    assert again == first
    assert [result[key] for key in ("random_baseline_m", "geometry_baseline_m", "world")] == [None] * 3
    assert Path(result["report"]).parent.parent == tmp_path / "run-replay"
    assert (tmp_path / "run-replay" / "result.json").is_file()


@pytest.mark.slow  # three replays; one is compared to the bit above
def test_a_replay_takes_the_levels_of_the_runs_own_result(
    done: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A budget or ``--level`` chose other levels than the default ones; only --level turns them again."""
    run = copied(done, tmp_path / "run")
    first = session_of.finish(run, chosen(["localization.samples=600", "localization.rounds=1"]), None)
    assert invoke(["replay", str(run.folder), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert without_what_may_differ(again) == without_what_may_differ(json.loads(json.dumps(first)))
    assert again["accuracy"]["localization.samples"] == 600
    assert invoke(["replay", str(run.folder), "--json", "--level", "localization.rounds=0"]) == 0
    turned = json.loads(capsys.readouterr().out)["accuracy"]
    assert turned == {**first["accuracy"], "localization.rounds": 0}
    (run.folder / "result.json").write_text("{}")
    assert invoke(["replay", str(run.folder), "--json"]) == 0
    said = capsys.readouterr()
    assert "levels" in said.err
    assert json.loads(said.out)["accuracy"] == dict(chosen([]))
