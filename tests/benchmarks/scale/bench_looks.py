"""One look at each of the table's objects: sized by its shape, by its outline alone, by the outline's box.

Run as ``PYTHONPATH=. python tests/benchmarks/scale/bench_looks.py [--seeds 10] [--first-seed 2000]
[--gap unplaced]``; a second a look. The real meshes are fetched by `make data`, or named by TOUCHSTONE_DATA.
"""

from contextlib import suppress

import numpy as np

from experiments.paper.scale_table import by_box
from experiments.scale_estimation.answer import KNOBS, ScaleAnswering
from experiments.scale_estimation.cells import ScaleCell
from experiments.scale_estimation.size import Belief
from harness.basics.errors import FitRefused
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.accuracy import Accuracy
from harness.experiment.in_process import open_run
from harness.experiment.lookup import find_experiment
from harness.experiment.subjects import objects
from harness.experiment.truth import read_truth
from harness.picture.outline import SeenOutline
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.real_data import find_shared_data

METHODS = ("shape known", "shape unknown", "box")
Row = dict[str, tuple[float, bool]]
"""Error in cm by method, and whether the interval holds the truth."""


def main() -> None:
    parser = benchmark_parser(__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=2000)
    parser.add_argument("--gap", default="unplaced")
    asked = parser.parse_args()
    station, rows, table = load_station(station_path("mock")), list[Row](), list[list[Cell]]()
    for name, scene in objects(find_shared_data()).items():
        cells = [ScaleCell(name, asked.gap, asked.first_seed + seed, "yes") for seed in range(asked.seeds)]
        mine = [look(cell, scene, station) for cell in cells]
        rows += mine
        table.append([name, *summarize(mine)])
    table.append([f"all, gap {asked.gap}", *summarize(rows)])
    parts = (f"{method}: answered; median [cm] .2f; mean [cm] .2f; held [%] .0f" for method in METHODS)
    finish_figure("scale", "gaps", "; ".join(("object", *parts)), table)


def look(cell: ScaleCell, scene: SceneFile, station: Station) -> Row:
    """Perform one and answer it three ways."""
    tree = cell.create_scene(scene).model_dump(mode="json", by_alias=True)
    tree["scale"]["contacts"] = 0
    tree["sensors"].update(sound=False, touch=False)
    looks = scene_from_json(tree, cell.name)
    with open_run(find_experiment("scale-estimation"), cell, looks, station) as run:
        recording = run.recording
        answering = ScaleAnswering(run, Accuracy.default(KNOBS))
        for record in recording.steps():
            answering.read(record)
        truth = read_truth(recording)
        assert truth is not None
        true = float(truth.differences["longest_side_m"])
        if not isinstance(answering.outline, SeenOutline):
            return {}
        row: Row = {}
        with suppress(FitRefused):
            row["shape unknown"] = scored(answering.without_shape()["vision"]().belief, true)
        row["box"] = (1e2 * abs(by_box(answering.outline, answering.model.view) - true), False)
        sight = answering.answer().sight
        return row if sight is None else {**row, "shape known": scored(sight.belief, true)}


def scored(belief: Belief, true: float) -> tuple[float, bool]:
    low, high = belief.interval
    return 1e2 * abs(belief.size - true), bool(low <= true <= high)


def summarize(rows: list[Row]) -> list[Cell]:
    """Summarize the errors of each method; the outline's box states no interval."""
    cells: list[Cell] = []
    for method in METHODS:
        found = [row[method] for row in rows if method in row]
        errors, held = np.array([error for error, _ in found]), np.mean([inside for _, inside in found])
        if not found:
            cells += [0, None, None, None]
            continue
        claim = None if method == "box" else 100.0 * float(held)
        cells += [len(found), float(np.median(errors)), float(errors.mean()), claim]
    return cells


if __name__ == "__main__":
    main()
