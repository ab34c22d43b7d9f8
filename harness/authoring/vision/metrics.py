"""What networks of vision are worth: pictures of cameras and lights that nothing was learned from."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.authoring.vision.data import HeldOutViews
from harness.picture.image_metrics import psnr, ssim
from harness.picture.linear_image import LinearImage
from harness.sim.light.direct_image import LitObject

BEHIND = 1.0
"""White, as ObjectFolder's pictures have it."""


def reference_pictures(lit: LitObject, held_out: HeldOutViews, samples: int) -> list[LinearImage]:
    """Render an exact picture for each camera and its light, with ``samples`` along a side of a pixel."""
    return [
        lit.render(camera, [light], samples).image
        for camera, light in zip(held_out.cameras, held_out.lights, strict=True)
    ]


def picture_errors(references: Sequence[LinearImage], found: Sequence[LinearImage]) -> Mapping[str, float]:
    """Means over pictures before white, as shown on a screen; object-only is of pixels it covers at all."""
    rows = []
    for wanted, got in zip(references, found, strict=True):
        one, other = got.display(BEHIND), wanted.display(BEHIND)
        covered = (wanted.alpha > 0.0) | (got.alpha > 0.0)
        alone = psnr(one, other, covered) if covered.any() else np.inf
        rows.append((psnr(one, other), alone, ssim(one, other)))
    whole, alone_all, alike = np.array(rows).T
    return {
        "psnr_db": float(whole.mean()),
        "psnr_db_worst": float(whole.min()),
        "psnr_db_object": float(alone_all.mean()),
        "ssim": float(alike.mean()),
        "ssim_worst": float(alike.min()),
    }
