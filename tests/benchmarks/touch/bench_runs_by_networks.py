"""What an ObjectFile's networks cost and lose in contact localization, beside the simulation.

``python tests/benchmarks/touch/bench_runs_by_networks.py FOLDER [--seeds 12] [--first-seed 0]`` performs
runs with close and with spread contacts on the mocked bench in process, yaw known, gap on, and answers each
by touch, by sound and by both: with the simulation, with both networks, and with the touch network alone.
Errors in mm, a refused answer counted as a random one; seconds of CPU from readings to answer, the least of
three.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from experiments.contact_localization.accuracy.benchmark_runs import Case, cells, perform
from experiments.contact_localization.accuracy.dials import needs_images
from experiments.contact_localization.accuracy.solving import Models, prepare, solve
from experiments.contact_localization.posterior.dials import SENSES
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.accuracy import Level, Setting
from harness.effects.sound_effects import SHAPES as SOUND
from harness.effects.touch_file_effects import SHAPES as TOUCH

LEVELS: Mapping[str, Setting] = {
    "reference": {TOUCH.name: "reference", SOUND.name: "elements"},
    "networks": {TOUCH.name: "network", SOUND.name: "network"},
    "touch network": {TOUCH.name: "network", SOUND.name: "elements"},
}
_REPEATS = 3


@dataclass(frozen=True)
class AnsweredRun:
    """One run, answered at one choice of levels by one sense.

    Attributes:
        spacing: of its contacts.
        levels: a key of ``LEVELS``.
        sense: that answered.
        error: m, of the last contact.
        inside: whether the truth is in the region of 90 %.
        seconds: of CPU, of readings and answer.
    """

    spacing: str
    levels: str
    sense: str
    error: float
    inside: bool
    seconds: float


def answered(case: Case) -> Iterator[AnsweredRun]:
    """A run at every choice of levels, by every sense."""
    for name, levels in LEVELS.items():
        for sense in SENSES.levels:
            setting: dict[str, Level] = {**levels, SENSES.name: sense}
            readings = case.readings(setting)
            prepare(readings.model, setting)
            every = [solve(readings, setting) for _ in range(_REPEATS)]
            found = every[0].found
            inside = found is not None and bool(found.region.contains(case.true_points[-1]))
            read = readings.shared[0] if needs_images(setting) else 0.0
            seconds = read + min(each.cpu for each in every)
            error = case.error_of(every[0], case.steps)
            yield AnsweredRun(case.cell.spacing, name, sense, error, inside, seconds)


def main() -> None:
    """Perform, answer, and print a table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder")
    options.add_argument("--seeds", type=int, default=12)
    options.add_argument("--first-seed", type=int, default=0)
    asked = options.parse_args()
    scene, station = scene_from_options(asked.folder), load_station(station_path("mock"))
    models: dict[str, Models] = {}
    seeds = range(asked.first_seed, asked.first_seed + asked.seeds)
    rows: list[AnsweredRun] = []
    console = Console()
    for cell in cells([scene.object.name], seeds, ["close", "spread"], ["default"], ["known"], sound=True):
        rows += answered(perform(cell, scene, station, models))
        console.print(f"{cell.name} answered")
    console.print(table_of(rows))


def table_of(rows: list[AnsweredRun]) -> Table:
    """Median, mean and worst of errors, regions that hold, and the mean of seconds."""
    table = Table("spacing", "sense", "levels", "runs", "median", "mean", "worst, mm", "in region", "CPU s")
    for spacing in ("close", "spread"):
        for sense in SENSES.levels:
            for levels in LEVELS:
                found = [
                    row for row in rows if (row.spacing, row.sense, row.levels) == (spacing, sense, levels)
                ]
                errors = 1e3 * np.array([row.error for row in found])
                numbers = (np.median(errors), errors.mean(), errors.max())
                inside, seconds = sum(row.inside for row in found), np.mean([row.seconds for row in found])
                said = [f"{number:.2f}" for number in numbers]
                table.add_row(spacing, sense, levels, f"{len(found)}", *said, f"{inside}", f"{seconds:.2f}")
    return table


if __name__ == "__main__":
    main()
