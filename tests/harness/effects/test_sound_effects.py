"""Sound as effects: computed where the scene calls for it, kept in the store, and nowhere else."""

from typing import Any

import numpy as np
import pytest
from manifold3d import Manifold

from harness.basics.arrays import AnyArray
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.bench.scene import Room, SceneFile, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.explain import as_json, scene_plan
from harness.effects.plan import default_accuracy, plan
from harness.effects.quantities import Quantities
from harness.objects.solid import from_manifold
from harness.sim.modal.modal import from_arrays
from harness.sim.sound.modal_sound import Strikes
from harness.sim.sound.room import MicrophoneResponse, RoomField
from tests.samples.blows import half_sine

SILENT = scene_from_options("builtin:mug")
HEARD = SILENT.model_copy(update={"sensors": Sensors(sound=True)})
IN_A_ROOM = HEARD.model_copy(update={"room": Room(size=("4 m", "3 m", "2.5 m"))})  # type: ignore[arg-type]
SOUND_NAMES = {"object.modes", "object.sound", "room.reverberation", "microphone.pressure"}
RATE = 50e3


@pytest.fixture(scope="module")
def sources() -> Quantities:
    """A ball of plastic struck twice, the second time twice as hard."""
    solid = from_manifold(Manifold.sphere(30.0, 32))
    force = np.zeros((2, 2000))
    pulse = half_sine(RATE, 1e-4, 20.0)
    force[:, : len(pulse)] = pulse * np.array([[1.0], [2.0]])
    points = np.repeat([[0.0, 0.0, 0.03]], 2, axis=0)
    return {
        "object_mesh": Mesh(solid.vertices * 1e-3, solid.faces),
        "object_material": MATERIALS["plastic"],
        "object_wall": None,
        "strike": Strikes(points, np.repeat([[0.0, 0.6, -0.8]], 2, axis=0), force, RATE),
        "room": RoomField(0.4, 3.0, 5),
        "microphone": MicrophoneResponse(),
    }


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(tmp_path_factory.mktemp("store"))


def heard(scene: SceneFile, sources: Quantities, store: Store | None, **levels: Any) -> Evaluation:
    accuracy = Accuracy(knobs_of(EFFECTS), {name.replace("_", "."): level for name, level in levels.items()})
    chosen = plan(EFFECTS, Facts(scene, GELSIGHT_R15), ["microphone.pressure"], accuracy)
    return evaluate(chosen, sources, store)


def test_a_touch_only_scene_plans_no_sound_and_says_why() -> None:
    told = as_json(scene_plan(SILENT, GELSIGHT_R15))
    skipped = {step["effect"]: step["reason"] for step in told["skipped"]}
    assert skipped.keys() >= SOUND_NAMES
    assert all("sensors.sound is false" in skipped[name] for name in SOUND_NAMES - {"room.reverberation"})
    with pytest.raises(WrongUse, match=r"sensors\.sound is false"):
        plan(EFFECTS, Facts(SILENT, GELSIGHT_R15), ["microphone.pressure"], default_accuracy(EFFECTS))


def test_in_the_open_no_room_is_computed(sources: Quantities, store: Store) -> None:
    open_field = heard(HEARD, sources, store)
    assert set(open_field.calls) | set(open_field.from_store) >= {"object.modes", "object.sound"}
    assert "room.reverberation" not in open_field.calls
    pressure = open_field.values["microphone_pressure"]
    assert pressure.shape == (2, 2000)
    assert np.isfinite(pressure).all()
    assert pressure[1] == pytest.approx(2.0 * pressure[0], rel=1e-9, abs=1e-12)
    assert 1e-3 < np.abs(pressure).max() < 1e3
    in_a_room = heard(IN_A_ROOM, sources, store)
    assert in_a_room.calls["room.reverberation"] == 1
    late = slice(500, None)
    assert np.std(in_a_room.values["microphone_pressure"][0, late] - pressure[0, late]) > 0.0


def test_modes_come_from_the_store_the_second_time(sources: Quantities, store: Store) -> None:
    heard(HEARD, sources, store)
    again = heard(HEARD, sources, store)
    assert "object.modes" in again.from_store
    assert "object.modes" not in again.calls
    modes = from_arrays(again.values["object_modes"])
    assert modes.rigid == 6
    assert modes.frequencies[0] > 1000.0


def test_modes_that_earlier_versions_stored_are_found(monkeypatch: pytest.MonkeyPatch, store: Store) -> None:
    """The key of these modes at version 4; what changes it makes every user solve all modes again."""
    keys: list[str] = []

    def get(_store: Store, key: str) -> AnyArray:
        keys.append(key)
        return np.zeros(1)

    monkeypatch.setattr(Store, "get", get)
    corners, faces = 0.1 * np.eye(4, 3), np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    chosen = plan(EFFECTS, Facts(HEARD, GELSIGHT_R15), ["object.modes"], default_accuracy(EFFECTS))
    solid, plastic = Mesh(corners, faces), MATERIALS["plastic"]
    evaluate(chosen, {"object_mesh": solid, "object_wall": None, "object_material": plastic}, store)
    assert keys == ["4c845a574b5944e05a86af1b5694818d1c9c35a77f987c504f498c3dee6c31fd"]
