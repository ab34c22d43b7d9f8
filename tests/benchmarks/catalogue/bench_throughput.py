"""Objects an hour against workers, growth with the number of objects, and a second build of a thousand rows.

``PYTHONPATH=. python tests/benchmarks/catalogue/bench_throughput.py [--objects 30] [--senses touch]`` builds
procedural objects in the smallest profile by one worker and by two, half and a quarter of them by one, and a
thousand rows that share a mesh twice. It needs both cores: say what else ran.
"""

import json
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))

from tests.benchmarks.catalogue.drawn_catalogue import answer, write_catalogue
from tests.benchmarks.results import benchmark_parser, finish_figure

ROWS = 1000


def main() -> None:
    """Build, and print or write the figure."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("--objects", type=int, default=30)
    parser.add_argument("--senses", default="touch")
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="catalogue-"))
    more = ("--senses", arguments.senses, "--edge", "15mm", "--modes", "12")
    load = os.getloadavg()
    answer(write_catalogue(folder / "first", 1), folder / "warm", *more)  # loads machine code
    counts = [arguments.objects // 4, arguments.objects // 2, arguments.objects]
    alone = {count: seconds(folder, count, 1, more) for count in counts}
    pair = seconds(folder, arguments.objects, 2, more)
    slope, start = np.polyfit(counts, [alone[count] for count in counts], 1)
    own = {count: object_seconds(folder / f"out-{count}-1") for count in counts}
    whole, rows = alone[arguments.objects], thousand(folder)
    finish_figure(
        "catalogue",
        "throughput",
        f"quantity, profile smoke, {arguments.senses}, load {load[0]:.1f}; value .3g",
        [
            ("objects per hour, one worker", 3600 * arguments.objects / whole),
            ("objects per hour, two workers", 3600 * arguments.objects / pair),
            ("efficiency of two workers", whole / (2 * pair)),
            (f"growth exponent, {', '.join(map(str, counts))} objects", exponent(own)),
            ("the same with the program's start", exponent(alone)),
            ("the program's start [s]", float(start)),
            (
                "projected wall time of 1,000 objects, two workers [h]",
                float(1000 * slope / 3600 * pair / whole),
            ),
            (f"first build of {ROWS:,} rows of one mesh [s]", rows["first"]),
            (f"second build of {ROWS:,} unchanged rows [s]", rows["second"]),
        ],
    )
    shutil.rmtree(folder)


def exponent(took: dict[int, float]) -> float:
    """Of the number of objects, with which seconds grow."""
    return float(np.polyfit(np.log(list(took)), np.log(list(took.values())), 1)[0])


def object_seconds(out: Path) -> float:
    """S that the objects of a build took, without the program's and the workers' start."""
    records = (out / "records").glob("*.json")
    return float(sum(json.loads(path.read_text())["seconds"] for path in records))


def seconds(folder: Path, count: int, workers: int, more: tuple[str, ...]) -> float:
    """S on the clock of a whole build, the program's start included."""
    catalogue = write_catalogue(folder / f"{count}", count)
    begun = time.perf_counter()
    answer(catalogue, folder / f"out-{count}-{workers}", *more, "--workers", str(workers))
    return time.perf_counter() - begun


def thousand(folder: Path) -> dict[str, float]:
    """A thousand rows of one mesh, each with its own name: composed, and then found standing."""
    catalogue = write_catalogue(folder / "thousand", 1)
    mesh = next((folder / "thousand").glob("*.stl"))
    rows = [f"object_{number},wood,m,{mesh.name}" for number in range(ROWS)]
    catalogue.write_text("\n".join(["name,material,units,mesh", *rows]) + "\n")
    took = {}
    for name in ("first", "second"):
        begun = time.perf_counter()
        found = answer(catalogue, folder / "out-thousand", "--senses", "touch")
        took[name] = time.perf_counter() - begun
    assert found["standing"] == ROWS
    return took


if __name__ == "__main__":
    main()
