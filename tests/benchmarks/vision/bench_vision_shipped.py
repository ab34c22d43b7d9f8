"""Measure error and CPU time on one thread of shipped ObjectFiles' pictures, by the renderer's knobs.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_shipped.py [NAME ...] [--views 8] [--size 256]``:
views from around, each under another lamp, of objects that are built in; exact pictures have 4 x 4 rays a
pixel. CPU ms in the median (quartiles), then of each part of the default.
"""

import argparse
import time

import numpy as np

from harness.bench.named_files import SHIPPED
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import Rendered, RenderSettings, open_vision
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.picture.image_metrics import psnr, ssim
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.docs.results import Cell

OBJECTS = ("mug", "bowl", "wrench", "pitcher", "tray", "plate")
WAYS = {
    "default": RenderSettings(),
    "coverage 1": RenderSettings(coverage=1),
    "coverage 5": RenderSettings(coverage=5),
    "rays 2": RenderSettings(rays=2),
}
_EDGE = 3e-3
"""Distance in m between vertices of the surface from which the shipped looks were built."""


def main() -> None:
    """Measure and print."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("names", nargs="*", default=OBJECTS)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--repeat", type=int, default=5)
    given = parser.parse_args()
    errors: list[list[Cell]] = []
    parts: list[list[Cell]] = []
    for name in given.names:
        measure(name, given, errors, parts)
    heads = "object and settings; mean PSNR [dB] .2f; worst [dB] .2f; SSIM .4f; samples .0f"
    finish_figure("vision_renderer", "error", f"{heads}; time, median (quartiles) [CPU ms] .1f", errors)
    finish_figure("vision_renderer", "time of stages", "object and stage; median [CPU ms] .1f", parts)


def measure(name: str, given: argparse.Namespace, errors: list[list[Cell]], parts: list[list[Cell]]) -> None:
    """Append errors and CPU time of every setting of one object, and the time of each stage."""
    vision = open_vision(ObjectFile.open(SHIPPED / "objects" / name), 1)
    lit = LitObject(appearance_of(f"builtin:{name}", None, edge=_EDGE))
    first = camera_for(vision.surface, given.size, given.size)
    about, each = vision.surface.bounds.mean(axis=0), 2.0 * np.pi / given.views
    views = [turned(first, light_for(first), about, k * each) for k in range(given.views)]
    exact = [lit.render(camera, [light], 4).image.display(1.0) for camera, light in views]
    for way, settings in WAYS.items():
        shown = [vision.picture(camera, light, settings).image.display(1.0) for camera, light in views]
        taken: list[float] = []
        found: list[Rendered] = []
        for camera, light in views * given.repeat:
            begun = time.process_time()
            found.append(vision.picture(camera, light, settings))
            taken.append(1e3 * (time.process_time() - begun))
        samples = np.mean([each.samples for each in found])
        decibels = [psnr(one, other) for one, other in zip(shown, exact, strict=True)]
        alike = np.mean([ssim(one, other) for one, other in zip(shown, exact, strict=True)])
        quality = (float(np.mean(decibels)), min(decibels), float(alike))
        errors.append([f"{name}, {way}", *quality, float(samples), spread(taken, 0.25, 0.75)])
        for part in found[0].seconds if way == "default" else ():
            took = 1e3 * float(np.median([each.seconds[part] for each in found]))
            parts.append([f"{name}, {part}", took])


if __name__ == "__main__":
    main()
