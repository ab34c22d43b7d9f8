"""Sizes of known shapes on unseen meshes: how often the 90 % intervals hold, and on which side they miss.

Run as ``PYTHONPATH=. python tests/benchmarks/scale/bench_known_sizes.py --recordings FOLDER``: one look and
ten contacts of each mesh and seed, 10 s a run; the recordings are kept and answered again by the next call.
The meshes are read from the folder that TOUCHSTONE_DATA names; `make data` lacks the drill.
"""

from collections import defaultdict
from pathlib import Path

import numpy as np

from experiments.scale_estimation.answer import KNOBS, ScaleAnswering
from experiments.scale_estimation.cells import ScaleCell
from experiments.scale_estimation.size import Belief
from harness.basics.errors import FitRefused
from harness.bench.scene import SceneFile, scene_from_json, scene_from_options
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.accuracy import Accuracy
from harness.experiment.in_process import open_run
from harness.experiment.lookup import find_experiment
from harness.experiment.truth import read_truth
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.real_data import find_shared_data

MESHES = {
    "lightbulb": ("contactdb_objects/lightbulb.stl", "glass"),
    "fryingpan": ("contactdb_objects/fryingpan.stl", "steel"),
    "scissors": ("ycb_ocrtoc/scissors/textured.obj", "steel"),
    "drill": ("ycb_sim/035_power_drill/035_power_drill.obj", "plastic"),
    "coffeemug": ("contactdb_objects/coffeemug.stl", "ceramic"),
    "hammer": ("contactdb_objects/hammer.stl", "steel"),
}
"""Meshes in metres below the data folder, and a material."""

Row = tuple[float, float, float]
"""Median, low and high end of the interval: logarithm over the true size, in %."""


def main() -> None:
    parser = benchmark_parser(__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=3000)
    parser.add_argument("--recordings", type=Path, default=None)
    options = parser.parse_args()
    data, station = find_shared_data(), load_station(station_path("mock"))
    if data is None:
        raise SystemExit("the shared meshes are absent; set TOUCHSTONE_DATA to the folder that holds them")
    rows: dict[str, list[Row]] = defaultdict(list)
    for seed in range(options.first_seed, options.first_seed + options.seeds):
        for name, (file, material) in MESHES.items():
            scene = scene_from_options(str(data / "meshes" / file), material, "m")
            found = answer_run(ScaleCell(name, "unplaced", seed, "yes"), scene, station, options.recordings)
            for sense, row in found.items():
                rows[sense].append(row)
    cells = [count_rows(sense, found) for sense, found in rows.items()]
    heads = "sense; held; intervals; too small; too large; mean error [%] .2f; mean absolute error [%] .2f"
    finish_figure("scale", "unseen", heads, cells)


def answer_run(
    cell: ScaleCell, scene: SceneFile, station: Station, recordings: Path | None
) -> dict[str, Row]:
    """Perform one run, or read its recording, and answer it by each sense and by all.

    Args:
        cell: mesh, gap and seed.
        scene: scene of the mesh.
        station: mocked bench.
        recordings: folder of the recordings; None to keep none.
    """
    tree = cell.create_scene(scene).model_dump(mode="json", by_alias=True)
    tree["sensors"].update(sound=False)
    silent = scene_from_json(tree, cell.name)
    experiment = find_experiment("scale-estimation")
    with open_run(experiment, cell, silent, station, recordings) as run:
        recording = run.recording
        answering = ScaleAnswering(run, Accuracy.default(KNOBS))
        for record in recording.steps():
            answering.read(record)
        truth = read_truth(recording)
        assert truth is not None
        true = float(truth.differences["longest_side_m"])
        answer = answering.answer()
        found = {
            sense: compare_with(one.belief, true)
            for sense, one in answer.by_sense.items()
            if not isinstance(one, FitRefused)
        }
        return {**found, "fused": compare_with(answer.fused, true)}


def compare_with(belief: Belief, true: float) -> Row:
    """Express the median and the interval of a density relative to the true size in m."""
    median, low, high = 100.0 * np.log(np.array([belief.size, *belief.interval]) / true)
    return float(median), float(low), float(high)


def count_rows(sense: str, rows: list[Row]) -> list[Cell]:
    """Count the intervals that hold, and the misses on each side."""
    medians, lows, highs = np.array(rows).T
    small, large = int((highs < 0.0).sum()), int((lows > 0.0).sum())
    errors = float(medians.mean()), float(np.abs(medians).mean())
    return [sense, len(rows) - small - large, len(rows), small, large, *errors]


if __name__ == "__main__":
    main()
