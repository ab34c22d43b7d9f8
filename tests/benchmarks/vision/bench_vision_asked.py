"""Every time asked of the renderer, beside what it takes, in one run.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_asked.py [--repeat 25] [--object OBJECT]
[--plain]``: from camera to linear light of the published view. The networks are solved for, not trained
(``fitted_look``); those of ObjectFiles, which are trained, are drawn too where some are named, and alone with
``--trained-only``. Every round draws each picture in turn, so that what else the machine does falls on all of
them alike. ``--plain`` adds the paper's arithmetic by the same networks, extrapolated from a crop.
"""

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.table import Table

from harness.basics.mesh import Mesh
from harness.commands.output import ANSWERS
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import PAPER, SIZES, VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import RenderSettings, VisionLevel
from harness.objectfile.vision.vision import open_vision
from harness.objects.household import build
from harness.picture.pinhole import DirectionalLight
from tests.oracles.fma_peak import peak
from tests.oracles.paper_march import PLAIN_SAMPLES, paper_seconds
from tests.samples.fitted_look import fitted_look
from tests.samples.published_view import LIGHT, camera_of

_CORES = (1, 2)

_CROP = 16
"""Pixels, a side of what is measured of the paper's arithmetic."""


@dataclass(frozen=True)
class Asked:
    """One picture.

    Attributes:
        networks: ``paper``, ``compact``, or an ObjectFile's folder and size.
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


def asked(name: str, is_paper: bool) -> Iterator[Asked]:
    """What is asked of some networks."""
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
        rates: samples a second that the networks answered in each.
    """

    what: Asked
    renderer: VisionRenderer
    mesh: Mesh
    clock: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    rates: list[float] = field(default_factory=list)

    def draw(self, repeat: int) -> None:
        """One picture that does not count, and so many that do."""
        camera, settings = camera_of(self.mesh, self.what.side), RenderSettings(level=self.what.level)
        for k in range(repeat + 1):
            angle = 0.1 * len(self.clock)
            light = DirectionalLight(np.array([np.cos(angle), np.sin(angle), 1.0]))
            begun, used = time.perf_counter(), time.process_time()
            found = self.renderer.render(camera, light if self.what.is_relit else LIGHT, settings)
            if k:
                self.rates.append(found.samples / found.seconds["networks"])
                self.clock.append(time.perf_counter() - begun)
                self.cpu.append(time.process_time() - used)

    def row(self, most: float) -> list[str]:
        """Of the table; the networks beside the FLOP/s that a core does at most."""
        low, middle, high = np.quantile(self.clock, [0.25, 0.5, 0.75]) * 1e3
        limit = self.what.limit
        kept = "" if limit is None else ("yes" if middle <= limit else "NO")
        wanted = "" if limit is None else f"{limit:g}"
        cpu = f"{np.median(self.cpu) * 1e3:.1f}"
        clock, rate = f"{middle:.1f} ({low:.1f} to {high:.1f})", float(np.median(self.rates))
        share = rate * 2.0 * self.renderer.model.weights.size.products / (most * self.what.cores)
        return [self.what.said, wanted, clock, cpu, kept, f"{rate / 1e6:.1f} M/s, {100.0 * share:.0f} %"]


@dataclass(frozen=True, eq=False)
class Look:
    """Networks that are drawn.

    Attributes:
        name: said in the table.
        mesh: that pictures are drawn along, m.
        renderers: by threads.
    """

    name: str
    mesh: Mesh
    renderers: Mapping[int, VisionRenderer]

    @property
    def model(self) -> VisionModel:
        """Its networks."""
        return self.renderers[1].model

    @property
    def pictures(self) -> list[Drawn]:
        """All that is asked of it."""
        is_paper = self.model.weights.size.width == PAPER.width
        return [Drawn(what, self.renderers[what.cores], self.mesh) for what in asked(self.name, is_paper)]


def solved() -> Iterator[Look]:
    """Networks that were solved for."""
    mesh = build("mug")
    for name, size in SIZES.items():
        data = vision_graph(fitted_look(mesh, size)[0]).SerializeToString(deterministic=True)
        yield Look(name, mesh, {cores: VisionRenderer(data, mesh, cores) for cores in _CORES})


def trained(folder: Path) -> Look:
    """Networks of an ObjectFile; opening is not timed."""
    of = ObjectFile.open(folder)
    opened = {cores: open_vision(of, cores) for cores in _CORES}
    renderers = {cores: each.renderer for cores, each in opened.items()}
    return Look(folder.name, opened[1].surface, renderers)


def plainly(looks: list[Look]) -> None:
    """The paper's arithmetic by the same networks."""
    for look in looks:
        seconds = paper_seconds(look.model, look.mesh, 256, _CROP)
        ANSWERS.print(
            f"{look.name}: the paper's arithmetic, {PLAIN_SAMPLES} samples a ray, numpy float64, one core, "
            f"256 x 256: {seconds:.2f} s CPU, extrapolated from {_CROP} x {_CROP} pixels"
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=25, help="pictures of each, of all rounds together")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--object", type=Path, action="append", default=[], help="an ObjectFile with trained networks"
    )
    parser.add_argument("--trained-only", action="store_true", help="no networks that were solved for")
    parser.add_argument("--plain", action="store_true", help="the paper's arithmetic too")
    given = parser.parse_args()
    looks = [*(() if given.trained_only else solved()), *map(trained, given.object)]
    found = [picture for look in looks for picture in look.pictures]
    for _ in range(given.rounds):
        for each in found:
            each.draw(-(-given.repeat // given.rounds))
    most = peak()
    table = Table(title="ms a picture: median (quartiles) on the clock; CPU of all threads")
    for name in ("picture", "asked", "clock", "CPU", "kept", "networks, of the FMA peak"):
        table.add_column(name, no_wrap=True)
    for each in found:
        table.add_row(*each.row(most))
    ANSWERS.print(table)
    ANSWERS.print(f"peak of one core: {most / 1e9:.0f} GFLOP/s float32")
    if given.plain:
        plainly(looks)


if __name__ == "__main__":
    main()
