"""The modes that sounds are compared with may come from the object's ObjectFile: nothing is solved then."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.answer import Models
from experiments.contact_localization.build_model import model_of_run, model_of_scene
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.model import Model
from experiments.contact_localization.posterior.estimate import SENSES
from experiments.contact_localization.settings import KNOBS, settings
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.cost.curve import Point, Sample
from harness.effects.accuracy import Accuracy, Level
from harness.effects.scene_object import known_object
from harness.effects.sound import SHAPES as SOUND
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment import object_modes
from harness.experiment.front import Front
from harness.objectfile.audio.part import with_audio
from harness.objectfile.entries import Modality, Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, create_run, station_calibration
from harness.tasks.scenes import SceneOptions, resolve
from tests.samples.object_bench import MODES, egg_part

STATION = load_station(station_path("mock"))
CALIBRATION = station_calibration(STATION)
MUG = known_object(scene_from_options("builtin:mug")).mesh
LOWEST: dict[str, Level] = {"sound.shapes": "network", "sound.modes": 16}


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """A mug that sounds like no mug."""
    folder = tmp_path_factory.mktemp("objects") / "mug"
    made = create_object(folder, "mug", MUG, MATERIALS["ceramic"], Provenance(licence="CC0-1.0"))
    part = egg_part(MUG)
    return with_audio(made, replace(part, modes=replace(part.modes, limit=2e4)))


@pytest.fixture(autouse=True)
def _nothing_is_solved(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def never(*_given: Any) -> Any:
        raise AssertionError("solved")

    monkeypatch.setattr("harness.effects.sound.modes_of", never)
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))


def scene_of(of: ObjectFile | None) -> SceneFile:
    scene = scene_from_options("builtin:mug", objectfile=None if of is None else str(of.folder))
    return scene.model_copy(update={"sensors": Sensors(sound=True)})


def at(levels: dict[str, Any]) -> Accuracy:
    return Accuracy.default(KNOBS).with_(levels)


@pytest.mark.parametrize("level", ["network", "table"])
def test_the_model_hears_with_the_objectfiles_modes(of: ObjectFile, level: str) -> None:
    model = model_of_scene(scene_of(of), STATION, MUG, CALIBRATION, at({**LOWEST, "sound.shapes": level}))
    assert model.modes is not None
    assert len(model.modes.frequencies) == MODES
    gains = model.gains(4e-3)
    assert gains.at_samples.shape == (len(model.surface(4e-3).points), MODES, 3)
    assert np.isfinite(gains.shapes).all()


def test_a_run_hears_with_those_it_carries(of: ObjectFile, tmp_path: Path) -> None:
    plan: dict[str, Any] = {"contacts": []}
    folder = tmp_path / "run"
    create_run(folder, "contact-localization", scene_of(of), STATION, MUG, CALIBRATION, plan, 0, None)
    run = RunFiles(Recording(folder))
    elsewhere = run.scene.model_copy(
        update={"object": run.scene.object.model_copy(update={"objectfile": str(tmp_path / "gone")})}
    )
    vars(run)["scene"] = elsewhere  # as where the run was carried to another machine
    model = model_of_run(run, at(LOWEST))
    assert model.modes is not None
    assert len(model.modes.frequencies) == MODES


def test_another_objects_is_refused_before_anything_is_compared(of: ObjectFile) -> None:
    bigger = Mesh(1.1 * MUG.vertices, MUG.faces)
    with pytest.raises(WrongUse, match=r"mug\b.* 94\.78 mm.* 104\.26 mm"):
        model_of_scene(scene_of(of), STATION, bigger, CALIBRATION, at(LOWEST))
    with pytest.raises(WrongUse, match=r"sound\.shapes = network.*\[object\].*sound\.shapes = elements"):
        model_of_scene(scene_of(None), STATION, MUG, CALIBRATION, at(LOWEST))


def test_nobody_reads_an_objectfile_where_modes_are_solved(
    of: ObjectFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_given: Any) -> Any:
        raise AssertionError("read")

    monkeypatch.setattr(object_modes, "known_file", never)
    with pytest.raises(AssertionError, match="solved"):
        model_of_scene(scene_of(of), STATION, MUG, CALIBRATION, at({}))


@pytest.mark.parametrize("sound", [True, False])
@pytest.mark.parametrize("networks", [("touch",), ("audio",), ("audio", "touch", "vision")])
def test_settings_with_networks_are_measured_beside_those_without(
    sound: bool, networks: tuple[Modality, ...]
) -> None:
    """The simulation is named where networks are the default, and so measured; nothing is measured twice."""

    def takes_networks(setting: Mapping[str, Level]) -> bool:
        dials = (SOUND, TOUCH)
        return any(setting.get(dial.name, dial.default) != dial.default for dial in dials)

    without, beside = settings(sound=sound), settings(sound=sound, networks=networks)
    simulated, added = beside[: len(without)], beside[len(without) :]
    assert [{**plain, **named} for plain, named in zip(without, simulated, strict=True)] == simulated
    assert not any(takes_networks(setting) for setting in simulated)
    assert all(takes_networks(setting) for setting in added)
    levels = {setting.get("sound.shapes", "open") for setting in added} - {"open"}
    assert levels == ({"network", "table"} if sound and "audio" in networks else set())
    drawn = {setting.get("touch.shapes", "open") for setting in added} - {"open"}
    assert drawn == ({"network"} if "touch" in networks else set())
    for setting in beside:
        at(setting)
        assert beside.count(setting) == 1


def test_a_budget_chooses_no_objectfile_where_the_scene_names_none() -> None:
    sample = Sample("mug-0", "mug", 1e-3, 2e-3, 0.1, 0.2, 0.2)
    named: dict[str, dict[str, Level]] = {"solved": {}, "learned": {"sound.shapes": "network"}}
    points = [
        Point(name, {SENSES.name: "both", **levels}, {"contacts": 6}, (sample,))
        for name, levels in named.items()
    ]
    front = Front(tuple(points), 1.0, 6, (), "today", shipped=False)
    unfit = partial(ContactMeasurement(EXPERIMENT).explain_refusal, scene_of(None))
    assert [point.name for point in front.fitting(unfit).points] == ["solved"]
    with pytest.raises(WrongUse, match=r"ObjectFiles.*touchstone cost contact-localization"):
        replace(front, points=(points[1],)).fitting(unfit)


def test_an_option_names_it_beside_an_object_and_not_beside_a_scene(of: ObjectFile) -> None:
    options = SceneOptions(object="builtin:mug", objectfile=str(of.folder))
    assert resolve(options).object.objectfile == str(of.folder)
    with pytest.raises(WrongUse, match=r"--material.*--objectfile.*--up-axis.*--object;"):
        resolve(replace(options, object=None, scene=Path("scenes/mug_both.toml")))


def test_what_the_modes_took_is_said_by_level(of: ObjectFile) -> None:
    def make(accuracy: Accuracy) -> Model:
        return model_of_scene(scene_of(of), STATION, MUG, CALIBRATION, accuracy)

    measured = ContactMeasurement(EXPERIMENT)
    measured.models["mug"] = Models(make)
    measured.models["mug"].at({SENSES.name: "both", **LOWEST})
    (said,) = measured.notes()
    assert "sound.modes 16, sound.edge 0.35, sound.shapes network" in said
