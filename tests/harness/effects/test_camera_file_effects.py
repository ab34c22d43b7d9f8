"""The scene camera's picture in the catalogue: by rays, or by an ObjectFile's networks; lamps add up."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import Light, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.catalogue import EFFECTS
from harness.effects.evaluate import evaluate
from harness.effects.explain import scene_plan
from harness.effects.plan import default_accuracy
from harness.effects.quantities import Quantities
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject
from tests.oracles.seen_shapes import square, together
from tests.samples.look_bench import box_file

SCENE = scene_from_options("builtin:mug").model_copy(update={"sensors": Sensors(camera=True)})


def test_a_scene_camera_sees_what_rays_and_lights_say() -> None:
    """The catalogue's picture is the direct level's, shadow and all."""
    light = Light(position=("0 m", "0 m", "2 m"))  # type: ignore[arg-type]
    update = {"observe": ("camera.image",), "lights": (light,)}
    made = scene_plan(SCENE.model_copy(update=update), GELSIGHT_R15)
    look = plain(together(square(0.1), square(0.03, 0.05)), (0.8, 0.5, 0.2))
    camera = Pinhole.looking_at((0.2, 0, 0.3), (0, 0, 0), (0, 0, 1), 20, 16, 0.5)
    lamps = (DirectionalLight(np.array([-0.2, 0.0, 1.0])),)
    given: Quantities = {"object_appearance": look, "camera": camera, "camera_lights": lamps}
    found = evaluate(made, given).values["camera_image"]
    wanted = LitObject(look).render(camera, lamps, 4)
    np.testing.assert_array_equal(found.image.colour, wanted.image.colour)
    bare = LitObject(look).render(camera, lamps, 4, shadow=False)
    assert np.abs(bare.image.colour - wanted.image.colour).max() > 0.1


def test_a_scene_camera_takes_its_picture_from_the_networks(tmp_path: Path) -> None:
    """Of a known look; two lamps add up, and no ray on the mesh is followed for it."""
    of = box_file(tmp_path / "box")
    named = SCENE.object.model_copy(update={"objectfile": str(of.folder)})
    update = {"observe": ("camera.image",), "object": named}
    scene = SCENE.model_copy(update=update)
    accuracy = default_accuracy(EFFECTS).with_({"camera.look": "network"})
    made = scene_plan(scene, GELSIGHT_R15, accuracy)
    assert [step.effect.provides for step in made.ran] == ["object.vision", "camera.image"]
    lamps = tuple(DirectionalLight(np.array(way)) for way in ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0)))
    given: Quantities = {
        "object_file": of,
        "object_mesh": of.mesh,
        "object_wall": None,
        "camera": Pinhole.looking_at((0.2, -0.2, 0.2), (0, 0, 0), (0, 0, 1), 16, 12, 0.5),
    }
    both, one, none = (
        evaluate(made, {**given, "camera_lights": lamps[:k]}).values["camera_image"] for k in (2, 1, 0)
    )
    assert one.image.alpha.max() > 0.99
    np.testing.assert_allclose(both.image.colour, 2.0 * one.image.colour, rtol=1e-5)
    np.testing.assert_array_equal(none.image.alpha, one.image.alpha)
    assert not none.image.colour.any()
    other = Mesh(1.1 * of.mesh.vertices, of.mesh.faces)
    with pytest.raises(WrongUse, match=r"camera\.look = direct"):
        evaluate(made, {**given, "camera_lights": lamps, "object_mesh": other})


def test_a_picture_by_networks_needs_an_objectfile_in_the_scene() -> None:
    scene = SCENE.model_copy(update={"observe": ("camera.image",)})
    accuracy = default_accuracy(EFFECTS).with_({"camera.look": "network"})
    with pytest.raises(WrongUse, match="ObjectFile"):
        scene_plan(scene, GELSIGHT_R15, accuracy)


@pytest.mark.parametrize("level", ["onnx", "one_sample"])
def test_a_level_that_was_removed_names_the_one_in_its_place(level: str) -> None:
    with pytest.raises(WrongUse, match=rf"camera\.look .*'{level}'.* network"):
        default_accuracy(EFFECTS).with_texts([f"camera.look={level}"])
