"""A run by an ObjectFile that comes with the program, with a scene camera: networks alone draw and sound."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.section import Localization
from harness.basics.errors import WrongUse
from harness.bench.scene import Light, SceneFile, Sensors, scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.experiment.begin import begin
from harness.experiment.compare import compare
from harness.experiment.experiment import Scored
from harness.experiment.in_process import perform_run
from harness.experiment.levels import chosen_levels
from harness.experiment.object_modes import object_modes
from harness.recording.run_folder import RunFiles
from harness.report.run_page import find_networks
from harness.sim.gel import height_map

STATION = load_station(station_path("mock"))
CALLS = ("touch.image", "camera.image")


def scene_with(colour: tuple[float, float, float] = (0.8, 0.8, 0.8)) -> SceneFile:
    """A wrench that a camera sees under one lamp, and that is touched twice."""
    scene = scene_from_options("wrench").with_section(Localization(contacts=2, spacing="spread"))
    lamp = Light(position=("0 m", "0 m", "1.5 m"), colour=colour)  # type: ignore[arg-type]
    update = {"observe": CALLS, "lights": (lamp,), "sensors": Sensors(touch=True, camera=True)}
    return scene.model_copy(update=update)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunFiles:
    folder = tmp_path_factory.mktemp("runs") / "run"
    cell = ContactCell("wrench", "default", 3, "spread")
    return RunFiles(perform_run(EXPERIMENT, cell, scene_with(), STATION, folder))


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was rasterised, followed by rays on the mesh and solved, call by call."""
    calls: list[str] = []

    rasterise = height_map.rasterise

    def counted(*given: Any) -> Any:
        calls.append("rasterised")
        return rasterise(*given)

    monkeypatch.setattr(height_map, "rasterise", counted)
    monkeypatch.setattr("harness.effects.sound.modes_of", lambda *_: calls.append("solved"))
    monkeypatch.setattr("harness.effects.camera.LitObject", lambda *_: calls.append("traced"))
    return calls


def test_networks_stand_for_every_simulation(run: RunFiles, simulated: list[str]) -> None:
    accuracy = chosen_levels(EXPERIMENT.knobs, (), run.network_levels)
    answering = ContactAnswering(run, accuracy)
    for record in run.recording.steps():
        answering.read(record)
    scored = Scored(run, answering, answering.answer(), None, accuracy, ())
    comparison = compare(scored, EXPERIMENT.sources(scored))
    assert simulated == []
    calls = comparison.evaluation.calls
    assert {"object.vision", "camera.image", "object.touch_codes"} <= calls.keys()
    assert not {"camera.seen", "object.lit"} & calls.keys()
    picture = comparison.arrays()["camera.image.colour"]
    camera = run.station.camera
    assert camera is not None
    assert picture.shape == (camera.rows, camera.columns, 3)
    assert comparison.arrays()["camera.image.coverage"].max() > 0.99
    assert np.isfinite(picture).all()
    assert picture.max() > 0.01
    assert comparison.observed()["camera.image"]["parts"].keys() == {"colour", "coverage"}
    assert [row.file for row in find_networks(scored)] == ["touch.onnx", "vision.onnx"]


def test_its_modes_are_the_networks_and_nothing_is_solved(simulated: list[str]) -> None:
    scene = scene_from_options("wrench")
    scene = scene.model_copy(update={"sensors": Sensors(sound=True)})
    modes = object_modes(scene, STATION, known_object(scene).mesh)
    assert simulated == []
    assert np.isfinite(modes.shapes).all()
    assert len(modes.frequencies) > 10


def test_a_coloured_lamp_is_refused_before_anything_moves(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"lamp 1 .*\[1\.0, 0\.8, 0\.6\].*camera\.image"):
        begin(EXPERIMENT, scene_with((1.0, 0.8, 0.6)), STATION, 3, "default", tmp_path / "run")
    assert not (tmp_path / "run").exists()
