"""Measure error and cost of reference pictures: samples per pixel, shadows, two programs.

python tests/benchmarks/vision/bench_vision_reference.py builtin:mug builtin:bowl --size 256
python tests/benchmarks/vision/bench_vision_reference.py builtin:mug \
    --paths 16 64 256       (needs the extra author)
python tests/benchmarks/vision/bench_vision_reference.py FILE.obj --units m --sheet pictures.png
"""

import argparse
import time
from pathlib import Path

import numpy as np

from harness.authoring.vision.data import around
from harness.basics.arrays import ByteArray
from harness.picture.image_file import write_png
from harness.picture.image_metrics import psnr, ssim
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

LIGHT = DirectionalLight(np.array([0.9, -0.8, 1.0]))
WAY = np.array([0.68, -0.58, 0.45])

BEHIND = 1.0
"""White, as ObjectFolder's pictures have it."""


def main() -> None:
    """Measure and print."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("objects", nargs="*", default=["builtin:mug"])
    parser.add_argument("--units", default="m")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--samples", type=int, nargs="*", default=[1, 2, 4, 8])
    parser.add_argument("--best", type=int, default=16)
    parser.add_argument("--paths", type=int, nargs="*", default=[])
    parser.add_argument("--bounces", type=int, default=2)
    parser.add_argument("--sheet", type=Path)
    given = parser.parse_args()
    table: list[list[Cell]] = []
    rows = [measure(name, given, table) for name in given.objects]
    heads = (
        "object and samples; stated noise .1e; difference, rms of linear light .1e; PSNR [dB] .1f; SSIM .4f"
    )
    finish_figure("vision", "direct", f"{heads}; time [CPU s] .2f", table)
    if given.sheet:
        write_png(given.sheet, np.vstack(rows))


def measure(name: str, given: argparse.Namespace, table: list[list[Cell]]) -> ByteArray:
    """One object: tables, and its pictures side by side."""
    look = appearance_of(name, given.units)
    lit = LitObject(look)
    camera = around(look.mesh, WAY / np.linalg.norm(WAY), given.size, given.size, 2.0)
    lit.render(camera.resized(8, 8), [LIGHT], 1)
    shown, rows = by_samples(lit, camera, given.samples, given.best)
    table += [[f"{Path(name).stem}, {row[0]}", *row[1:]] for row in rows]
    if given.paths:
        shown += by_paths(look, lit, camera, given.paths, given.bounces, given.best)
    return np.hstack(shown)


def against(found: LinearImage, best: LinearImage) -> tuple[float, float, float]:
    """Compare a picture with a better one: rms of linear light, PSNR in dB and SSIM as shown."""
    one, other = found.display(BEHIND), best.display(BEHIND)
    rms = float(np.sqrt(np.mean((found.colour - best.colour) ** 2)))
    return rms, psnr(one, other), ssim(one, other)


def by_samples(
    lit: LitObject, camera: Pinhole, samples: list[int], best_samples: int
) -> tuple[list[ByteArray], list[list[Cell]]]:
    """The direct level against its own of most samples."""
    best = lit.render(camera, [LIGHT], best_samples)
    bare = lit.render(camera, [LIGHT], best_samples, shadow=False)
    rows: list[list[Cell]] = []
    for count in samples:
        on_core = time.process_time()
        found = lit.render(camera, [LIGHT], count)
        on_core = time.process_time() - on_core
        rows.append([f"{count} x {count}", found.noise, *against(found.image, best.image), on_core])
    rows.append(["without shadow", None, *against(bare.image, best.image), None])
    return [best.image.display(0.5), bare.image.display(0.5)], rows


def by_paths(
    look: Appearance, lit: LitObject, camera: Pinhole, paths: list[int], bounces: int, best_samples: int
) -> list[ByteArray]:
    """Mitsuba against the direct level where no light bounces, and with bounces."""
    from tests.oracles.traced.path_traced import PathTraced

    best = lit.render(camera, [LIGHT], best_samples)
    traced = PathTraced(look)
    # Compiled here, not in the first row's time.
    for more in (0, bounces):
        traced.render(camera.resized(8, 8), [LIGHT], 2, bounces=more)
    rows: list[list[Cell]] = []
    for count, more in (*((count, 0) for count in paths), (paths[-1], bounces)):
        found = traced.render(camera, [LIGHT], count, bounces=more)
        seconds = sum(found.seconds.values())
        rows.append(
            [f"{found.samples}, {more} bounces", found.noise, *against(found.image, best.image), seconds]
        )
    heads = "paths a pixel; stated noise .1e; difference from the direct level .1e; PSNR [dB] .1f; SSIM .4f"
    finish_figure("vision", f"Mitsuba, {traced.variant.name}", f"{heads}; wall time [s] .2f", rows)
    return [found.image.display(0.5)]


if __name__ == "__main__":
    main()
