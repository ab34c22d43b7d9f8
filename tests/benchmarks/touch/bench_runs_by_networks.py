"""What an ObjectFile's networks cost and lose in contact localization, beside the simulation.

``python tests/benchmarks/touch/bench_runs_by_networks.py OBJECT ... [--seeds 12] [--first-seed 0]
[--rows FILE]`` performs runs with close and with spread contacts on the mocked bench in process, yaw known,
gap on, and answers each by touch, by sound and by both: with the simulation and with the networks. OBJECT is
the folder of an ObjectFile, or the name of one that comes with the program. Errors in mm, a refused answer
counted as a random one; seconds of CPU from readings to answer, the least of three. With ``--rows`` every
answer is appended to a file of JSON lines, and a run that lies in it is not performed again: a table that was
stopped goes on, and ``--seeds 0`` prints what there is.
"""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.accuracy.run import ContactRun
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.estimate import SENSES
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.accuracy import Level, Setting
from harness.effects.sound import SHAPES as SOUND
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.in_process import RunCell, open_run
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.localization import conditions

LEVELS: Mapping[str, Setting] = {
    "simulation": {TOUCH.name: "reference", SOUND.name: "elements"},
    "networks": {TOUCH.name: "network", SOUND.name: "network"},
}
SPACINGS = ("close", "spread")
_REPEATS = 3


@dataclass(frozen=True)
class AnsweredRun:
    """One run, answered at one choice of levels by one sense."""

    object: str  #: its name.
    seed: int  #: of the run.
    spacing: str  #: of its contacts.
    levels: str  #: a key of ``LEVELS``.
    sense: str  #: that answered.
    error: float  #: m, of the last contact.
    inside: bool  #: whether the truth is in the region of 90 %.
    seconds: float  #: of CPU, of readings and answer.


def answer_run(cell: RunCell, run: ContactRun) -> Iterator[AnsweredRun]:
    """A run at every choice of levels, by every sense."""
    true, spacing = run.true, cell.conditions["spacing"]
    assert true is not None
    for name, levels in LEVELS.items():
        for sense in SENSES.levels:
            setting: dict[str, Level] = {**levels, SENSES.name: sense}
            read, _ = run.read(setting)
            every = [run.solve(setting) for _ in range(_REPEATS)]
            found, error = every[0].found, every[0].error
            assert error is not None
            inside = found is not None and bool(found.region.contains(true))
            seconds = read + min(each.cpu for each in every)
            yield AnsweredRun(cell.object, cell.seed, spacing, name, str(sense), error, inside, seconds)


def answered_objects(named: Sequence[str], seeds: range, rows: Path | None) -> list[AnsweredRun]:
    """Every run of every object, and those that a file holds already."""
    console, station = Console(stderr=True), load_station(station_path("mock"))
    found = [] if rows is None else rows_of(rows)
    there = {(row.object, row.seed, row.spacing) for row in found}
    for folder in named:
        scene, measured = scene_from_options(folder), ContactMeasurement(EXPERIMENT)
        for cell in measured.cells([scene.object.name], seeds, conditions(*SPACINGS, sense="both")):
            if (cell.object, cell.seed, cell.conditions["spacing"]) not in there:
                with open_run(EXPERIMENT, cell, cell.create_scene(scene), station) as files:
                    new = list(answer_run(cell, measured.solver(files, cell)))
                found += new
                _append(rows, new)
                console.print(f"{cell.name} answered")
    return found


def rows_of(path: Path) -> list[AnsweredRun]:
    """What a file of JSON lines holds; nothing where there is none yet."""
    if not path.exists():
        return []
    return [AnsweredRun(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def _append(path: Path | None, new: Iterable[AnsweredRun]) -> None:
    if path is not None:
        with path.open("a", encoding="utf-8") as stream:
            stream.writelines(f"{json.dumps(asdict(row))}\n" for row in new)


def finish_objects(rows: list[AnsweredRun]) -> None:
    """Print or write, for every object and for all: errors, regions that hold and mean seconds."""
    table = []
    objects = list(dict.fromkeys(row.object for row in rows))
    for name in (*objects, "all"):
        for sense in SENSES.levels:
            of = [row for row in rows if name in (row.object, "all") and row.sense == sense]
            if of:
                table.append([f"{name}, {sense}", *_cells(of)])
    heads = "object and sense: simulation / networks; runs; median [mm]; mean [mm]; ratio of means .2f"
    finish_figure("objectfile", "localization", f"{heads}; in the region; time [CPU s]", table)


def _cells(rows: list[AnsweredRun]) -> list[Cell]:
    """Of one sense: simulation / networks."""
    parts = [[row for row in rows if row.levels == levels] for levels in LEVELS]
    errors = [1e3 * np.array([row.error for row in part]) for part in parts]
    means = [float(each.mean()) for each in errors]
    return [
        f"{len(parts[0])}",
        " / ".join(f"{np.median(each):.2f}" for each in errors),
        " / ".join(f"{mean:.2f}" for mean in means),
        f"{means[1] / means[0]:.2f}",
        " / ".join(f"{sum(row.inside for row in part)}" for part in parts),
        " / ".join(f"{np.mean([row.seconds for row in part]):.2f}" for part in parts),
    ]


def main() -> None:
    """Perform, answer, and print a table."""
    options = benchmark_parser(__doc__)
    options.add_argument("objects", nargs="+")
    options.add_argument("--seeds", type=int, default=12)
    options.add_argument("--first-seed", type=int, default=0)
    options.add_argument("--rows", type=Path)
    given = options.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    finish_objects(answered_objects(given.objects, seeds, given.rows))


if __name__ == "__main__":
    main()
