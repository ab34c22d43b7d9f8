"""How often a budget is kept and an error met, and how far the choice is from the best there was.

Run as ``python tests/benchmarks/budget_kept.py`` after ``touchstone cost contact-localization``. Runs on
the built-in objects, of seeds that the curve has not seen, are performed in process. Each is asked for
every budget and error as ``touchstone run`` asks, and then answered at every setting that was measured,
so that the best there was is found by trying all. One file a run is kept in ``--out``: what is stopped
resumes there. What is judged:

- a budget: in how many runs it was kept, on the clock. The error, as a mean over the runs with none
  counted beyond 20 mm, beside the least such mean of any one setting that keeps the budget in 19 of 20
  of the same runs. Runs that would have been refused before anything moved are counted apart.
- an error: in how many of the runs it was promised to it was met. The seconds, as a mean over all runs,
  beside those of the cheapest one setting whose error is met in 19 of 20 of them.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.answer import ESTIMATOR, PROGRAM
from experiments.contact_localization.experiment import EXPERIMENT
from harness.basics.whole_file import write_text_whole
from harness.bench.station_file import load_station, station_path
from harness.cost.choice import for_budget
from harness.cost.curve import GROSS, Curve
from harness.cost.file import curve_path, load, sample_json
from harness.cost.provenance import code, machine, stale
from harness.effects.accuracy import Level
from harness.experiment.budget import ask
from harness.experiment.costing import measure_sample
from harness.experiment.front import Front, front_of
from harness.experiment.in_process import RunCell
from harness.experiment.measuring import measurement_of, perform_cells, workers_of
from harness.experiment.solving import Solver, Target
from harness.experiment.subjects import objects
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell as Entry
from tests.support.localization import conditions

SHARE = 0.95
CONTACTS = 6
BUDGETS = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 1.0, 2.0)
ERRORS = (2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3)

Record = Mapping[str, Any]


def say(line: str) -> None:
    """A line on standard output, at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def main() -> None:
    """Measure what is missing, then judge."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--spacing", action="append", choices=("close", "spread"))
    parser.add_argument("--yaw", default="known", choices=("known", "unknown"))
    parser.add_argument("--sense", default="both", choices=("touch", "both"))
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=4000)
    parser.add_argument("--only", action="append")
    parser.add_argument("--workers", type=int, default=2, help="processes that perform runs")
    parser.add_argument("--curve", type=Path, help="this machine's own if left out")
    parser.add_argument("--out", type=Path, default=Path("runs/cost/budget_kept"))
    given = parser.parse_args()
    curve = load(given.curve or curve_path(PROGRAM))
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    names = given.only or list(objects(None))
    rows: list[list[Entry]] = []
    for spacing in given.spacing or ("close", "spread"):
        chosen = conditions(spacing, yaws=[given.yaw], sense=given.sense)
        wanted = measurement_of(EXPERIMENT).cells(names, seeds, chosen)
        records = measured(wanted, curve, given.out, given.workers)
        if not records:
            say(f"{spacing}: no run could be performed")
            continue
        for number, judge in ((len(BUDGETS), judged_budget), (len(ERRORS), judged_error)):
            rows += [
                [f"{spacing}, {cell}", *rest] for cell, *rest in (judge(records, k) for k in range(number))
            ]
    heads = "condition and request; kept or met; of; refused before or not promised"
    more = "mean error in mm or CPU time in s; best single setting; ratio to it .2f"
    finish_figure("localization", "budget", f"{heads}; {more}", rows)


def measured(wanted: Sequence[RunCell], curve: Curve, folder: Path, workers: int) -> list[Record]:
    """A record of each run that can be performed, from the disk where it was made before."""
    reasons = stale(curve, machine(), code(ESTIMATOR))
    if reasons:
        say(f"the curve is stale, so its seconds are scaled and its errors are of other code: {reasons}")
    folder.mkdir(parents=True, exist_ok=True)
    stamp = {"machine": machine(), "sha256": code(ESTIMATOR)["sha256"], "curve": curve.made}
    known = {cell: _kept(folder / f"{cell.name}.json", stamp) for cell in wanted}
    scenes, station = objects(None), load_station(station_path("mock"))
    measured = measurement_of(EXPERIMENT)
    missing = [cell for cell, record in known.items() if record is None]
    with (
        workers_of(workers if missing else 1) as pool,
        perform_cells(PROGRAM, missing, scenes, station, pool, say) as runs,
    ):
        for number, (cell, files) in enumerate(runs.items(), start=1):
            run = measured.solver(files, cell).first(CONTACTS)
            record = {**stamp, **_record(cell, run, _front(curve, cell, run, reasons))}
            write_text_whole(folder / f"{cell.name}.json", json.dumps(record, allow_nan=False))
            known[cell] = record
            say(f"{cell.name}: run {number} of {len(runs)}")
    return [record for record in known.values() if record is not None]


def _kept(path: Path, stamp: Mapping[str, Any]) -> Record | None:
    if not path.exists():
        return None
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return record if all(record.get(name) == value for name, value in stamp.items()) else None


def _front(curve: Curve, cell: RunCell, run: Solver, reasons: Sequence[str]) -> Front:
    conditions = cell.conditions
    wanted: dict[str, Level] = {
        **{name: conditions[name] for name in ("spacing", "gap", "yaw")},
        "contacts": CONTACTS,
    }
    return front_of(EXPERIMENT, curve, wanted, reasons, shipped=False).fitting(run.explain_refusal)


def _record(cell: RunCell, run: Solver, front: Front) -> dict[str, Any]:
    """One run: as asked for each budget and error, and at every setting."""
    tried = {point.name: sample_json(measure_sample(cell, run, point.levels)) for point in front.points}
    budgets = [_answer(run, front, Target(seconds=budget)) for budget in BUDGETS]
    errors = [_answer(run, front, Target(error=error)) for error in ERRORS]
    return {"object": run.object, "budgets": budgets, "errors": errors, "tried": tried}


def _answer(run: Solver, front: Front, target: Target) -> dict[str, Any]:
    refused = target.seconds is not None and not _is_accepted(run, front, target.seconds)
    found = ask(run, front, target)
    return {
        "asked": target.seconds if target.seconds is not None else target.error,
        "refused_before": refused,
        "setting": found.point.name,
        "tried": len(found.tried),
        "kept": found.kept,
        "wall_s": found.seconds,
        "cpu_s": found.cpu,
        "error_m": found.solved.error,
    }


def _is_accepted(run: Solver, front: Front, seconds: float) -> bool:
    return for_budget(front.points, seconds, run.object, front.scale).fits


@dataclass(frozen=True)
class Tried:
    """One fixed setting on some runs: errors in m and seconds, ``(runs,)`` each."""

    name: str
    errors: Sequence[float]
    seconds: Sequence[float]


def tried_on(records: Sequence[Record]) -> list[Tried]:
    """Every setting on all of these runs."""
    found = []
    for name in records[0]["tried"]:
        samples = [record["tried"][name] for record in records]
        seconds = [sample["shared_cpu_s"] + sample["cpu_s"] for sample in samples]
        found.append(Tried(name, [sample["error_m"] for sample in samples], seconds))
    return found


def judged_budget(records: Sequence[Record], index: int) -> list[Entry]:
    """Judge a budget: runs that kept it, the mean error, and the best setting's."""
    budget = BUDGETS[index]
    taken = [record for record in records if not record["budgets"][index]["refused_before"]]
    refused = len(records) - len(taken)
    name = f"budget {budget:g} s"
    if not taken:
        return [name, 0, 0, refused, None, None, None]
    ours = [record["budgets"][index] for record in taken]
    kept = sum(answer["wall_s"] <= budget for answer in ours)
    errors = [answer["error_m"] for answer in ours]
    fixed = [t for t in tried_on(taken) if np.mean([s <= budget for s in t.seconds]) >= SHARE]
    cells: list[Entry] = [name, kept, len(ours), refused, 1e3 * capped(errors)]
    if not fixed:
        return [*cells, "none keeps it in 19 of 20", None]
    best = min(fixed, key=lambda t: capped(t.errors))
    return [*cells, best.name, capped(errors) / capped(best.errors)]


