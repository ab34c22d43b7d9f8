"""From what was recorded at each contact to what the estimator compares."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from harness.sim.inverse import invert

from experiments.contact_localization.grid import Contact
from experiments.contact_localization.model import Model
from experiments.contact_localization.touch import touch_map
from harness.arrays import ByteArray, FloatArray, read_only
from harness.errors import DataRefused

CONTACT_THRESHOLD = 0.12e-3
"""Metres of indentation, averaged over a compared pixel, below which no contact is seen."""


@dataclass(frozen=True, eq=False)
class Observation:
    """One contact as it was recorded.

    Attributes:
        base_from_gel: ``(4, 4)`` as the arm reported it while pressed.
        images: ``(n, rows, columns, 3)`` uint8, at least one frame taken while pressed.
    """

    base_from_gel: FloatArray
    images: ByteArray

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


def read_contacts(
    observations: Sequence[Observation], model: Model, block: int, skirt: float
) -> tuple[Contact, ...]:
    """Recover each contact's height map and average it into the map that is compared.

    Args:
        observations: the contacts.
        model: gives the sensor and its calibration.
        block: tactile pixels a side of one compared pixel.
        skirt: metres, sigma of the gel's blur.
    """
    return tuple(
        Contact(
            observation.base_from_gel,
            touch_map(height_map(observation, model), model.sensor.pitch, block, skirt, CONTACT_THRESHOLD),
        )
        for observation in observations
    )


def height_map(observation: Observation, model: Model) -> FloatArray:
    """``(rows, columns)`` metres of indentation: the mean over the contact's frames."""
    heights = [invert(image, model.calibration) for image in observation.images]
    return np.asarray(np.mean(heights, axis=0))
