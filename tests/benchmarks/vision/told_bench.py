"""What each error of the bench costs the answer: the estimator is told one of them, and errs by so much less.

Run as ``PYTHONPATH=. python tests/benchmarks/vision/told_bench.py [--seeds 4] [--spacing spread] [--senses
both]``. Runs of development seeds are performed on the mocked bench in process; the arm's poses are then
corrected by what only the mocked world knows, and the same readings answered again. Errors in mm, means over
the runs: as they are, and modulo the object's symmetry. What is left when all is told is the shape's
deviation, the images' and the estimator's own. Nothing of this can be told on a real bench.
"""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.accuracy.run import ContactRun
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.baselines import without_images
from experiments.contact_localization.posterior.estimate import SPACING, Senses
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.basics.symmetry import find_symmetries
from harness.bench.gap import load_gap
from harness.bench.station_file import load_station, station_path
from harness.experiment.in_process import RunCell
from harness.experiment.measuring import perform_cells, workers_of
from harness.experiment.subjects import objects
from mocks.world.gap_draw import GapDraw
from tests.support.localization import conditions, dials, estimate

TOLD: Mapping[str, frozenset[str]] = {
    "nothing": frozenset(),
    "yaw": frozenset({"yaw"}),
    "tilt": frozenset({"tilt"}),
    "yaw and tilt": frozenset({"yaw", "tilt"}),
    "scale": frozenset({"scale"}),
    "gel's centre": frozenset({"gel"}),
    "arm's errors": frozenset({"arm"}),
    "all of these": frozenset({"yaw", "tilt", "scale", "gel", "arm"}),
}
SENSES: Mapping[str, Senses] = {"touch": "touch", "audio": "audio", "both": "both"}
UP = np.array([0.0, 0.0, 1.0])


def main() -> None:
    """Perform, answer and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--spacing", default="spread", choices=("close", "spread"))
    parser.add_argument("--senses", default="both", choices=tuple(SENSES))
    parser.add_argument("--data", type=Path, help="folder of the real meshes; built-in objects alone without")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    scenes, measured = objects(given.data), ContactMeasurement(EXPERIMENT)
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    chosen = conditions(given.spacing, sense="both")
    wanted, station = measured.cells(list(scenes), seeds, chosen), load_station(station_path("mock"))
    with (
        workers_of(given.workers) as pool,
        perform_cells(EXPERIMENT.name, wanted, scenes, station, pool, _say) as runs,
    ):
        scored = [
            _score(cell, measured.solver(files, cell), SENSES[given.senses]) for cell, files in runs.items()
        ]
    table = Table(
        "told", "mm", "modulo symmetry", title=f"{len(scored)} runs, {given.spacing}, {given.senses}"
    )
    for name in scored[0]:
        row = np.mean([errors[name] for errors in scored], axis=0)
        table.add_row(name, *(f"{1e3 * error:.2f}" for error in row))
    Console(width=100).print(table)


def _say(line: str) -> None:
    sys.stderr.write(line + "\n")


def _score(cell: RunCell, run: ContactRun, senses: Senses) -> dict[str, tuple[float, float]]:
    """Metres, and metres modulo symmetry, by what is told; then what geometry alone makes of the poses."""
    model, draw = run.models.at({}), GapDraw(load_gap(cell.gap), cell.seed)
    symmetry, true = find_symmetries(model.mesh), run.true
    assert true is not None

    def off(point: FloatArray) -> tuple[float, float]:
        return float(np.linalg.norm(point - true)), float(symmetry.distance(point, true))

    levels, found = dials(senses=senses), {}
    for name, what in TOLD.items():
        observations = [
            replace(one, base_from_gel=_corrected(one.base_from_gel, draw, k, what))
            for k, one in enumerate(run.observations)
        ]
        answer = estimate(observations, model, run.prior, levels, seed=cell.seed)
        found[name] = off(answer.position_in_object)
    poses = [one.base_from_gel for one in run.observations]
    alone = without_images(poses, model, run.prior, levels.of(SPACING), use_axis=True)
    return {**found, "geometry + axis, told nothing": off(alone)}


def _corrected(base_from_gel: FloatArray, draw: GapDraw, step: int, told: frozenset[str]) -> FloatArray:
    """The pose that the arm would have reported had these errors not been."""
    pose, run = base_from_gel.copy(), draw.run
    if "arm" in told:
        pose[:3, 3] += draw.contact(step).arm_error
    if "gel" in told:
        pose[:3, 3] = (pose @ run.gel_from_true_gel)[:3, 3]
    yaw = rotation_about(UP, run.yaw)
    tilt = run.object_rotation @ yaw.T
    for name, turn in (("tilt", tilt), ("yaw", yaw)):
        if name in told:
            pose[:3, :3], pose[:3, 3] = turn.T @ pose[:3, :3], turn.T @ pose[:3, 3]
    if "scale" in told:
        pose[:3, 3] /= run.scale
    return pose


if __name__ == "__main__":
    main()
