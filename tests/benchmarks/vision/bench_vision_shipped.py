"""Measure error and CPU time on one thread of shipped ObjectFiles' pictures, by the renderer's knobs.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_shipped.py [NAME ...] [--views 8] [--size 256]``:
views from around, each under another lamp, of objects that are built in; exact pictures have 4 x 4 rays a
pixel. CPU ms in the median (quartiles), then of each part of the default.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from harness.commands.output import ANSWERS
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import Rendered, RenderSettings, open_vision
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.picture.image_metrics import psnr, ssim
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

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
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=OBJECTS)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--repeat", type=int, default=5)
    given = parser.parse_args()
    for name in given.names:
        measure(name, given)


def measure(name: str, given: argparse.Namespace) -> None:
    """One object: errors and seconds of every way to its pictures."""
    begun = time.process_time()
    vision = open_vision(ObjectFile.open(Path("objects") / name), 1)
    ANSWERS.print(f"{name}: {len(vision.renderer.networks.grid)} networks, {_ms(begun):.0f} ms to open")
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
            taken.append(_ms(begun))
        samples = np.mean([each.samples for each in found])
        decibels = [psnr(one, other) for one, other in zip(shown, exact, strict=True)]
        alike = np.mean([ssim(one, other) for one, other in zip(shown, exact, strict=True)])
        low, half, high = np.quantile(taken, (0.25, 0.5, 0.75))
        ANSWERS.print(
            f"  {way:10} {np.mean(decibels):.2f} dB, worst {min(decibels):.2f}, SSIM {alike:.4f}; "
            f"{samples:.0f} samples, CPU {half:.1f} ({low:.1f} to {high:.1f}) ms"
        )
        if way == "default":
            parts = {
                part: 1e3 * np.median([each.seconds[part] for each in found]) for part in found[0].seconds
            }
            ANSWERS.print("    " + ", ".join(f"{part} {ms:.1f} ms" for part, ms in parts.items()))


def _ms(begun: float) -> float:
    return 1e3 * (time.process_time() - begun)


if __name__ == "__main__":
    main()
