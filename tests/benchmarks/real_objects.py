"""Real objects, localized over every wire: ``python tests/benchmarks/real_objects.py``.

Performs ``touchstone run contact-localization --station mock`` on five scanned or modelled
household objects, none prepared by hand, and prints a table. Stop it and start it again at will:
what ended well stays as it is, and a run that failed or was cut off is resumed.
With ``--replay`` the recordings made before are estimated again, by the estimator as it is now.

The data is found as in the tests: fetched by `make data`, or named by TOUCHSTONE_DATA.
"""

import json
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.support.real_data import WHY_NOT, find_shared_data

PROGRAM = Path(sys.executable).with_name("touchstone")
OBJECTS = {
    "mug": ("meshes/ycb_isaac/025_mug/textured.obj", "cm", "ceramic"),
    "bowl": ("meshes/ycb_ocrtoc/bowl/textured.obj", "m", "ceramic"),
    "wineglass": ("meshes/contactdb_objects/wineglass.stl", "m", "glass"),
    "teapot": ("meshes/contactdb_objects/teapot.stl", "m", "ceramic"),
    "fryingpan": ("meshes/contactdb_objects/fryingpan.stl", "m", "iron"),
}
"""File under the data folder, its units, the material."""

SEEDS = (1, 2, 3)


@dataclass(frozen=True)
class Row:
    """One run."""

    object: str  #: its name here.
    seed: int  #: of the run.
    exit: int  #: code of the program.
    error_mm: float | None  #: of the answer, None where there is none.
    symmetric_mm: float | None  #: the same, modulo the object's symmetry.
    in_region: bool | None  #: whether the stated 90 % region holds the truth.
    region_cm2: float | None  #: area of that region.
    modes: int | None  #: places that stay likely.
    seconds: float  #: of the program, planning to report; a resumed run counts from its resumption.
    said: str  #: the program's error, or its warnings.


@dataclass(frozen=True)
class Job:
    """Which run, and where it is kept."""

    object: str
    seed: int
    data: Path
    out: Path

    @property
    def folder(self) -> Path:
        """Of the recording."""
        return self.out / f"{self.object}-{self.seed}"

    @property
    def kept(self) -> Path:
        """The row of a run that ended well."""
        return self.out / f"{self.object}-{self.seed}.row.json"

    def arguments(self) -> list[str]:
        """Of the command line: a run, or the rest of one that was cut off."""
        if (self.folder / "run.json").exists():
            return ["run", "--resume", str(self.folder)]
        file, units, material = OBJECTS[self.object]
        what = ["--object", str(self.data / file), "--units", units, "--material", material]
        where = ["--seed", str(self.seed), "--out", str(self.folder)]
        return ["run", "contact-localization", "--station", "mock", "--bench", "wires", *what, *where]

    def perform(self) -> Row:
        """The row kept of an earlier start, or of a run made now."""
        if self.kept.exists():
            return Row(**json.loads(self.kept.read_text(encoding="utf-8")))
        row = self._run(self.arguments())
        if row.exit == 0:
            self.kept.write_text(json.dumps(asdict(row)), encoding="utf-8")
        return row

    def replay(self) -> Row:
        """The recording's row, estimated anew."""
        return self._run(["replay", str(self.folder)])

    def _run(self, arguments: Sequence[str]) -> Row:
        began = time.monotonic()
        ended = subprocess.run(
            [str(PROGRAM), *arguments, "--json"], capture_output=True, text=True, check=False
        )
        seconds = time.monotonic() - began
        lines = ended.stdout.splitlines()
        answer = json.loads(lines[-1]) if lines else {"error": ended.stderr[-500:]}
        return self._row(answer, ended.returncode, seconds)

    def _row(self, answer: dict[str, Any], code: int, seconds: float) -> Row:
        if "estimates" not in answer:
            nothing = (None, None, None, None, None)
            return Row(self.object, self.seed, code, *nothing, seconds, str(answer.get("error")))
        touch = answer["estimates"]["touch"]
        return Row(
            self.object,
            self.seed,
            code,
            1e3 * touch["error_m"],
            1e3 * touch["error_symmetric_m"],
            touch["in_region90"],
            1e4 * touch["region90_area_m2"],
            len(touch["modes"]),
            seconds,
            "; ".join(answer["warnings"]),
        )


def jobs(data: Path, out: Path, objects: Sequence[str], seeds: Sequence[int]) -> Iterator[Job]:
    """One seed of every object before the next."""
    return (Job(name, seed, data, out) for seed in seeds for name in objects)


def line(row: Row) -> str:
    """A row for the eye."""
    start = f"{row.object:<10} {row.seed:>4} {row.exit:>4}"
    if row.error_mm is None:
        return f"{start} {row.seconds:>44.0f}  {row.said}"
    held = "yes" if row.in_region else "NO"
    numbers = f"{row.error_mm:>9.2f} {row.symmetric_mm:>9.2f} {held:>6} {row.region_cm2:>7.2f} {row.modes:>5}"
    return f"{start} {numbers} {row.seconds:>7.0f}  {row.said}"


HEAD = "object     seed exit  error/mm  mod sym.  in 90%     cm2 modes seconds  said"


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """What the rows amount to."""
    return {
        "runs": len(rows),
        "exit_0": sum(row.exit == 0 for row in rows),
        "in_region90": sum(bool(row.in_region) for row in rows),
        "rows": [asdict(row) for row in rows],
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Perform, print; 0 where every run ended with 0."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/real-objects"), help="folder of the runs")
    parser.add_argument("--objects", nargs="+", choices=[*OBJECTS], default=[*OBJECTS])
    parser.add_argument("--seeds", nargs="+", type=int, default=SEEDS)
    parser.add_argument("--replay", action="store_true", help="estimate the recordings again, run nothing")
    parser.add_argument("--json", action="store_true", help="one JSON object instead of a table")
    asked = parser.parse_args(arguments)
    data = find_shared_data()
    if data is None:
        parser.error(WHY_NOT)
    asked.out.mkdir(parents=True, exist_ok=True)
    rows = []
    told = sys.stderr if asked.json else sys.stdout
    print(HEAD, file=told, flush=True)
    for job in jobs(data.resolve(), asked.out.resolve(), asked.objects, asked.seeds):
        rows.append(job.replay() if asked.replay else job.perform())
        print(line(rows[-1]), file=told, flush=True)
    total = summary(rows)
    if asked.json:
        print(json.dumps(total))  # noqa: T201
        return 0 if total["exit_0"] == len(rows) else 1
    cells = [(f"{r.object}, {r.seed}", r.error_mm, r.symmetric_mm, str(r.in_region), r.modes) for r in rows]
    heads = "object and seed; error [mm] .1f; modulo symmetry [mm] .1f; in the 90 % region; modes"
    finish_figure("localization", "wires", heads, cells)
    return 0 if total["exit_0"] == len(rows) else 1


if __name__ == "__main__":
    sys.exit(main())
