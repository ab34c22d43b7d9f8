"""A run by an ObjectFile: its networks stand for every simulation that they can stand for."""

import subprocess
import sys
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from experiments.contact_localization.answer import Answer, ContactAnswering
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.section import Localization
from harness.basics.errors import DataRefused
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.accuracy import Accuracy
from harness.experiment.compare import compare
from harness.experiment.experiment import Scored
from harness.experiment.in_process import perform_run
from harness.experiment.levels import chosen_levels
from harness.objectfile.file import ObjectFile
from harness.recording.run_folder import RunFiles
from harness.sim.gel import height_map
from tests.samples import touch_bench as tb

STATION = load_station(station_path("mock"))


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only: a ball with codes for the bench's gel."""
    return tb.ball_file(tmp_path_factory.mktemp("objects") / "ball")


@pytest.fixture(scope="module")
def run(of: ObjectFile, tmp_path_factory: pytest.TempPathFactory) -> RunFiles:
    """Three presses of it."""
    scene = scene_from_options(str(of.folder)).with_section(Localization(contacts=3, spacing="spread"))
    folder = tmp_path_factory.mktemp("runs") / "run"
    cell = ContactCell("ball", "default", 5, "spread")
    return RunFiles(perform_run(EXPERIMENT, cell, scene, STATION, folder))


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was rasterised and solved, call by call."""
    calls: list[str] = []
    rasterise = height_map.rasterise

    def counted(*given: Any) -> Any:
        calls.append("rasterised")
        return rasterise(*given)

    monkeypatch.setattr(height_map, "rasterise", counted)
    monkeypatch.setattr("harness.effects.sound.modes_of", lambda *_: calls.append("solved"))
    return calls


def answered(run: RunFiles, *texts: str) -> tuple[Answer, Accuracy]:
    accuracy = chosen_levels(EXPERIMENT.knobs, texts, run.network_levels)
    answering = ContactAnswering(run, accuracy)
    for record in run.recording.steps():
        answering.read(record)
    return answering.answer(), accuracy


def test_nothing_is_rasterised_where_networks_stand_for_it(run: RunFiles, drawn: list[str]) -> None:
    found, accuracy = answered(run)
    scored = Scored(run, cast(Any, None), found, None, accuracy, ())
    comparison = compare(scored, EXPERIMENT.sources(scored))
    assert accuracy["touch.shapes"] == "network"
    assert comparison.notes == ()
    assert "object.touch_codes" in comparison.evaluation.calls
    assert drawn == []
    answered(run, "touch.shapes=reference")
    assert drawn.count("rasterised") >= 3


def test_networks_answer_as_the_mesh_does(run: RunFiles) -> None:
    """To the arm's own error: an object that is one ball all over tells places apart by the arm alone."""
    by_network, by_mesh = answered(run)[0], answered(run, "touch.shapes=reference")[0]
    apart = np.linalg.norm(by_network.last.position_in_object - by_mesh.last.position_in_object)
    assert apart < by_mesh.last.credible90
    assert not any(gate.slipped or gate.missed for gate in by_network.last.gates)


def test_a_run_is_answered_by_the_networks_that_it_carries(
    run: RunFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    gone = run.scene.object.model_copy(update={"objectfile": "/gone"})
    monkeypatch.setitem(vars(run), "scene", run.scene.model_copy(update={"object": gone}))
    assert np.isfinite(answered(run)[0].last.position_in_object).all()


def test_a_pose_that_no_network_answers_is_drawn_and_said(run: RunFiles, drawn: list[str]) -> None:
    found, accuracy = answered(run)
    scored = Scored(run, cast(Any, None), found, None, accuracy, ())
    beside = np.eye(4)[None] + 0.0
    comparison = compare(scored, {"contact_gel_from_object": beside})
    assert drawn
    (note,) = comparison.notes
    assert "touch.shapes = reference" in note


def test_a_damaged_network_in_a_run_is_refused(run: RunFiles) -> None:
    path = run.recording.folder / "objectfile" / "touch.onnx"
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    try:
        with pytest.raises(DataRefused, match=r"touch\.onnx\b.*sha256"):
            answered(replace(run))
    finally:
        path.write_bytes(data)


_LOADED = """
import sys
from pathlib import Path
from harness.api import answer
print(answer(Path(sys.argv[1]))["estimates"]["touch"]["position_m"] is not None)
print(sorted({"torch", "mitsuba"} & sys.modules.keys()))
"""


def test_no_program_that_trains_is_loaded(run: RunFiles) -> None:
    said = subprocess.run(
        [sys.executable, "-c", _LOADED, str(run.recording.folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.stdout.split("\n")[:2] == ["True", "[]"], said.stderr
