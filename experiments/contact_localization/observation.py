"""From what was recorded at each contact to what the estimator compares."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.model import Model
from experiments.contact_localization.posterior.hypotheses import Contact
from experiments.contact_localization.touch.touch import TouchNoise, touch_map
from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.bench.acquisition import Strike
from harness.sim.optics.inverse import invert

CONTACT_THRESHOLD = 0.12e-3
"""Metres of indentation, averaged over a compared pixel, below which no contact is seen."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One contact as it was recorded.

    Attributes:
        base_from_gel: ``(4, 4)`` as the arm reported it while pressed.
        images: ``(n, rows, columns, 3)`` uint8, at least one frame taken while pressed.
        strike: what was heard when the place was struck; None where it was not.
    """

    base_from_gel: FloatArray
    images: ByteArray
    strike: Strike | None = None

    def __post_init__(self) -> None:
        pose = np.asarray(self.base_from_gel, dtype=np.float64)
        images = np.asarray(self.images)
        if pose.shape != (4, 4) or not np.isfinite(pose).all():
            raise DataRefused(f"a contact's base_from_gel must be a finite (4, 4) transform, not {pose!r}")
        if images.ndim != 4 or images.shape[3] != 3 or len(images) == 0 or images.dtype != np.uint8:
            raise DataRefused(
                f"a contact's images must be uint8 of shape (n, rows, columns, 3) with n >= 1, "
                f"not {images.dtype} of shape {images.shape}"
            )
        object.__setattr__(self, "base_from_gel", read_only(pose.copy()))
        object.__setattr__(self, "images", images)


def contact_of(
    base_from_gel: FloatArray, heights: FloatArray, pitch: float, block: int, noise: TouchNoise
) -> Contact:
    """A contact from its pose ``(4, 4)`` and its height map in metres at ``pitch`` metres a pixel."""
    fine = touch_map(heights, pitch, block, noise.skirt, noise.edge, CONTACT_THRESHOLD)
    # A contact of one fine pixel is still seen in the four times larger one that holds it.
    coarse = touch_map(heights, pitch, 2 * block, noise.skirt, noise.edge, 0.25 * CONTACT_THRESHOLD)
    return Contact(base_from_gel, fine, coarse)


def height_map(observation: Observation, model: Model) -> FloatArray:
    """``(rows, columns)`` metres of indentation, from the mean of the contact's frames.

    Colour is close to linear in slope, so the mean of frames is the picture of the mean shape,
    and one inversion serves for all.
    """
    mean = np.rint(observation.images.mean(axis=0)).astype(np.uint8)
    return np.asarray(invert(mean[None], model.calibration).height[0])
