"""A camera's picture beside the simulated one of the same pose: masks, exposure, and what is left."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.errors import DataRefused
from harness.picture.exposure_fit import ExposureFit, ExposureKind, fit_exposure
from harness.picture.image_metrics import mean_square, psnr, ssim
from harness.picture.linear_image import LinearImage
from harness.picture.object_mask import SILHOUETTE, mask_by_background, mask_by_colours, overlap
from harness.picture.srgb import LINEAR_OF_BYTE, bytes_from_linear

_WHOLE = 0.999
"""Share of a pixel that the object covers where the pixel shows nothing else."""

_EDGE = 1
"""Pixels inside the outline that are not fitted: lenses and JPEG mix in what is beside them."""


@dataclass(frozen=True, eq=False)
class PictureDifference:
    """Difference of two pictures over the object's silhouette."""

    psnr_db: float  #: in dB; infinite where they are the same.
    ssim: float  #: mean of the structural similarity of its pixels.
    rms_grey: float  #: root of the mean square, grey levels.

    def __str__(self) -> str:
        decibels = f"{self.psnr_db:.1f} dB" if math.isfinite(self.psnr_db) else "the same"
        return f"{decibels}, SSIM {self.ssim:.3f}, {self.rms_grey:.1f} grey levels rms"


@dataclass(frozen=True, eq=False)
class LiveComparison:
    """A live picture and the simulated one, exposed alike."""

    live: ByteArray  #: ``(rows, columns, 3)`` RGB.
    simulated: ByteArray
    """the same, exposed as the camera did, before the bench: its picture where there is one, else the live
    picture itself, so that nothing but the object differs."""
    silhouette: BoolArray  #: ``(rows, columns)`` the object's pixels in the simulation.
    mask: BoolArray  #: ``(rows, columns)`` the object's pixels in the live picture.
    masked_by: str  #: ``"background"`` or ``"colours"``.
    overlap: float  #: of both, 0 to 1 (IoU).
    exposure: ExposureFit  #: the fit.
    fitted: PictureDifference  #: of the pixels in the silhouette.
    unfitted: PictureDifference  #: the same before anything was fitted.
    seconds: Mapping[str, float]  #: s on the clock by stage.


def compare_live(
    live: ByteArray,
    image: LinearImage,
    background: ByteArray | None = None,
    kind: ExposureKind = "gain-offset",
) -> LiveComparison:
    """Compare a camera's picture with the simulated one.

    The exposure is fitted over the silhouette without its edge, whatever the mask says, so that neither
    depends on the other.

    Args:
        live: ``(rows, columns, 3)`` RGB in sRGB.
        image: simulated, by the same camera.
        background: the bench without the object; None where nobody took that picture.
        kind: what is fitted.

    Raises:
        DataRefused: as of ``fit_exposure``, of ``mask_by_background`` and of ``mask_by_colours``.
    """
    begun = time.perf_counter()
    if live.shape != image.colour.shape:
        raise DataRefused(
            f"the live picture is {live.shape[1]} x {live.shape[0]} pixels and the simulated one "
            f"{image.alpha.shape[1]} x {image.alpha.shape[0]}; give the camera that took it"
        )
    silhouette = image.alpha >= SILHOUETTE
    inside = ndimage.binary_erosion(image.alpha >= _WHOLE, iterations=_EDGE)
    light = image.colour / np.maximum(image.alpha, SILHOUETTE)[..., None]
    exposure = fit_exposure(live, light, inside, kind)
    fitted_at = time.perf_counter()
    if background is None:
        mask, by = mask_by_colours(live, silhouette), "colours"
    else:
        mask, by = mask_by_background(live, background, silhouette), "background"
    masked_at = time.perf_counter()
    behind = LINEAR_OF_BYTE[live if background is None else background]
    simulated = _before(exposure.exposed(image.colour, image.alpha), image.alpha, behind)
    plain = _before(image.colour, image.alpha, behind)
    fitted, unfitted = (_apart(live, each, silhouette) for each in (simulated, plain))
    ended = time.perf_counter()
    return LiveComparison(
        live=live,
        simulated=simulated,
        silhouette=silhouette,
        mask=mask,
        masked_by=by,
        overlap=overlap(silhouette, mask),
        exposure=exposure,
        fitted=fitted,
        unfitted=unfitted,
        seconds={"fit": fitted_at - begun, "mask": masked_at - fitted_at, "difference": ended - masked_at},
    )


def _before(colour: FloatArray, alpha: FloatArray, behind: FloatArray) -> ByteArray:
    return bytes_from_linear(np.clip(colour, 0.0, None) + (1.0 - alpha)[..., None] * behind)


def _apart(live: ByteArray, simulated: ByteArray, where: BoolArray) -> PictureDifference:
    return PictureDifference(
        psnr(live, simulated, where),
        ssim(live, simulated, where),
        float(np.sqrt(mean_square(live, simulated, where))),
    )
