"""The ObjectFile's network, its table and finite elements are levels of one quantity: the modes."""

import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest

from harness.authoring.audio.audio import author_audio
from harness.authoring.audio.data import canonical
from harness.authoring.audio.profiles import profile
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, Facts, knobs_of
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.explain import as_json, scene_plan
from harness.effects.plan import plan
from harness.effects.quantities import Quantities
from harness.effects.scene_object import known_file
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.audio.part import AudioPart, with_audio
from harness.objectfile.audio.sound_level import modes_from
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.surface_search import SurfaceSearch
from harness.sim.modal import modal
from harness.sim.modal.modal import default_edge, from_arrays
from harness.sim.modal.modes import Modes, dampings
from tests.samples.object_bench import PROVENANCE, egg

PLASTIC = MATERIALS["plastic"]
MOST = 32
LEVELS = ("network", "table")


def scene_of(folder: Path | None, sound: bool = True) -> SceneFile:
    named = None if folder is None else str(folder)
    scene = scene_from_options("builtin:mug", "plastic", objectfile=named)
    return scene.model_copy(update={"sensors": Sensors(sound=sound)})


def evaluated(scene: SceneFile, sources: Quantities, level: str, most: int = MOST) -> Evaluation:
    accuracy = Accuracy(knobs_of(EFFECTS), {"sound.shapes": level, "sound.modes": most})
    return evaluate(plan(EFFECTS, Facts(scene, GELSIGHT_R15), ["object.modes"], accuracy), sources)


def sources_of(mesh: Mesh, more: Quantities | None = None) -> Quantities:
    return {"object_mesh": mesh, "object_wall": None, "object_material": PLASTIC, **(more or {})}


def modes_at(of: ObjectFile, level: str, most: int = MOST, given: Quantities | None = None) -> Modes:
    sources = sources_of(egg(), {"object_file": of, **(given or {})})
    return from_arrays(evaluated(scene_of(of.folder), sources, level, most).values["object_modes"])


@pytest.fixture(scope="module")
def solved() -> Modes:
    """Of a ball of plastic that is none, by finite elements."""
    return from_arrays(evaluated(scene_of(None), sources_of(egg()), "elements").values["object_modes"])


