"""What networks of vision are worth: pictures of cameras and lights that nothing was learned from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.authoring.vision_data import HeldOut
from harness.image_metrics import psnr, ssim
from harness.linear_image import LinearImage
from harness.objectfile.vision_render import VisionRenderer
from harness.objectfile.vision_settings import RenderSettings
from harness.sim.direct_image import LitObject

BEHIND = 1.0
"""White, as ObjectFolder's pictures have it."""


@dataclass(frozen=True, eq=False)
class Judged:
    """Pictures and what they are judged by.

    Attributes:
        references: exact, anti-aliased.
        found: from the networks.
        samples: networks were asked for, of all pictures.
    """

    references: tuple[LinearImage, ...]
    found: tuple[LinearImage, ...]
    samples: int


def judge(
    lit: LitObject,
    renderer: VisionRenderer,
    held_out: HeldOut,
    samples: int,
    settings: RenderSettings | None = None,
) -> Judged:
    """Draw every picture that was kept back, twice.

    Args:
        lit: the object.
        renderer: of its networks.
        held_out: one picture for each camera and its light.
        samples: a side of a pixel, of the reference.
        settings: of the renderer; None for the default.
    """
    references, found, asked = [], [], 0
    for camera, light in zip(held_out.cameras, held_out.lights, strict=True):
        references.append(lit.render(camera, [light], samples).image)
        rendered = renderer.render(camera, light, settings)
        found.append(rendered.image)
        asked += rendered.samples
    return Judged(tuple(references), tuple(found), asked)


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
