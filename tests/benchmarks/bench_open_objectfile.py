"""How long an ObjectFile takes to open, sense by sense, in a process that has loaded its programs.

``python tests/benchmarks/bench_open_objectfile.py OBJECT ... [--repeat 5]`` prints seconds on the clock and
of CPU, the first time and the least of the others: description, mesh, and each sense with its self-test and
the check that it belongs to the surface. OBJECT is a folder, or the name of one that comes with the program.
Loading the programs is timed before; a run does both once.
"""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from harness.bench.scene_objectfile import objectfile_folder

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
    """Open, and print a table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("objects", nargs="+")
    options.add_argument("--repeat", type=int, default=5)
    given = options.parse_args()
    folders = {name: objectfile_folder(name, Path.cwd()) for name in given.objects}
    loading = timed(lambda: openers(Path()))
    table = Table("object", "what", "first, s", "CPU", "again, s", "CPU", title=_loaded(loading))
    for name, folder in folders.items():
        total = [0.0, 0.0]
        for what, opened in openers(folder).items():
            first = timed(opened)
            clock, cpu = (
                min(each) for each in zip(*(timed(opened) for _ in range(given.repeat)), strict=True)
            )
            total = [total[0] + clock, total[1] + cpu]
            table.add_row(name, what, *(f"{each:.3f}" for each in (*first, clock, cpu)))
        table.add_row(name, "all", "", "", *(f"{each:.3f}" for each in total))
    Console(width=110).print(table)


def _loaded(seconds: Seconds) -> str:
    return f"programs loaded in {seconds[0]:.2f} s, {seconds[1]:.2f} of CPU"


if __name__ == "__main__":
    main()
