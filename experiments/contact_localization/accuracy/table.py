"""The localization table: many mocked runs, kept one file each, so that it stops and resumes at will."""

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.table_cell import HEARD, METHODS, Cell, run_cell
from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.metrics import Interval, bootstrap, mean, median, share_above
from harness.basics.whole_file import write_text_whole
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.objects.household import MATERIALS

GROSS = 20.0e-3
"""m: an error beyond this is a failure, counted at its full value all the same."""

REAL = {
    "025_mug": ("meshes/ycb_isaac/025_mug/textured.obj", "cm", "ceramic"),
    "wineglass": ("meshes/contactdb_objects/wineglass.stl", "m", "glass"),
    "teapot": ("meshes/contactdb_objects/teapot.stl", "m", "ceramic"),
}
"""Real meshes of the table: file under the data folder, units, material."""

PAPER_CM = {
    "random": (6.74, 12.96, 4.28, 9.39, 14.53, 14.21),
    "audio, simulated": (1.88, 0.26, 0.65, 0.23, 0.14, 0.74),
    "audio, real": (1.79, 1.16, 4.67, 1.04),
    "touch, simulated": (0.04, 0.03, 0.18, 0.04, 0.04, 0.04),
    "touch, real": (1.26, 0.78, 1.30, 0.44, 0.91, 3.82),
    "audio and touch, simulated": (0.02, 0.04, 0.09, 0.04, 0.23, 0.30),
    "audio and touch, real": (0.59, 0.36, 0.51, 0.63),
}
"""ObjectFolder 2.0, table 4: mean error in cm over six objects of theirs, 5 to 7 contacts; the last two
objects were not struck in reality."""


@dataclass(frozen=True, eq=False)
class Row:
    """One method under one condition.

    Attributes:
        spacing: of the contacts.
        gap: of the world.
        yaw: known or unknown to the estimator.
        method: which.
        runs: how many.
        raw: median, mean and share of gross errors.
        symmetric: the same, modulo the object's symmetry; None for a random point.
        held: share of runs whose 90 % region holds the truth; None where there is no region.
        seconds: median of an answer; for the six contacts together.
        refused: of the runs, how many were not answered; each counts as a random answer.
    """

    spacing: str
    gap: str
    yaw: str
    method: str
    runs: int
    raw: tuple[Interval, Interval, Interval]
    symmetric: tuple[Interval, Interval, Interval] | None
    held: float | None
    seconds: float
    refused: int = 0


def objects(data: Path | None, builtin_only: bool = False) -> dict[str, SceneFile]:
    """Scenes of the table's objects by name: ours, and the real ones where the data is there."""
    scenes = {name: scene_from_options(f"builtin:{name}") for name in MATERIALS}
    if data is None or builtin_only:
        return scenes
    real = {
        name: scene_from_options(str(data / file), material, units)
        for name, (file, units, material) in REAL.items()
    }
    return {**scenes, **real}


def measure(
    wanted: Sequence[Cell], scenes: Mapping[str, SceneFile], folder: Path, workers: int
) -> Iterator[tuple[Cell, dict[str, Any]]]:
    """Run what is not on the disk yet; yields every cell's result as it is known.

    Args:
        wanted: the runs.
        scenes: by object.
        folder: one JSON file a run.
        workers: processes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = []
    for cell in wanted:
        path = folder / f"{cell.name}.json"
        if path.exists():
            yield cell, json.loads(path.read_text(encoding="utf-8"))
        else:
            missing.append(cell)
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        running = {pool.submit(_run, cell, scenes[cell.object].model_dump(mode="json", by_alias=True)): cell
                   for cell in missing}  # fmt: skip
        try:
            for done in as_completed(running):
                cell = running[done]
                result = done.result()
                write_text_whole(folder / f"{cell.name}.json", json.dumps(result, allow_nan=False))
                yield cell, result
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _run(cell: Cell, scene: dict[str, Any]) -> dict[str, Any]:
    from harness.bench.scene import scene_from_json

    try:
        return run_cell(cell, scene_from_json(scene, "the table"), load_station(station_path("mock")))
    except TouchstoneError as error:
        # A run that cannot be planned or performed is said to be so; it is no localization.
        return {"schema": 1, "failed": f"{type(error).__name__}: {error}"}


def rows(results: Mapping[Cell, Mapping[str, Any]]) -> list[Row]:
    """The table of what has been measured so far.

    Raises:
        WrongUse: nothing has.
    """
    performed = {cell: result for cell, result in results.items() if "rows" in result}
    if not performed:
        raise WrongUse("no run of the table has been performed yet")
    conditions = sorted({(cell.spacing, cell.gap, cell.yaw) for cell in performed})
    return [
        _row(performed, condition, method)
        for condition in conditions
        for method in (*METHODS, *HEARD)
        if any(method in result["rows"] for result in performed.values())
    ]


def by_object(
    results: Mapping[Cell, Mapping[str, Any]], condition: tuple[str, str, str]
) -> dict[str, dict[str, float]]:
    """Mean error in metres of every method on every object, under one condition.

    Args:
        results: of the cells.
        condition: spacing, gap and yaw.
    """
    found: dict[str, dict[str, list[float]]] = {}
    for cell, result in results.items():
        if "rows" in result and (cell.spacing, cell.gap, cell.yaw) == condition:
            for method, row in result["rows"].items():
                found.setdefault(cell.object, {}).setdefault(method, []).append(row["error_m"])
    return {name: {m: float(np.mean(e)) for m, e in methods.items()} for name, methods in found.items()}


def _row(performed: Mapping[Cell, Mapping[str, Any]], condition: tuple[str, str, str], method: str) -> Row:
    found = [
        result["rows"][method]
        for cell, result in performed.items()
        if (cell.spacing, cell.gap, cell.yaw) == condition and method in result["rows"]
    ]
    held = [bool(one["in_region90"]) for one in found if "in_region90" in one]
    raw = np.array([one["error_m"] for one in found])
    symmetric = [one["error_symmetric_m"] for one in found]
    return Row(
        *condition,
        method,
        len(found),
        _statistics(raw),
        None if None in symmetric else _statistics(np.array(symmetric)),
        float(np.mean(held)) if held and method in ("touch", "audio", "both") else None,
        float(np.median([one["seconds"] for one in found])),
        sum("refused" in one for one in found),
    )


def _statistics(errors: FloatArray) -> tuple[Interval, Interval, Interval]:
    return bootstrap(errors, median), bootstrap(errors, mean), bootstrap(errors, share_above(GROSS))
