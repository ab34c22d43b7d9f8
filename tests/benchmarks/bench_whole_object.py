"""A whole object, from its mesh to ``audio.onnx``: what each stage costs, and what the network is worth.

``PYTHONPATH=. python tests/benchmarks/bench_whole_object.py [object ...] [--profile smoke] [--out FILE]``
builds the built-in objects and, where the real data is found, the three real meshes of
``harness.experiment.subjects``, one at a time, each into a temporary folder and with an
empty cache. Each finished object is appended as a line of JSON to ``--out``, and what stands there is not
built again, so that a stopped run resumes. Two tables: seconds of the clock and of the processor by stage;
and errors at held-out vertices beside both baselines and the float16 table at its own nodes, with a mean and
a worst row of each. ``--finer 2`` makes elements half as long as the default: unknowns grow with the square
of it on walls and with the cube in solids. Machine code must have been made before: build anything once.
"""

import json
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from harness.authoring.audio.object_audio import MODES, STAGES, AudioRequest, build_audio
from harness.authoring.audio.profiles import PROFILES
from harness.basics.materials import material
from harness.basics.store import Store
from harness.experiment.subjects import REAL
from harness.objects.builtin import BUILTIN
from harness.objects.household import MATERIALS
from harness.sim.modal.modal import default_edge
from harness.sim.modal.solve import cpu, wall
from harness.sim.solid.intake import surface_of
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.real_data import WHY_NOT, find_shared_data

WAYS = ("network", "nearest_trained", "linear", "table_float16")
ERRORS = {
    "size [MB]": ("bytes", 1e-6),
    "time of a vertex [us]": ("seconds_per_vertex", 1e6),
    "gain error, median [%]": ("gain_error_median", 1e2),
    "gain error, 95th percentile [%]": ("gain_error_p95", 1e2),
    "STFT distance [1e-5]": ("stft_distance", 1e5),
    "envelope distance [1e-4]": ("envelope_distance", 1e4),
    "gain error [dB]": ("spectral_error_db", 1.0),
}
"""Heading: key of the errors that ``measure_audio`` returns, and the factor to the heading's unit."""


def list_errors(errors: Mapping[str, float]) -> list[float]:
    """List the errors in the order of ``ERRORS``; NaN where one is missing."""
    return [errors.get(key, float("nan")) * scale for key, scale in ERRORS.values()]


def requests(data: Path | None, profile: str, modes: int) -> dict[str, AudioRequest]:
    """What can be built, by name."""
    asked = {
        name: AudioRequest(f"{BUILTIN}{name}", material(of), profile, most=modes)
        for name, of in MATERIALS.items()
    }
    for name, (file, units, of) in REAL.items() if data is not None else ():
        asked[name] = AudioRequest(str(Path(data or "") / file), material(of), profile, units, most=modes)
    return asked


def built(name: str, asked: AudioRequest, finer: float) -> dict[str, Any]:
    """Build one, and say all that is known of it."""
    if finer != 1.0:
        surface = surface_of(asked.mesh, asked.units, asked.wall).mesh
        asked = replace(asked, edge=default_edge(surface, asked.material, asked.limit, asked.most) / finer)
    with tempfile.TemporaryDirectory(prefix="touchstone-whole-") as folder:
        begun, worked = time.perf_counter(), time.process_time()
        store = Store(Path(folder) / "cache")
        made = build_audio(asked, Path(folder) / name, store, lambda _doing, _share: None)
        took = time.perf_counter() - begun, time.process_time() - worked
    return {
        "object": name,
        "profile": asked.profile,
        "asked": asked.most,
        "finer": finer,
        "modes": len(made.modes.frequencies),
        "up_to_hz": made.modes.limit,
        "unknowns": 3 * made.modes.nodes,
        "held_out": len(made.audio.split.held_out),
        "wall_s": took[0],
        "cpu_s": took[1],
        "seconds": wall(made.seconds),
        "cpu_seconds": cpu(made.seconds),
        "errors": {way: dict(errors) for way, errors in made.audio.errors.items()},
    }


def kept(file: Path, names: Sequence[str], chosen: tuple[str, int, float]) -> dict[str, dict[str, Any]]:
    """The rows of the file that were asked for, the last of each object."""
    lines = file.read_text().splitlines() if file.exists() else []
    rows = [json.loads(line) for line in lines if line.strip()]
    return {
        row["object"]: row
        for row in rows
        if row["object"] in names and (row["profile"], row["asked"], row["finer"]) == chosen
    }


def finish_seconds(rows: Sequence[dict[str, Any]]) -> None:
    """Print wall and CPU seconds of each stage."""
    heads = "; ".join(("object", "unknowns", "modes", *STAGES, "all, wall / CPU [s]"))
    cells: list[list[Cell]] = []
    for row in rows:
        spent = [f"{row['seconds'][stage]:.1f} / {row['cpu_seconds'][stage]:.1f}" for stage in STAGES]
        whole = f"{row['wall_s']:.0f} / {row['cpu_s']:.0f}"
        cells.append([row["object"], row["unknowns"], row["modes"], *spent, whole])
    finish_figure("audionet", "seconds of each stage", heads, cells)


def finish_errors(rows: Sequence[dict[str, Any]]) -> None:
    """Print or write errors at held-out vertices by object, then their mean and worst."""
    cells: list[list[Cell]] = []
    for way in WAYS:
        cells += [[f"{row['object']}, {way}", row["cpu_s"], *list_errors(row["errors"][way])] for row in rows]
        for name, over in (("mean", np.nanmean), ("worst", np.nanmax)):
            cells.append([f"{name}, {way}", None, *(_of(over, column) for column in columns(rows, way))])
    heads = ("object, gains from", "mesh to verified file [CPU s] .0f", *ERRORS)
    finish_figure("audionet", "objects", "; ".join(heads), cells)


def columns(rows: Sequence[dict[str, Any]], way: str) -> Iterator[list[float]]:
    """The numbers of every object, column by column."""
    yield from (
        list(column) for column in zip(*(list_errors(row["errors"][way]) for row in rows), strict=True)
    )


def _of(over: Any, numbers: Sequence[float]) -> float:
    return float(over(numbers)) if not np.isnan(numbers).all() else float("nan")


def main() -> None:
    """Build what is not there yet; print all that was asked for."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("objects", nargs="*")
    parser.add_argument("--profile", default="standard", choices=list(PROFILES))
    parser.add_argument("--modes", type=int, default=MODES)
    parser.add_argument("--finer", type=float, default=1.0)
    parser.add_argument("--out", type=Path, default=Path("whole_objects.jsonl"))
    asked = parser.parse_args()
    console, data = Console(), find_shared_data()
    known = requests(data, asked.profile, asked.modes)
    names = asked.objects or list(known)
    missing = [name for name in names if name not in known]
    if missing:
        parser.error(f"no object {', '.join(missing)}; there are {', '.join(known)} ({data or WHY_NOT})")
    done = kept(asked.out, names, (asked.profile, asked.modes, asked.finer))
    for name in names:
        if name not in done:
            done[name] = built(name, known[name], asked.finer)
            with asked.out.open("a") as file:
                file.write(json.dumps(done[name]) + "\n")
            console.print(f"{name}: {done[name]['wall_s']:.0f} s, to {asked.out}")
    rows = [done[name] for name in names]
    finish_seconds(rows)
    finish_errors(rows)


if __name__ == "__main__":
    main()