@pytest.fixture(scope="module")
def of(solved: Modes, tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Its ObjectFile, made of that solution, as `object build` does."""
    folder, modes = tmp_path_factory.mktemp("objects") / "egg", canonical(solved)
    rates = dampings(modes.frequencies, PLASTIC)
    made = author_audio(modes, rates, profile("smoke"), 0, lambda _what, _share: None)
    part = AudioPart(
        modes=modes,
        dampings=rates,
        near_surface=0.02 * egg().diagonal,
        provenance=PROVENANCE,
        graph=made.graph,
        measured={"network": made.errors["network"], "table": made.errors["table_float16"]},
    )
    return with_audio(create_object(folder, "egg", egg(), PLASTIC, PROVENANCE), part)


@pytest.mark.parametrize("level", LEVELS)
def test_frequencies_are_those_of_the_elements(of: ObjectFile, solved: Modes, level: str) -> None:
    modes = modes_at(of, level)
    np.testing.assert_allclose(modes.frequencies, solved.frequencies, rtol=1e-5)
    assert (modes.rigid, modes.mass, modes.nodes) == (solved.rigid, solved.mass, solved.nodes)
    assert modes.seconds.keys() == {"objectfile"}


@pytest.mark.parametrize("level", LEVELS)
def test_shapes_err_as_the_objectfile_says_where_none_was_trained(
    of: ObjectFile, solved: Modes, level: str
) -> None:
    points, _ = SurfaceSearch(egg()).spread(400, seed=3)
    truth, found = canonical(solved).at(points), modes_at(of, level).at(points)
    errors = np.linalg.norm(found - truth, axis=(1, 2)) / np.linalg.norm(truth, axis=(1, 2))
    audio = of.description.audio
    assert audio is not None
    entry = audio.network if level == "network" else audio.table
    assert entry is not None
    assert 0.0 < np.median(errors) <= 1.5 * entry.measured["gain_error_median"]
    assert np.quantile(errors, 0.95) <= 1.5 * entry.measured["gain_error_p95"]


def test_the_network_is_asked_at_the_nodes_of_the_elements(of: ObjectFile, solved: Modes) -> None:
    modes = modes_at(of, "network")
    np.testing.assert_array_equal(modes.points, solved.points)
    np.testing.assert_array_equal(modes.faces, solved.faces)
    found = open_audio(of, "network").at(solved.points)[:, : len(modes.frequencies)]
    np.testing.assert_allclose(modes.shapes, found, rtol=0.0, atol=1e-6 * np.abs(found).max())


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("most", [16, 32])
def test_the_number_of_modes_is_the_knobs(of: ObjectFile, solved: Modes, level: str, most: int) -> None:
    modes = modes_at(of, level, most)
    assert most - 4 <= len(modes.frequencies) <= most
    np.testing.assert_allclose(modes.frequencies, solved.frequencies[: len(modes.frequencies)], rtol=1e-5)
    assert modes.shapes.shape == (len(modes.points), len(modes.frequencies), 3)
    assert modes.limit >= modes.frequencies[-1]
    if len(modes.frequencies) < len(solved.frequencies):
        apart = solved.frequencies[len(modes.frequencies)] / modes.frequencies[-1] - 1.0
        assert apart > 4e-5  # no two of one frequency were parted
        assert modes.limit < solved.frequencies[len(modes.frequencies)]


def test_an_objectfile_of_fewer_modes_than_asked_for_is_refused(of: ObjectFile) -> None:
    with pytest.raises(WrongUse, match=r"3\d modes.* 128 .*20000 Hz.*--modes 128"):
        modes_at(of, "network", 128)


@pytest.mark.parametrize(("level", "solutions"), [("network", 0), ("table", 0), ("elements", 1)])
def test_nothing_is_meshed_or_solved_but_for_the_elements(
    of: ObjectFile, solved: Modes, monkeypatch: pytest.MonkeyPatch, level: str, solutions: int
) -> None:
    calls: Counter[str] = Counter()

    def found(*_given: Any) -> Modes:
        calls["modes_of"] += 1
        return solved

    def never(*_given: Any, **_named: Any) -> Any:
        raise AssertionError("meshed or solved")

    monkeypatch.setattr("harness.effects.sound.modes_of", found)
    monkeypatch.setattr(modal, "filled", never)
    monkeypatch.setattr(modal, "solve_mesh", never)
    modes_at(of, level)
    assert calls["modes_of"] == solutions


def test_elements_ask_for_no_objectfile_even_where_there_is_one(of: ObjectFile) -> None:
    accuracy = Accuracy(knobs_of(EFFECTS), {})
    made = plan(EFFECTS, Facts(scene_of(of.folder), GELSIGHT_R15), ["object.modes"], accuracy)
    assert made.sources == ("object.mesh", "object.wall", "object.material")


@pytest.mark.parametrize("level", LEVELS)
def test_without_an_objectfile_its_levels_are_refused(level: str) -> None:
    with pytest.raises(WrongUse, match=rf"sound\.shapes = {level}: .*ObjectFile .*elements"):
        evaluated(scene_of(None), sources_of(egg()), level)


@pytest.mark.parametrize(
    ("level", "why"),
    [
        ("network", "sound.shapes is network, and the scene names an ObjectFile"),
        ("elements", "sensors.sound is true; sound.shapes is elements, its default"),
    ],
)
def test_explain_says_which_level_runs_and_why(of: ObjectFile, level: str, why: str) -> None:
    accuracy = Accuracy(knobs_of(EFFECTS), {"sound.shapes": level})
    told = as_json(scene_plan(scene_of(of.folder), GELSIGHT_R15, accuracy))
    step = next(step for step in told["ran"] if step["effect"] == "object.modes")
    assert step["reason"].endswith(why)
    edge = {} if level == "network" else {"sound.edge": 0.35}
    assert step["levels"] == {"sound.shapes": level, **edge, "sound.modes": 128}


def scaled(factor: float) -> Mesh:
    middle = egg().bounds.mean(axis=0)
    return Mesh(middle + factor * (egg().vertices - middle), egg().faces)


def dented() -> Mesh:
    """Of the same box."""
    moved = egg().vertices.copy()
    moved[np.argmax(moved @ [1.0, 1.0, 1.0])] -= 5e-3
    return Mesh(moved, egg().faces)


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (Mesh(egg().vertices * 1e3, egg().faces), "x .* mm.* x 80000"),
        (
            Mesh(egg().vertices + np.array([0.0, 0.0, 1e-3]), egg().faces),
            r"x .* z 0\.00 to 100\.00 mm",
        ),
        (dented(), r"surfaces .*\d(\.\d+)? mm"),
        (scaled(1.0005), r" cm\^3"),
    ],
    ids=["millimetres", "moved", "dented", "grown"],
)
def test_another_object_is_refused_and_said(of: ObjectFile, mesh: Mesh, said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        modes_at(of, "table", given={"object_mesh": mesh})
    with pytest.raises(WrongUse, match=said):
        known_file(scene_of(of.folder), mesh)


def test_the_same_surface_cut_otherwise_is_the_same_object(of: ObjectFile) -> None:
    corners, count = egg().corners, len(egg().vertices)
    middles = np.arange(count, count + len(corners))
    a, b, c = egg().faces.T
    cut = np.concatenate(
        [np.stack(each, axis=1) for each in ((a, b, middles), (b, c, middles), (c, a, middles))]
    )
    again = Mesh(np.concatenate([egg().vertices, corners.mean(axis=1)]), cut)
    assert known_file(scene_of(of.folder), again) is not None
    assert known_file(scene_of(None), again) is None


@pytest.mark.parametrize("constant", ["density", "young", "poisson", "alpha", "beta"])
def test_another_material_is_refused_by_the_constant_that_differs(of: ObjectFile, constant: str) -> None:
    other = replace(PLASTIC, **{constant: 1.01 * vars(PLASTIC)[constant]})
    with pytest.raises(WrongUse, match=f"{constant} .*plastic"):
        modes_at(of, "table", given={"object_material": other})


def test_a_network_that_was_changed_is_refused(of: ObjectFile, tmp_path: Path) -> None:
    shutil.copytree(of.folder, tmp_path / "egg")
    data = bytearray((tmp_path / "egg" / "audio.onnx").read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "egg" / "audio.onnx").write_bytes(data)
    changed = ObjectFile.open(tmp_path / "egg")
    with pytest.raises(DataRefused, match="sha256"):
        modes_at(changed, "network")
    assert len(modes_at(changed, "table").frequencies) > 0


def test_what_was_stored_of_one_objectfile_is_not_served_for_another(
    of: ObjectFile, solved: Modes, tmp_path: Path
) -> None:
    probe = Effect("probe", lambda object_modes: object_modes["shapes"][:1], stored=True)
    effects, store = (*EFFECTS, probe), Store(tmp_path / "store")

    def calls(file: ObjectFile, level: str) -> int:
        accuracy = Accuracy(knobs_of(effects), {"sound.shapes": level, "sound.modes": MOST})
        chosen = plan(effects, Facts(scene_of(file.folder), GELSIGHT_R15), ["probe"], accuracy)
        return evaluate(chosen, sources_of(egg(), {"object_file": file}), store).calls.get("probe", 0)

    shutil.copytree(of.folder, tmp_path / "elsewhere")
    modes = canonical(solved)
    other = create_object(tmp_path / "other", "egg", egg(), PLASTIC, PROVENANCE)
    part = AudioPart(
        replace(modes, shapes=-modes.shapes), dampings(modes.frequencies, PLASTIC), 2e-3, PROVENANCE, None
    )
    assert [calls(of, "table"), calls(of, "table"), calls(of, "network")] == [1, 0, 1]
    assert calls(ObjectFile.open(tmp_path / "elsewhere"), "table") == 0
    assert calls(with_audio(other, part), "table") == 1


def test_a_network_alone_is_evaluated_on_faces_as_short_as_elements(of: ObjectFile, tmp_path: Path) -> None:
    """Of a mesh of long faces; a table, which it would need else, is not there."""
    audio, coarse = of.description.audio, egg(subdivisions=1)
    assert audio is not None
    assert audio.network is not None
    made = create_object(tmp_path / "coarse", "egg", coarse, PLASTIC, PROVENANCE)
    graph = onnx.load_model_from_string(of.read(audio.network))
    rates, near = np.array(audio.dampings_per_s), 0.1 * coarse.diagonal
    alone = with_audio(
        made, AudioPart(open_audio(of).as_modes(), rates, near, PROVENANCE, graph, table=False)
    )
    found = modes_from(alone, "network", coarse, PLASTIC, 16, 20e3)
    corners = found.points[found.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    assert longest <= default_edge(coarse, PLASTIC, audio.frequencies_hz[-1])
    assert len(found.points) > len(coarse.vertices)
    wanted = open_audio(alone).at(found.points)[:, : len(found.frequencies)]
    np.testing.assert_array_equal(found.shapes, wanted)


_LOADING = """
import sys
from pathlib import Path
from harness.effects.explain import scene_plan
from harness.recording.run_folder import RunFiles
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.catalogue import EFFECTS
from harness.effects.scene_object import known_object
scene = scene_from_options("builtin:mug", "plastic", objectfile=sys.argv[1])
known_object(scene)
assert "object.file" not in scene_plan(scene, GELSIGHT_R15).sources
assert "harness.objectfile.audio.audio" not in sys.modules
for level in ("table", "network"):
    assert not {"onnx", "onnxruntime"} & sys.modules.keys(), "before " + level
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.audio.sound_level import modes_from
    of = ObjectFile.open(Path(sys.argv[1]))
    modes_from(of, level, of.mesh, of.material, 16, 20e3)
print("onnxruntime" in sys.modules)
"""


@pytest.mark.slow  # loads in a process of its own
def test_networks_are_loaded_by_their_own_level_alone(of: ObjectFile) -> None:
    said = subprocess.run(
        [sys.executable, "-c", _LOADING, str(of.folder)], capture_output=True, text=True, check=False
    )
    assert said.stdout.strip() == "True", said.stderr
