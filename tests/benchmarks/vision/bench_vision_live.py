"""What a fitted exposure is worth: a mocked camera of known gains, by rays, beside networks.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_live.py OBJECT builtin:mug --views 8``; each view
has an exposure, a white balance, a black level, noise and JPEG of its own. *Off* is the fitted gain over the
true one, less one; *z* that in standard errors.
"""

from pathlib import Path

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import open_vision
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.picture.linear_image import LinearImage
from harness.picture.live_picture import compare_live
from harness.picture.srgb import bytes_from_linear
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject
from tests.benchmarks.results import benchmark_parser, finish_figure, spread

QUANTITIES = (
    "relative error of the worst channel's gain",
    "the same in stated standard errors",
    "error of the worst channel's offset, linear light",
    "relative error of the worst gain, exact rays",
    "the same in stated standard errors, exact rays",
    "PSNR over the object after the fit [dB]",
    "the same, exact rays [dB]",
    "PSNR before the fit [dB]",
    "SSIM over the object",
    "overlap of outlines from the bench alone",
    "overlap of outlines from colours",
    "time of the fit [ms]",
    "time of the mask [ms]",
    "time of the difference [ms]",
)
_BENCH = np.array([0.10, 0.12, 0.16])
_NOISE = 0.006


def photograph(image: LinearImage, gain: FloatArray, black: FloatArray, seed: int, quality: int) -> ByteArray:
    """As a camera sends it; without compression where the quality is 0."""
    light = gain * image.colour + black * image.alpha[..., None] + (1.0 - image.alpha)[..., None] * _BENCH
    noisy = bytes_from_linear(light + np.random.default_rng(seed).normal(0.0, _NOISE, light.shape))
    if quality == 0:
        return noisy
    _, jpeg = cv2.imencode(".jpg", noisy[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    seen = cv2.imdecode(jpeg, cv2.IMREAD_COLOR)
    assert seen is not None
    return np.ascontiguousarray(seen[..., ::-1], dtype=np.uint8)


def main() -> None:
    """Print or write the errors over the views."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("mesh")
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--quality", type=int, default=92, help="of JPEG; 0 for none")
    asked = parser.parse_args()
    vision, lit = open_vision(ObjectFile.open(asked.folder), 1), LitObject(appearance_of(asked.mesh, None))
    camera = camera_for(vision.surface, asked.size, asked.size)
    random, rows = np.random.default_rng(0), []
    for view in range(asked.views):
        axis, angle = vision.surface.bounds.mean(axis=0), 2.0 * np.pi * view / asked.views
        here, _ = turned(camera, light_for(camera), axis, angle)
        light = light_for(here)
        gain, black = random.uniform(0.4, 1.0, 3), random.uniform(0.0, 0.04, 3)
        exact = lit.render(here, [light], 4).image
        live = photograph(exact, gain, black, 2 * view, asked.quality)
        bench = photograph(
            LinearImage(0.0 * exact.colour, 0.0 * exact.alpha, exact.depth), gain, black, 1, asked.quality
        )
        found = [compare_live(live, vision.picture(here, light).image, behind) for behind in (bench, None)]
        fit, own = found[0].exposure, compare_live(live, exact, bench)
        off, errors = fit.gain / gain - 1.0, fit.gain_error / gain
        own_off = own.exposure.gain / gain - 1.0
        apart = found[0].fitted
        rows.append(
            [
                *(np.abs(off).max(), np.abs(off / errors).max(), np.abs(fit.offset - black).max()),
                *(np.abs(own_off).max(), np.abs(own_off * gain / own.exposure.gain_error).max()),
                *(apart.psnr_db, own.fitted.psnr_db, found[0].unfitted.psnr_db, apart.ssim),
                *(each.overlap for each in found),
                *(1e3 * found[0].seconds[part] for part in ("fit", "mask", "difference")),
            ]
        )
    table = zip(QUANTITIES, map(spread, np.array(rows).T), strict=True)
    finish_figure("vision", "camera", f"quantity; median (range) of {asked.views} views .3g", table)


if __name__ == "__main__":
    main()
