"""From what was recorded at each contact to what the estimator compares."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.hypotheses import Contact
from experiments.contact_localization.model import Model
from experiments.contact_localization.touch import TouchNoise, touch_map
from harness.arrays import ByteArray, FloatArray, read_only
from harness.errors import DataRefused
from harness.geometry import rotation_from_quaternion, transform
from harness.reading import Reading
from harness.sim.inverse import invert

IMAGE = "gel.image"
POSE = "arm.base_from_flange"
_PACKET = 0.05

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
    observations: Sequence[Observation], model: Model, block: int, noise: TouchNoise
) -> tuple[Contact, ...]:
    """Recover each contact's height map and average it into the map that is compared.

    Args:
        observations: the contacts.
        model: gives the sensor and its calibration.
        block: tactile pixels a side of one compared pixel.
        noise: gives the gel's blurs.
    """
    return tuple(
        contact_of(
            observation.base_from_gel, height_map(observation, model), model.sensor.pitch, block, noise
        )
        for observation in observations
    )


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


def from_readings(readings: Sequence[Reading], flange_from_gel: FloatArray) -> Observation:
    """One recorded contact as the estimator takes it.

    Args:
        readings: of one step: ``gel.image`` and ``arm.base_from_flange`` among them.
        flange_from_gel: ``(4, 4)`` of the station.

    Raises:
        DataRefused: a channel is missing, or no arm pose was recorded while the frames arrived.
    """
    by_name = {reading.channel.name: reading for reading in readings}
    missing = {IMAGE, POSE} - by_name.keys()
    if missing:
        raise DataRefused(
            f"a contact was recorded without {' and '.join(sorted(missing))}; "
            "the step is not of a localization run"
        )
    image, poses = by_name[IMAGE], by_name[POSE]
    # The arm rests while frames are taken: every packet between the first and the last is of one pose.
    taken = (poses.times >= image.times[0] - _PACKET) & (poses.times <= image.times[-1] + _PACKET)
    if not taken.any():
        raise DataRefused(
            f"no arm pose was recorded between {image.times[0]:.3f} s and {image.times[-1]:.3f} s, "
            "when the tactile frames were taken; record the arm until the last frame"
        )
    base_from_flange = _resting(poses.values[taken])
    return Observation(base_from_flange @ flange_from_gel, image.values)


def _resting(packets: FloatArray) -> FloatArray:
    """``(4, 4)``: the mean place, and the attitude of the packet in the middle."""
    middle = packets[len(packets) // 2]
    return transform(rotation_from_quaternion(middle[3:]), packets[:, :3].mean(axis=0))
