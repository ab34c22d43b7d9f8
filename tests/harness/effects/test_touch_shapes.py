"""The ObjectFile's codes and the rasteriser are levels of one quantity: the gel's surface."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.basics.geometry import inverse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.explain import as_json, scene_plan
from harness.effects.plan import plan
from harness.effects.quantities import Quantities
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.touch.touch import open_touch
from harness.sim.gel.gel import R15_SKIRT
from harness.sim.gel.press_pose import Presses
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples import touch_bench as tb
from tests.samples.object_bench import PROVENANCE

BENCH = shipped_calibration("gelsight_r15_bench")
CALIBRATION = replace(BENCH, header=replace(BENCH.header, skirt=tb.SKIRT))


@pytest.fixture(scope="module")
def of(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only."""
    return tb.peg_file(tmp_path_factory.mktemp("objects") / "peg")


def scene_of(of: ObjectFile | None) -> SceneFile:
    return scene_from_options("builtin:mug", objectfile=None if of is None else str(of.folder))


def presses() -> Presses:
    nodes, some = tb.coded().nodes, np.linspace(0.0, 1.0, 6)
    chosen = np.linspace(0, len(nodes) - 1, 6).astype(np.int64)
    return Presses(
        nodes.points[chosen], nodes.normals[chosen], 1e-3 + 5e-4 * some, 0.2 * some, 3.0 * some, some
    )


def evaluated(of: ObjectFile | None, level: str, given: Quantities | None = None) -> Evaluation:
    accuracy = Accuracy(knobs_of(EFFECTS), {"touch.shapes": level})
    made = plan(EFFECTS, Facts(scene_of(of), tb.SENSOR), ["touch.gel"], accuracy)
    sources: Quantities = {
        "object_mesh": tb.peg(),
        "object_wall": None,
        "contact_gel_from_object": inverse(presses().object_from_gel),
        "sensor": tb.SENSOR,
        "sensor_calibration": CALIBRATION,
    }
    if of is not None:
        sources["object_file"] = of
    return evaluate(made, {**sources, **(given or {})})


def test_codes_are_a_level_of_what_the_rasteriser_computes(of: ObjectFile) -> None:
    codes, reference = evaluated(of, "network"), evaluated(of, "reference")
    assert np.sqrt(((codes.values["touch_gel"] - reference.values["touch_gel"]) ** 2).mean()) < 5e-5
    assert set(codes.calls) == {"contact.presses", "object.touch_codes", "touch.gel"}
    assert set(reference.calls) == {"object.raster", "touch.height_map", "touch.gel"}


def test_a_pose_is_answered_as_the_press_that_it_is(of: ObjectFile) -> None:
    """To float32's rounding of a millimetre."""
    np.testing.assert_allclose(
        evaluated(of, "network").values["touch_gel"], open_touch(of, "codes").at(presses()), atol=1e-8
    )


def test_the_rasteriser_asks_for_no_objectfile_even_where_there_is_one(of: ObjectFile) -> None:
    accuracy = Accuracy(knobs_of(EFFECTS), {})
    made = plan(EFFECTS, Facts(scene_of(of), tb.SENSOR), ["touch.gel"], accuracy)
    assert made.sources == ("object.mesh", "contact.gel_from_object", "sensor", "sensor.calibration")


def test_shadows_start_from_the_object_itself_at_every_level(of: ObjectFile) -> None:
    accuracy = Accuracy(knobs_of(EFFECTS), {"touch.shapes": "network"})
    lit = replace(GELSIGHT_R15, casts_shadow=True)
    ran = {
        step.effect.provides
        for step in plan(EFFECTS, Facts(scene_of(of), lit), ["touch.image"], accuracy).ran
    }
    assert {"touch.height_map", "object.touch_codes", "touch.darkening"} <= ran


def test_without_an_objectfile_its_level_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"touch\.shapes = network: .*ObjectFile .*touch\.shapes = reference"):
        evaluated(None, "network")


def test_the_removed_perceptron_names_what_replaces_it(of: ObjectFile) -> None:
    with pytest.raises(WrongUse, match=r"'perceptron'.*network"):
        evaluated(of, "perceptron")


