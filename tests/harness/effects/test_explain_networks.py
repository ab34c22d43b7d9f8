"""``explain`` says which network stands for which simulation, how far off it is and how long it takes."""

import json
from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.cli import invoke
from harness.effects.catalogue import EFFECTS, scene_levels
from harness.effects.explain import NetworkInUse, networks_in_use, scene_plan
from harness.effects.plan import default_accuracy
from harness.objectfile.audio.part import with_audio
from harness.objectfile.file import ObjectFile
from tests.samples.object_bench import egg_part
from tests.samples.touch_bench import ball, ball_file


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only: a ball that is felt and heard."""
    made = ball_file(tmp_path_factory.mktemp("objects") / "ball")
    return with_audio(made, egg_part(ball()))


def in_use(scene: SceneFile, *texts: str) -> dict[str, NetworkInUse]:
    accuracy = default_accuracy(EFFECTS).with_(scene_levels(scene)).with_texts(texts)
    return {each.dial: each for each in networks_in_use(scene, scene_plan(scene, GELSIGHT_R15, accuracy))}


def heard(of: ObjectFile) -> SceneFile:
    scene = scene_from_options(str(of.folder))
    return scene.model_copy(update={"sensors": scene.sensors.model_copy(update={"sound": True})})


def test_each_has_the_error_and_the_seconds_of_its_model_card(of: ObjectFile) -> None:
    found = in_use(heard(of))
    assert set(found) == {"touch.shapes", "sound.shapes"}
    assert found["touch.shapes"].file == "touch.onnx"
    assert found["touch.shapes"].errors == {"psnr_db": 50.0}
    assert found["sound.shapes"].errors == {"gain_error_median": 0.01}
    assert "finite elements" in found["sound.shapes"].instead_of


def test_only_those_that_something_is_computed_from_are_named(of: ObjectFile) -> None:
    assert set(in_use(heard(of), "sound.shapes=elements")) == {"touch.shapes"}
    assert set(in_use(heard(of), "touch.shapes=reference")) == {"sound.shapes"}
    unseen = heard(of).model_copy(update={"observe": ()})
    assert set(in_use(unseen)) == {"sound.shapes"}
    assert in_use(scene_from_options("builtin:mug")) == {}


def test_the_command_takes_an_objectfile_as_a_scene(
    of: ObjectFile, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert invoke(["explain", str(of.folder), "--json"]) == 0
    (network,) = json.loads(capsys.readouterr().out)["networks"]
    assert (network["dial"], network["level"], network["file"]) == ("touch.shapes", "network", "touch.onnx")
    scene = tmp_path / "scene.toml"
    scene.write_text(f'schema = 1\n[object]\nobjectfile = "{of.folder}"\n')
    assert invoke(["explain", str(scene)]) == 0
    assert "touch.onnx" in capsys.readouterr().out


def test_a_network_of_no_objectfile_is_refused() -> None:
    with pytest.raises(WrongUse, match="ObjectFile"):
        in_use(scene_from_options("builtin:mug"), "touch.shapes=network")
