"""How often a budget is kept and an error met, and how far the choice is from the best there was.

Run as ``python tests/benchmarks/budget_kept.py --spacing spread --seeds 4``. Runs on the built-in
objects are performed in process and answered at every setting (kept in ``--out``, so a stopped
measurement resumes). Then, for each run in turn, the curve of all *other* runs chooses for it:
what is chosen has never seen the run it is judged by. The best there was is the one fixed setting
that does best on the very runs it is judged by. Seconds are of CPU time.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from experiments.contact_localization.costing import Work, gathered, measure
from experiments.contact_localization.dials import (
    BLOCK,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    SPACING,
    settings,
)
from experiments.contact_localization.table import objects
from experiments.contact_localization.table_cell import cells
from harness.accuracy import Level
from harness.cost import LEAST_ERROR, Point, Sample
from harness.cost_choice import for_budget, for_error, promised
from harness.cost_file import save
from harness.station_file import load_station, station_path

SHARE = 0.95


def _grid(spacing: float, rounds: int, samples: int, block: int) -> dict[str, Level]:
    dials = {SPACING.name: spacing, ROUNDS.name: rounds, SAMPLES.name: samples, BLOCK.name: block}
    return {METHOD.name: "grid", **dials}


def _particles(spacing: float, number: int, block: int) -> dict[str, Level]:
    return {METHOD.name: "particle", SPACING.name: spacing, PARTICLES.name: number, BLOCK.name: block}


QUICK = (
    _particles(4e-3, 300, 16),
    _particles(2e-3, 1000, 8),
    _grid(4e-3, 0, 600, 16),
    _grid(4e-3, 0, 600, 8),
    _grid(2e-3, 0, 600, 8),
    _grid(4e-3, 3, 600, 8),
    _grid(2e-3, 3, 600, 16),
    _grid(2e-3, 1, 600, 8),
    _grid(2e-3, 3, 600, 8),
    _grid(1.5e-3, 3, 1200, 8),
)


def say(line: str) -> None:
    """A line on standard output, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Measure what is missing, then judge."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--spacing", default="spread", choices=("close", "spread"))
    parser.add_argument("--yaw", default="known", choices=("known", "unknown"))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=3000)
    parser.add_argument("--only", action="append")
    parser.add_argument("--quick", action="store_true", help="ten settings that span the range")
    parser.add_argument("--curve", type=Path, help="write the curve of all runs here too")
    parser.add_argument("--out", type=Path, default=Path("runs/cost/budget_kept"))
    given = parser.parse_args()
    scenes = objects(None)
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    wanted = cells(given.only or list(scenes), seeds, [given.spacing], ["default"], [given.yaw])
    tried = list(QUICK) if given.quick else settings()
    work = Work(tuple(wanted), tuple(tried), (6,))
    found: list[tuple[str, Point]] = []
    for cell, points in measure(work, scenes, load_station(station_path("mock")), given.out, say):
        say(f"{cell.name}: {len(points)} answers")
        found += [(cell.name, point) for point in points]
    if given.curve is not None:
        save(gathered([point for _, point in found], "What a contact's place costs"), given.curve)
    folds = []
    for run in dict.fromkeys(name for name, _ in found):
        known = [point for name, point in found if name != run]
        held = [point for name, point in found if name == run]
        folds.append((gathered(known, "known").points, gathered(held, "held out").points))
    say(f"{given.spacing}, yaw {given.yaw}, {sum(len(held[0].samples) for _, held in folds)} runs held out")
    for budget in (0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0):
        say(judged_budget(folds, budget))
    for error in (2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3):
        say(judged_error(folds, error))


Folds = Sequence[tuple[Sequence[Point], Sequence[Point]]]


def judged_budget(folds: Folds, budget: float) -> str:
    """One line: runs, share kept, typical error, and the best setting's."""
    taken: list[Sample] = []
    refused = 0
    for known, held in folds:
        for run in held[0].samples:
            choice = for_budget(known, budget, run.object, 1.0, run.shared)
            if choice.fits:
                taken.append(_sample(held, choice.point.name, run.run))
            else:
                refused += 1
    if not taken:
        return f"budget {budget:g} s: refused in all {refused} runs"
    kept = np.mean([s.shared + s.cpu <= budget for s in taken])
    ours = _typical([s.error for s in taken])
    best = _best_error(folds, budget, {s.run for s in taken})
    beside = (
        "none keeps it" if best is None else f"{1e3 * best[0]:.2f} mm ({best[1]}), ratio {ours / best[0]:.2f}"
    )
    return (
        f"budget {budget:g} s: kept in {100 * kept:.0f} % of {len(taken)} runs ({refused} refused before); "
        f"error {1e3 * ours:.2f} mm; best fixed setting {beside}"
    )


def judged_error(folds: Folds, error: float) -> str:
    """One line: runs, share promised, share met of those, seconds, and the cheapest setting's."""
    seconds, met, not_promised, names = [], [], 0, set()
    for known, held in folds:
        for run in held[0].samples:
            spent = run.shared
            for point in for_error(known, error, run.object):
                sample = _sample(held, point.name, run.run)
                spent += sample.cpu
                promise = float("inf") if sample.radius is None else promised(point, sample.radius)
                if promise <= error:
                    break
            if promise > error:
                not_promised += 1
                continue
            met.append(sample.error <= error)
            seconds.append(spent)
            names.add(run.run)
    if not met:
        return f"error {1e3 * error:g} mm: promised in none of {not_promised} runs"
    ours = _typical(seconds)
    best = _best_seconds(folds, error, names)
    beside = "none meets it" if best is None else f"{best[0]:.3f} s ({best[1]}), ratio {ours / best[0]:.2f}"
    return (
        f"error {1e3 * error:g} mm: met in {100 * np.mean(met):.0f} % of {len(met)} promised runs "
        f"({not_promised} not promised); {ours:.3f} s; cheapest fixed setting {beside}"
    )


def _best_error(folds: Folds, budget: float, runs: set[str]) -> tuple[float, str] | None:
    found = []
    for name, samples in _by_setting(folds, runs).items():
        if np.mean([s.shared + s.cpu <= budget for s in samples]) >= SHARE:
            found.append((_typical([s.error for s in samples]), name))
    return min(found, default=None)


def _best_seconds(folds: Folds, error: float, runs: set[str]) -> tuple[float, str] | None:
    found = []
    for name, samples in _by_setting(folds, runs).items():
        if np.mean([s.error <= error for s in samples]) >= SHARE:
            found.append((_typical([s.shared + s.cpu for s in samples]), name))
    return min(found, default=None)


def _by_setting(folds: Folds, runs: set[str]) -> dict[str, list[Sample]]:
    found: dict[str, list[Sample]] = {}
    for _, held in folds:
        for point in held:
            found.setdefault(point.name, []).extend(s for s in point.samples if s.run in runs)
    return found


def _sample(points: Sequence[Point], name: str, run: str) -> Sample:
    return next(s for p in points if p.name == name for s in p.samples if s.run == run)


def _typical(values: Sequence[float]) -> float:
    return float(np.exp(np.mean(np.log(np.maximum(values, LEAST_ERROR)))))


if __name__ == "__main__":
    main()
