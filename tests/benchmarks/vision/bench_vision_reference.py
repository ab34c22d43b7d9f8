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
from rich.console import Console

from harness.authoring.vision.data import around
from harness.basics.arrays import ByteArray
from harness.picture.image_file import write_png
from harness.picture.image_metrics import psnr, ssim
from harness.picture.linear_image import LinearImage, root_mean_square
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

CONSOLE = Console(width=130, highlight=False, emoji=False)

LIGHT = DirectionalLight(np.array([0.9, -0.8, 1.0]))
WAY = np.array([0.68, -0.58, 0.45])

BEHIND = 1.0
"""White, as ObjectFolder's pictures have it."""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objects", nargs="*", default=["builtin:mug"])
    parser.add_argument("--units", default="m")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--samples", type=int, nargs="*", default=[1, 2, 4, 8])
    parser.add_argument("--best", type=int, default=16)
    parser.add_argument("--paths", type=int, nargs="*", default=[])
    parser.add_argument("--bounces", type=int, default=2)
    parser.add_argument("--sheet", type=Path)
    given = parser.parse_args()
    rows = [measure(name, given) for name in given.objects]
    if given.sheet:
        write_png(given.sheet, np.vstack(rows))


def measure(name: str, given: argparse.Namespace) -> ByteArray:
    """One object: tables, and its pictures side by side."""
    begun = time.perf_counter()
    look = appearance_of(name, given.units)
    read = time.perf_counter() - begun
    lit = LitObject(look)
    prepared = time.perf_counter() - begun - read
    camera = around(look.mesh, WAY / np.linalg.norm(WAY), given.size, given.size, 2.0)
    lit.render(camera.resized(8, 8), [LIGHT], 1)
    CONSOLE.print(
        f"{Path(name).name}: {len(look.mesh.faces)} faces, read in {read:.2f} s, sorted in {prepared:.2f} s"
        + "".join(f"; {remark}" for remark in look.remarks)
    )
    shown = by_samples(lit, camera, given.samples, given.best)
    if given.paths:
        shown += by_paths(look, lit, camera, given.paths, given.bounces, given.best)
    return np.hstack(shown)


def against(found: LinearImage, best: LinearImage) -> str:
    """How far a picture is from a better one, in light and as shown."""
    one, other = found.display(BEHIND), best.display(BEHIND)
    rms = root_mean_square(found, best)
    return f"{rms:8.1e} {psnr(one, other):6.1f} dB {ssim(one, other):6.4f}"


def by_samples(lit: LitObject, camera: Pinhole, samples: list[int], best_samples: int) -> list[ByteArray]:
    """The direct level against its own of most samples."""
    best = lit.render(camera, [LIGHT], best_samples)
    bare = lit.render(camera, [LIGHT], best_samples, shadow=False)
    CONSOLE.print("samples   stated noise   true      PSNR    SSIM     hits  shadow   all (s)   of one core")
    for count in samples:
        on_core = time.process_time()
        found = lit.render(camera, [LIGHT], count)
        on_core = time.process_time() - on_core
        noise = "-" if found.noise is None else f"{found.noise:.1e}"
        spent = found.seconds
        CONSOLE.print(
            f"{count:3} x {count:<3} {noise:>10}   {against(found.image, best.image)}   "
            f"{spent['hits']:6.3f} {spent['shadow']:6.3f} {sum(spent.values()):8.3f}   {on_core:8.3f}"
        )
    CONSOLE.print(
        f"{best_samples} x {best_samples}: stated noise {best.noise:.1e}, what the others are compared with"
    )
    CONSOLE.print(f"without shadow                    {against(bare.image, best.image)}")
    return [best.image.display(0.5), bare.image.display(0.5)]


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
    CONSOLE.print(f"Mitsuba, {traced.variant.name}: {traced.variant.because}")
    CONSOLE.print(
        "paths      noise   from direct  PSNR   SSIM   seconds (with the direct level's noise between)"
    )
    for count in paths:
        found = traced.render(camera, [LIGHT], count)
        CONSOLE.print(
            f"{found.samples:5}   {found.noise:8.1e}   {against(found.image, best.image)}   "
            f"{sum(found.seconds.values()):.2f}"
        )
    bounced = traced.render(camera, [LIGHT], paths[-1], bounces=bounces)
    CONSOLE.print(
        f"{bounced.samples:5}   {bounced.noise:8.1e}   {against(bounced.image, best.image)}   "
        f"{sum(bounced.seconds.values()):.2f}, with {bounces} bounces: what the direct level leaves out"
    )
    return [found.image.display(0.5), bounced.image.display(0.5)]


if __name__ == "__main__":
    main()