def judged_error(records: Sequence[Record], index: int) -> list[Entry]:
    """Judge an error: runs that were promised it and met it, the seconds, and the cheapest setting's."""
    wanted = ERRORS[index]
    ours = [record["errors"][index] for record in records]
    promised = [answer for answer in ours if answer["kept"]]
    met = sum(answer["error_m"] <= wanted for answer in promised)
    seconds = geometric([answer["cpu_s"] for answer in ours])
    fixed = [t for t in tried_on(records) if np.mean([e <= wanted for e in t.errors]) >= SHARE]
    cells: list[Entry] = [
        f"error {1e3 * wanted:g} mm",
        met,
        len(promised),
        len(ours) - len(promised),
        seconds,
    ]
    if not fixed:
        return [*cells, "none meets it in 19 of 20", None]
    best = min(fixed, key=lambda t: geometric(t.seconds))
    return [*cells, best.name, seconds / geometric(best.seconds)]


def geometric(values: Sequence[float]) -> float:
    """Geometric mean of seconds."""
    return float(np.exp(np.mean(np.log(values))))


def capped(errors: Sequence[float]) -> float:
    """Mean of errors in m, none counted beyond what is gross."""
    return float(np.mean(np.minimum(errors, GROSS)))


if __name__ == "__main__":
    main()
