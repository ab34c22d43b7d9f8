"""What pictures cost and err: every knob turned from its default, on cameras and lights kept back.

Each way is asked for the same pictures in turns, so that what else the machine does falls on all alike.
Errors are against exact pictures.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.authoring.training import Report
from harness.authoring.vision.cells import VERSION
from harness.authoring.vision.data import HeldOutViews
from harness.authoring.vision.metrics import BEHIND, picture_errors, reference_pictures
from harness.authoring.vision.profiles import CellsSpec
from harness.authoring.vision.vision import train_networks
from harness.basics.store import digest
from harness.basics.whole_file import write_bytes_whole
from harness.cost.curve import ErrorUnit, Point, Sample
from harness.objectfile.vision.graph import vision_graph
from harness.objectfile.vision.render import COVERS, RenderSettings, VisionRenderer
from harness.picture.image_metrics import mean_square
from harness.picture.linear_image import LinearImage
from harness.sim.light.direct_image import LitObject

DEFAULT = "default"
"""The knob that is turned nowhere."""

GREY = ErrorUnit("grey", "error, grey levels of 255 (rms; mean of views, 90 %)")

_SAMPLES = 4
"""A side of a pixel of the exact pictures."""


@dataclass(frozen=True)
class Way:
    """One way to a picture: a knob at one of its levels, all others at their default."""

    knob: str  #: its name, with a unit where it has one.
    level: str  #: for people.
    networks: CellsSpec  #: that are asked, by how they are trained.
    side: int  #: pixels.
    settings: RenderSettings = field(default_factory=RenderSettings)  #: of the renderer.


def ways(spec: CellsSpec, side: int) -> tuple[Way, ...]:
    """List the default of networks ``spec`` and ``side`` pixels, then every knob at every other level."""
    plain = Way(DEFAULT, DEFAULT, spec, side)
    drawn: list[tuple[str, str, RenderSettings]] = [
        *(("coverage, sub-pixels", str(of), RenderSettings(coverage=of)) for of in COVERS),
        *(("rays, along a pixel", str(rays), RenderSettings(rays=rays)) for rays in (1, 2, 3)),
    ]
    made: list[tuple[str, str, CellsSpec]] = [
        *(("grid, cells", str(cells), replace(spec, cells=cells)) for cells in (8, 12, 16, 24)),
        *(("width", str(wide), replace(spec, size=replace(spec.size, width=wide))) for wide in (16, 32, 64)),
        *(("told", kind, replace(spec, size=replace(spec.size, kind=kind))) for kind in ("osf-v", "osf")),
    ]
    turned = (
        *(replace(plain, knob=knob, level=level, settings=settings) for knob, level, settings in drawn),
        *(replace(plain, knob="side, pixels", level=str(of), side=of) for of in (64, 128, 256, 400)),
        *(replace(plain, knob=knob, level=level, networks=networks) for knob, level, networks in made),
    )
    return (plain, *(way for way in turned if replace(way, knob=DEFAULT, level=DEFAULT) != plain))


@dataclass(frozen=True, eq=False)
class Worth:
    """What one way asks of networks, and what its pictures err by."""

    samples: float  #: a picture, in the mean.
    rays: float  #: a picture, in the mean.
    networks: int  #: in all.
    file_bytes: int  #: of the file of its networks.
    errors: tuple[float, ...]  #: grey levels from the exact picture of each view, root mean square.
    exact: Mapping[str, float]  #: errors against exact pictures, by ``picture_errors``'s names.


@dataclass(frozen=True, eq=False)
class PictureCost:
    """What one way is worth and costs."""

    way: Way  #: to the picture.
    worth: Worth  #: of its pictures.
    point: Point  #: errors and seconds, a sample for each view.


@dataclass(frozen=True, eq=False)
class Studio:
    """An object, what it is seen by, and its networks; each is made once."""

    lit: LitObject  #: the object.
    held_out: HeldOutViews  #: cameras and lights that no network is shown.
    threads: int | None = None  #: that share the work; None for as many as the process has cores.
    renderers: dict[CellsSpec, VisionRenderer] = field(default_factory=dict)
    """by how their networks were trained."""
    file_bytes: dict[CellsSpec, int] = field(default_factory=dict)  #: of the file of networks, likewise.
    _exact: dict[int, list[LinearImage]] = field(default_factory=dict)

    def train(self, spec: CellsSpec, seed: int, folder: Path, report: Report) -> None:
        """Load networks from an existing folder, or train them there; an interrupted training continues.

        Raises:
            DataRefused: a file of that name with other contents.
        """
        name = self._key(spec, seed)
        kept, checkpoint = folder / f"{name}.onnx", folder / f".{name}.npz"
        if not kept.is_file():
            model = train_networks(
                self.lit, self.held_out, spec, seed, checkpoint, report, self.threads
            ).finish()
            write_bytes_whole(kept, vision_graph(model).SerializeToString())
            checkpoint.unlink(missing_ok=True)
        data, mesh = kept.read_bytes(), self.lit.appearance.mesh
        self.renderers[spec] = VisionRenderer(data, mesh, self.threads, name=kept.name)
        self.file_bytes[spec] = len(data)

    def views(self, way: Way) -> HeldOutViews:
        """The cameras with its pixels."""
        cameras = tuple(each.resized(way.side, way.side) for each in self.held_out.cameras)
        return replace(self.held_out, cameras=cameras)

    def worth(self, way: Way) -> Worth:
        """What it is worth."""
        renderer, views = self.renderers[way.networks], self.views(way)
        drawn = [
            renderer.render(camera, light, way.settings)
            for camera, light in zip(views.cameras, views.lights, strict=True)
        ]
        if way.side not in self._exact:
            self._exact[way.side] = reference_pictures(self.lit, views, _SAMPLES)
        exact, found = self._exact[way.side], [each.image for each in drawn]
        return Worth(
            samples=float(np.mean([each.samples for each in drawn])),
            rays=float(np.mean([each.rays for each in drawn])),
            networks=len(renderer.networks.grid),
            file_bytes=self.file_bytes[way.networks],
            errors=tuple(
                mean_square(got.display(BEHIND), wanted.display(BEHIND)) ** 0.5
                for got, wanted in zip(found, exact, strict=True)
            ),
            exact=picture_errors(exact, found),
        )

    def _key(self, spec: CellsSpec, seed: int) -> str:
        look, mesh, kept = self.lit.appearance, self.lit.appearance.mesh, self.held_out
        size, *others = astuple(spec)
        surface = [mesh.vertices, mesh.faces, look.normals, look.tints, look.places, look.texture_of]
        eyes = [camera.eye for camera in kept.cameras] + [light.direction for light in kept.lights]
        told = ["vision networks", VERSION, list(size), others, seed, surface, list(look.textures), eyes]
        return digest([*told, kept.apart])[:16]


def measure(asked: Sequence[Way], studio: Studio, repeat: int, report: Report) -> tuple[PictureCost, ...]:
    """Measure errors and seconds of each choice of levels, whose networks the studio has."""
    worth = []
    for number, way in enumerate(asked):
        report("comparing pictures", 0.5 * number / len(asked))
        worth.append(studio.worth(way))
    taken = []
    for turn in range(repeat):
        report("timing", 0.5 + 0.5 * turn / repeat)
        taken.append([_seconds(studio, way) for way in asked])
    costs = []
    for way, known, seconds in zip(asked, worth, np.median(taken, axis=0), strict=True):
        samples = tuple(
            Sample(f"view {view + 1}", "", error, None, 0.0, *seconds[view].tolist())
            for view, error in enumerate(known.errors)
        )
        name = way.knob if way.knob == DEFAULT else f"{way.knob}: {way.level}"
        levels, condition = {"knob": way.knob, "level": way.level}, {"side, pixels": way.side}
        costs.append(PictureCost(way, known, Point(name, levels, condition, samples, GREY)))
    return tuple(costs)


def _seconds(studio: Studio, way: Way) -> list[tuple[float, float]]:
    """Of CPU time, all threads together, and on the clock, of each view."""
    views, renderer = studio.views(way), studio.renderers[way.networks]
    found = []
    for camera, light in zip(views.cameras, views.lights, strict=True):
        cpu, wall = time.process_time(), time.perf_counter()
        renderer.render(camera, light, way.settings)
        found.append((time.process_time() - cpu, time.perf_counter() - wall))
    return found
