"""What the networks of an ObjectFile lose in scale estimation, beside the simulation.

``python tests/benchmarks/scale/bench_scale_by_networks.py OBJECT ... [--seeds 4] [--first-seed 0]``
performs runs on the mocked bench in process, gap ``unplaced``, looked at first, and answers each from the
same readings with modes of finite elements and with those of the sound network, by sound alone and by all
senses together. OBJECT is the folder of an ObjectFile, or the name of one that comes with the program. Errors
of the longest side in mm, a refused answer counted as the middle of the range; whether the 90 % interval
holds; seconds.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from experiments.scale_estimation.answer import KNOBS, ScaleAnswering
from experiments.scale_estimation.cells import ScaleCell
from experiments.scale_estimation.size import Belief
from harness.basics.errors import FitRefused
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.sound import SHAPES
from harness.experiment.in_process import open_run
from harness.experiment.levels import chosen_levels
from harness.experiment.lookup import find_experiment
from harness.experiment.truth import read_truth
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

LEVELS = ("elements", "network")


@dataclass(frozen=True)
class AnsweredSize:
    """One run, answered at one level of the sound's shapes."""

    level: str  #: one of ``LEVELS``.
    sense: str  #: ``"audio"`` or ``"fused"``.
    error: float  #: m.
    inside: bool  #: whether the truth is in the interval of 90 %.
    seconds: float  #: of all senses' answers.


def answered(cell: ScaleCell, scene: SceneFile, station: Station) -> Iterator[AnsweredSize]:
    """A run at both levels."""
    here = cell.create_scene(scene)
    with open_run(find_experiment("scale-estimation"), cell, here, station) as run:
        recording = run.recording
        truth = read_truth(recording)
        assert truth is not None, "no instrument read anything in this run"
        size = float(truth.differences["longest_side_m"])
        for level in LEVELS:
            answering = ScaleAnswering(run, chosen_levels(KNOBS, (), {SHAPES.name: level}))
            for record in recording.steps():
                answering.read(record)
            found = answering.answer()
            audio = found.by_sense.get("audio")
            if audio is None or isinstance(audio, FitRefused):
                alone = Belief.ignorant(answering.model.sizes)
            else:
                alone = audio.belief
            for sense, belief in (("audio", alone), ("fused", found.fused)):
                low, high = belief.interval
                inside, seconds = low <= size <= high, sum(found.seconds.values())
                yield AnsweredSize(level, sense, abs(belief.size - size), inside, seconds)


def finish_objects(rows: dict[str, list[AnsweredSize]]) -> None:
    """Print or write by object and sense: elements / network."""
    table: list[tuple[Cell, ...]] = []
    for name, of in {**rows, "all": [row for each in rows.values() for row in each]}.items():
        for sense in ("audio", "fused"):
            parts = [[row for row in of if (row.level, row.sense) == (level, sense)] for level in LEVELS]
            errors = [[1e3 * row.error for row in part] for part in parts]
            means = [float(np.mean(each)) for each in errors]
            listed = " / ".join(", ".join(f"{error:.2f}" for error in each) for each in errors)
            cells = (
                f"{name}, {sense}",
                len(parts[0]),
                None if name == "all" else listed,
                " / ".join(f"{mean:.2f}" for mean in means),
                means[1] / means[0],
                " / ".join(f"{sum(row.inside for row in part)}" for part in parts),
                " / ".join(f"{np.mean([row.seconds for row in part]):.2f}" for part in parts),
            )
            table.append(cells)
    heads = "object and sense: elements / network; runs; errors [mm]; mean [mm]; ratio of means .2f"
    finish_figure("objectfile", "scale", f"{heads}; in the interval; time [s]", table)


def main() -> None:
    """Perform, answer, and print a table."""
    options = benchmark_parser(__doc__)
    options.add_argument("objects", nargs="+")
    options.add_argument("--seeds", type=int, default=4)
    options.add_argument("--first-seed", type=int, default=0)
    given = options.parse_args()
    station, rows = load_station(station_path("mock")), dict[str, list[AnsweredSize]]()
    for folder in given.objects:
        scene = scene_from_options(folder)
        for seed in range(given.first_seed, given.first_seed + given.seeds):
            cell = ScaleCell(scene.object.name, "unplaced", seed, "yes")
            rows.setdefault(cell.object, []).extend(answered(cell, scene, station))
            Console(stderr=True).print(f"{cell.name} answered")
    finish_objects(rows)


if __name__ == "__main__":
    main()
