"""An object whose sound cannot be compared is located by touch, and the answer says why: run and replay."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.report.sound_report import gather_strikes
from harness.basics.errors import FitRefused, MeshRefused
from harness.basics.materials import MATERIALS
from harness.bench.scene import scene_from_json
from harness.experiment.answer import write_answer
from harness.experiment.compare import compare
from harness.experiment.report_content import Missing
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.sim.modal import modal
from harness.sim.modal.modes import Modes
from tests.oracles.volume_meshes import box
from tests.support.localization import chosen
from tests.support.whole_run import in_process_run

WHY = "a neck was lost"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Two contacts with a steel block, each pressed and struck."""
    folder = tmp_path_factory.mktemp("struck")
    surface = box((0.08, 0.05, 0.03), (4, 3, 2)).surface
    lines = [f"v {x} {y} {z}" for x, y, z in surface.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in surface.faces + 1]
    (folder / "block.obj").write_text("\n".join(lines))
    tree = {
        "schema": 1,
        "object": {"mesh": str(folder / "block.obj"), "material": "steel", "units": "m"},
        "sensors": {"sound": True},
        "localization": {"contacts": 2, "spacing": "close"},
    }
    return in_process_run(folder / "run", scene_from_json(tree, "the test"), seed=0)


@pytest.fixture
def unfillable(monkeypatch: pytest.MonkeyPatch) -> None:
    """No surface can be filled any more; what was found before is not looked up."""

    def refuse(*_: object, **__: object) -> Modes:
        raise MeshRefused(WHY)

    monkeypatch.setattr("harness.effects.sound.modes_of", refuse)
    monkeypatch.setattr("harness.basics.store.Store.get", lambda *_: None)


@pytest.mark.usefixtures("unfillable")
def test_touch_answers_and_the_result_says_why_sound_does_not(recording: Recording, tmp_path: Path) -> None:
    written = write_answer(EXPERIMENT, RunFiles(recording), chosen([]), tmp_path)
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["answer"] == "touch"
    assert np.isfinite(result["estimates"]["touch"]["position_m"]).all()
    assert all(WHY in result["estimates"][sense]["refused"] for sense in ("audio", "both"))
    assert any(WHY in warning and "touch" in warning for warning in result["warnings"])
    scored = written.scored
    comparison = compare(scored, EXPERIMENT.sources(scored))
    assert set(comparison.observed()) == {"touch.image"}
    assert any(WHY in note for note in comparison.notes)
    shown = gather_strikes(scored)
    assert isinstance(shown, Missing)
    assert WHY in shown.reason


def test_fewer_contacts_than_all_are_pictured_and_not_judged(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A refusal of the first contacts alone ended a run after its answer."""
    run, touch = RunFiles(recording), chosen(["localization.senses=touch"])
    answering = ContactAnswering(run, touch)
    for record in recording.steps():
        answering.read(record)
    last = answering.answer().last

    def refuse(*_: object) -> None:
        raise FitRefused("no place explains the contacts")

    monkeypatch.setattr("experiments.contact_localization.posterior.estimate.refuse_bad_fit", refuse)
    first, known = answering.history(last, "touch")
    assert isinstance(first, Estimate)
    assert known is last


@pytest.mark.usefixtures("unfillable")
def test_an_estimate_by_sound_alone_is_refused_before_anything_moves(recording: Recording) -> None:
    with pytest.raises(MeshRefused, match=WHY):
        ContactAnswering(RunFiles(recording), chosen(["localization.senses=audio"]))


def test_modes_without_stiffness_are_no_sound(recording: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    run = RunFiles(recording)
    sound: Any = modal.modes_of(run.mesh, MATERIALS["steel"], most=8)
    loose = {**vars(sound), "frequencies": np.array([0.0, *sound.frequencies[1:]])}
    monkeypatch.setattr(
        "experiments.contact_localization.build_model.object_modes", lambda *_: Modes(**loose)
    )
    with pytest.raises(MeshRefused, match="stiffness"):
        model_of_scene(run.scene, run.station, run.mesh, run.calibration)
