"""What the levels of ``sound.shapes`` cost: an object's modes from its ObjectFile, and by finite elements.

``python tests/benchmarks/sound/bench_sound_shapes.py [object] [--objectfile FOLDER] [--repeat 3]`` prints
for each level process seconds, apart the first, when libraries are loaded, and how far its modes are from
those of a fresh solution. fTetWild fills a surface otherwise every time, so that a second fresh solution
stands
beside: no level can be nearer than that. Without a folder an ObjectFile is built, and its seconds said.
"""

import tempfile
import time
from itertools import combinations
from pathlib import Path

import numpy as np
from rich.console import Console
from threadpoolctl import threadpool_limits

from harness.authoring.audio.object_audio import AudioRequest, build_audio
from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS, material
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Facts, knobs_of
from harness.effects.evaluate import evaluate
from harness.effects.plan import plan
from harness.effects.quantities import Quantities
from harness.effects.scene_object import known_file, known_object
from harness.objectfile.surface_search import SurfaceSearch
from harness.objects.household import MATERIALS as MADE_OF
from harness.sim.modal.modal import from_arrays
from harness.sim.modal.modes import Modes
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.docs.results import Cell

PLACES = 400
_READINGS = 21
NEAR = 0.03
"""Relative: modes of frequencies nearer than this may be mixed by another meshing."""


def main() -> None:
    """Print one table."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("object", nargs="?", default="mug", choices=list(MADE_OF))
    parser.add_argument("--objectfile", type=Path)
    parser.add_argument("--repeat", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        scene = _scene(asked.object, asked.objectfile or _built(asked.object, Path(folder) / asked.object))
        _print(scene, asked.repeat)


def _built(name: str, out: Path) -> Path:
    wanted = AudioRequest(f"builtin:{name}", material(MADE_OF[name]))
    begun = time.process_time()
    build_audio(wanted, out, None, lambda _doing, _share: None)
    Console().print(f"built once: {time.process_time() - begun:.1f} s of CPU")
    return out


def _scene(name: str, folder: Path) -> SceneFile:
    scene = scene_from_options(f"builtin:{name}", objectfile=str(folder))
    return scene.model_copy(update={"sensors": Sensors(sound=True)})


def _print(scene: SceneFile, repeat: int) -> None:
    mesh = known_object(scene).mesh
    of = known_file(scene, mesh)
    assert of is not None
    sources: Quantities = {
        "object_mesh": mesh,
        "object_wall": None,
        "object_material": MATERIALS[scene.object.material],
        "object_file": of,
    }
    found = {level: _taken(scene, sources, level, _READINGS) for level in ("table", "network")}
    seconds, modes = _taken(scene, sources, "elements", repeat - 1)
    with tempfile.TemporaryDirectory() as folder:
        stored = _taken(scene, sources, "elements", _READINGS, Store(Path(folder)))
    found["elements"] = [*seconds, stored[0][0]], [*modes, stored[1][0]]
    found["elements, kept"] = stored[0][1:], stored[1][1:]
    fresh = found["elements"][1]
    heads = "modes from; first [CPU s] .3f; again: median (extremes) [CPU s] .3f; frequency, largest [%]"
    rows = []
    for level, (seconds, modes) in found.items():
        solved = level.startswith("elements")
        pairs = list(combinations(fresh, 2)) if solved else [(modes[-1], each) for each in fresh]
        again = spread(seconds[1:]) if len(seconds) > 1 else None
        rows.append([f"{scene.object.name}, {level}", seconds[0], again, *_differences(pairs, mesh)])
    finish_figure("objectfile", "modes", f"{heads}; shape, median [%]; shape, 95th percentile [%]", rows)


def _taken(
    scene: SceneFile, sources: Quantities, level: str, times: int, store: Store | None = None
) -> tuple[list[float], list[Modes]]:
    chosen = plan(
        EFFECTS,
        Facts(scene, GELSIGHT_R15),
        ["object.modes"],
        Accuracy(knobs_of(EFFECTS), {"sound.shapes": level}),
    )
    seconds, modes = [], []
    for _ in range(times):
        begun = time.process_time()
        modes.append(from_arrays(evaluate(chosen, sources, store).values["object_modes"]))
        seconds.append(time.process_time() - begun)
    return seconds, modes


def _differences(pairs: list[tuple[Modes, Modes]], mesh: Mesh) -> tuple[Cell, Cell, Cell]:
    if not pairs:
        return None, None, None
    points, _ = SurfaceSearch(mesh).spread(PLACES, seed=7)
    frequencies, shapes = [], []
    for one, other in pairs:
        count = min(len(one.frequencies), len(other.frequencies))
        frequencies.append(np.abs(one.frequencies[:count] / other.frequencies[:count] - 1.0).max())
        shapes.append(_unexplained(one, other, points))
    every = np.concatenate(shapes)
    middle, high = np.median(every), np.quantile(every, 0.95)
    return 1e2 * float(max(frequencies)), 1e2 * float(middle), 1e2 * float(high)


def _unexplained(one: Modes, other: Modes, points: FloatArray) -> FloatArray:
    """``(m,)``: of each mode of ``other``, what no mixture of one's modes of about its frequency explains."""
    a, b = (modes.at(points).transpose(0, 2, 1).reshape(3 * len(points), -1) for modes in (one, other))
    left = []
    for frequency, shape in zip(other.frequencies, b.T, strict=True):
        near = a[:, np.abs(one.frequencies / frequency - 1.0) < NEAR]
        mixture = np.linalg.lstsq(near, shape, rcond=None)[0]
        left.append(np.linalg.norm(near @ mixture - shape) / np.linalg.norm(shape))
    return np.array(left)


if __name__ == "__main__":
    main()