def test_an_objectfile_without_touch_is_refused(tmp_path: Path) -> None:
    untouched = create_object(tmp_path / "peg", "peg", tb.peg(), MATERIALS["steel"], PROVENANCE)
    with pytest.raises(DataRefused, match=r"--only touch.*touch\.shapes = reference"):
        evaluated(untouched, "network")


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (Mesh(tb.peg().vertices * 1e3, tb.peg().faces), "x .* mm.* x 38000"),
        (Mesh(tb.peg().vertices + np.array([1e-3, 0.0, 0.0]), tb.peg().faces), "x .*y .*z .* mm"),
    ],
    ids=["millimetres", "moved"],
)
def test_another_object_is_refused_and_said(of: ObjectFile, mesh: Mesh, said: str) -> None:
    with pytest.raises(WrongUse, match=f"{said}.*touch.shapes = reference"):
        evaluated(of, "network", {"object_mesh": mesh})


@pytest.mark.parametrize(
    ("sensor", "skirt", "said"),
    [
        (replace(tb.SENSOR, rows=25), tb.SKIRT, r"24 x 32 pixels.* 25 x 32"),
        (replace(tb.SENSOR, pitch=0.61e-3), tb.SKIRT, r"0\.6 mm.* 0\.61 mm"),
        (replace(tb.SENSOR, gel_thickness=3e-3), tb.SKIRT, r"2\.5 mm.* 3 mm"),
        (replace(tb.SENSOR, gel_radius=0.1), tb.SKIRT, "coarse .*dome"),
        (tb.SENSOR, R15_SKIRT, "skirt .*calibration"),
    ],
    ids=["rows", "pitch", "thickness", "dome", "skirt"],
)
def test_another_gel_is_refused_and_said(of: ObjectFile, sensor: Any, skirt: Any, said: str) -> None:
    calibration = replace(BENCH, header=replace(BENCH.header, skirt=skirt))
    with pytest.raises(WrongUse, match=f"{said}.*touch.shapes = reference"):
        evaluated(of, "network", {"sensor": sensor, "sensor_calibration": calibration})


def test_a_pose_that_the_codes_were_not_made_for_is_refused(of: ObjectFile) -> None:
    deep = replace(presses(), depths=np.full(6, 2.6e-3))
    with pytest.raises(OutOfDomain, match=r"2\.6 mm.* 0 to 2\.5 mm"):
        evaluated(of, "network", {"contact_gel_from_object": inverse(deep.object_from_gel)})


@pytest.mark.parametrize(
    ("level", "why"),
    [
        ("network", "touch.shapes is network, and the scene names an ObjectFile"),
        ("reference", "touch.shapes is reference, its default"),
    ],
)
def test_explain_says_which_level_runs_and_why(of: ObjectFile, level: str, why: str) -> None:
    told = as_json(
        scene_plan(scene_of(of), GELSIGHT_R15, Accuracy(knobs_of(EFFECTS), {"touch.shapes": level}))
    )
    steps = {step["effect"]: step for step in told["ran"]}
    assert steps["touch.gel"]["reason"].endswith(why)
    assert ("object.touch_codes" in steps) == (level == "network")
    assert ("touch.height_map" in steps) == (level == "reference")


_LOADING = """
import sys
from pathlib import Path
import numpy as np
from harness.objectfile.file import ObjectFile
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.press_pose import contact_place, gel_from_object
from harness.sim.optics.tactile_calibration import shipped_calibration
from harness.sim.optics.known_gel import Gel
from harness.effects.touch_press import press_gel
TOUCH = {"harness.objectfile.touch.touch", "harness.objectfile.touch.level", "onnx", "onnxruntime"}
mesh = ObjectFile.open(Path(sys.argv[1])).mesh
at = gel_from_object(contact_place(mesh, np.array([0.01, 0.02, 0.05])), 1e-3, 0.0, 0.0, 0.0)
scene = scene_from_options("builtin:mug", objectfile=sys.argv[1])
gel = Gel(GELSIGHT_R15, shipped_calibration("gelsight_r15_bench"))
press_gel({"object_mesh": mesh, "contact_gel_from_object": at[None]}, gel, scene)
print(sorted(TOUCH & sys.modules.keys()))
press_gel({"object_mesh": mesh, "contact_gel_from_object": at[None]}, gel, scene, ["touch.shapes=network"])
print("harness.objectfile.touch.touch" in sys.modules)
"""


def test_a_scene_that_does_not_ask_loads_nothing_of_it(tmp_path: Path) -> None:
    folder = tb.ball_file(tmp_path / "ball").folder
    said = subprocess.run(
        [sys.executable, "-c", _LOADING, str(folder)], capture_output=True, text=True, check=False
    )
    assert said.stdout.split("\n")[:2] == ["[]", "True"], said.stderr
