"""Every time asked of the renderer, beside what it takes, in one run.

``PYTHONPATH=tests python tests/benchmarks/bench_vision_asked.py [--repeat 25] [--object OBJECT]``:
from camera to linear light of the published view. The networks are solved for, not trained
(``fitted_look``); those of an ObjectFile, which are trained, are drawn too where one is named. Every round
draws each picture in turn, so that what else the machine does falls on all of them alike.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fitted_look import fitted_look
from published_view import LIGHT, camera_of
from rich.table import Table

from harness.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision import open_vision
from harness.objectfile.vision_graph import vision_graph
from harness.objectfile.vision_network import SIZES
from harness.objectfile.vision_render import VisionRenderer
from harness.objectfile.vision_settings import RenderSettings, VisionLevel
from harness.objects.household import build
from harness.output import ANSWERS
from harness.pinhole import DirectionalLight

_CORES = (1, 2)


@dataclass(frozen=True)
class Asked:
    """One picture.

    Attributes:
        networks: ``paper``, ``compact``, or ``trained`` for an ObjectFile's.
        level: of the renderer.
        side: pixels.
        cores: threads.
        limit: ms; None where none is asked.
        is_relit: whether every picture has another lamp.
    """

    networks: str
    level: VisionLevel
    side: int
    cores: int
    limit: float | None
    is_relit: bool = False

    @property
    def said(self) -> str:
        """For people."""
        relit = ", another lamp each time" if self.is_relit else ""
        return f"{self.networks} {self.level} {self.side} x {self.side}, {self.cores} threads{relit}"


def asked(name: str) -> Iterator[Asked]:
    """What is asked of some networks; the ones of an ObjectFile are compact."""
    is_paper = name == "paper"
    yield Asked(name, "fused", 256, 2, 25.0 if is_paper else 15.0)
    yield Asked(name, "fused", 256, 1, 40.0)
    yield Asked(name, "fused", 256, 2, (25.0 if is_paper else 15.0) + 5.0, is_relit=True)
    yield Asked(name, "one_sample", 256, 2, 8.0)
    yield Asked(name, "onnx", 256, 2, 62.0)
    yield Asked(name, "onnx", 256, 1, None)
    yield Asked(name, "fused", 128, 2, None if is_paper else 5.0)
    yield Asked(name, "fused", 128, 1, None)
    yield Asked(name, "fused", 400, 2, 50.0)


@dataclass(eq=False)
class Drawn:
    """A picture that is drawn again and again.

    Attributes:
        what: it is.
        renderer: of its networks, with its threads.
        mesh: of its object.
        clock: s of each.
        cpu: s of each, of all threads.
    """

    what: Asked
    renderer: VisionRenderer
    mesh: Mesh
    clock: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)

    def draw(self, repeat: int) -> None:
        """One picture that does not count, and so many that do."""
        camera, settings = camera_of(self.mesh, self.what.side), RenderSettings(level=self.what.level)
        for k in range(repeat + 1):
            angle = 0.1 * len(self.clock)
            light = DirectionalLight(np.array([np.cos(angle), np.sin(angle), 1.0]))
            begun, used = time.perf_counter(), time.process_time()
            self.renderer.render(camera, light if self.what.is_relit else LIGHT, settings)
            if k:
                self.clock.append(time.perf_counter() - begun)
                self.cpu.append(time.process_time() - used)

    @property
    def row(self) -> list[str]:
        """Of the table: what, asked, clock, CPU, kept."""
        low, middle, high = np.quantile(self.clock, [0.25, 0.5, 0.75]) * 1e3
        limit = self.what.limit
        kept = "" if limit is None else ("yes" if middle <= limit else "NO")
        wanted = "" if limit is None else f"{limit:g}"
        cpu = f"{np.median(self.cpu) * 1e3:.1f}"
        return [self.what.said, wanted, f"{middle:.1f} ({low:.1f} to {high:.1f})", cpu, kept]


def pictures(folder: Path | None) -> list[Drawn]:
    """All that is drawn; opening is not timed."""
    mesh, found = build("mug"), []
    for name, size in SIZES.items():
        data = vision_graph(fitted_look(mesh, size)[0]).SerializeToString(deterministic=True)
        renderers = {cores: VisionRenderer(data, mesh, cores) for cores in _CORES}
        found += [Drawn(what, renderers[what.cores], mesh) for what in asked(name)]
    if folder is not None:
        of = ObjectFile.open(folder)
        opened = {cores: open_vision(of, cores) for cores in _CORES}
        found += [
            Drawn(what, opened[what.cores].renderer, opened[what.cores].surface) for what in asked("trained")
        ]
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=25, help="pictures of each, of all rounds together")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--object", type=Path, help="an ObjectFile with trained networks, drawn too")
    given = parser.parse_args()
    found = pictures(given.object)
    for _ in range(given.rounds):
        for each in found:
            each.draw(-(-given.repeat // given.rounds))
    table = Table(title="ms a picture: median (quartiles) on the clock; CPU of all threads")
    for name in ("picture", "asked", "clock", "CPU", "kept"):
        table.add_column(name, no_wrap=True)
    for each in found:
        table.add_row(*each.row)
    ANSWERS.print(table)


if __name__ == "__main__":
    main()
