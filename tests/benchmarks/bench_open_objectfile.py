"""How long an ObjectFile takes to open, sense by sense, in a process that has loaded its programs.

``python tests/benchmarks/bench_open_objectfile.py OBJECT ... [--repeat 5]`` prints seconds on the clock and
of CPU, the first time and the least of the others: description, mesh, and each sense with its self-test and
the check that it belongs to the surface. OBJECT is a folder, or the name of one that comes with the program.
Loading the programs is timed before; a run does both once.
"""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness.bench.scene_objectfile import objectfile_folder
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

Seconds = tuple[float, float]
"""On the clock, and of CPU."""


def timed(work: Callable[[], Any]) -> Seconds:
    """Seconds that a call takes."""
    clock, cpu = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - clock, time.process_time() - cpu


def openers(folder: Path) -> dict[str, Callable[[], Any]]:
    """What a run opens, each from the disk anew."""
    from harness.objectfile.audio.audio import open_audio
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.touch.tool_depth import open_tool_depth
    from harness.objectfile.vision.render import open_vision

    return {
        "description and mesh": lambda: ObjectFile.open(folder).mesh,
        "audio": lambda: open_audio(ObjectFile.open(folder)),
        "touch": lambda: open_tool_depth(ObjectFile.open(folder)),
        "vision": lambda: open_vision(ObjectFile.open(folder), threads=1),
    }


def main() -> None:
    """Open, and print or write a table."""
    options = benchmark_parser(__doc__)
    options.add_argument("objects", nargs="+")
    options.add_argument("--repeat", type=int, default=5)
    given = options.parse_args()
    folders = {name: objectfile_folder(name, Path.cwd()) for name in given.objects}
    loading = timed(lambda: openers(Path()))
    rows: list[tuple[Cell, ...]] = [("programs, once", *loading, None, None)]
    for name, folder in folders.items():
        total = [0.0, 0.0]
        for what, opened in openers(folder).items():
            first = timed(opened)
            clock, cpu = (
                min(each) for each in zip(*(timed(opened) for _ in range(given.repeat)), strict=True)
            )
            total = [total[0] + clock, total[1] + cpu]
            rows.append((f"{name}, {what}", *first, clock, cpu))
        rows.append((f"{name}, all", None, None, *total))
    heads = "opened; first [wall s] .2f; first [CPU s] .2f; again [wall s] .2f; again [CPU s] .2f"
    finish_figure("objectfile", "opening", heads, rows)


if __name__ == "__main__":
    main()
