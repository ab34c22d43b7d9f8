"""From what was recorded at each contact to what the estimator compares."""

from experiments.contact_localization.model import Model
from experiments.contact_localization.posterior.hypotheses import Contact
from experiments.contact_localization.touch.touch import TouchNoise, touch_map
from harness.basics.arrays import FloatArray
from harness.recording.observation import Observation
from harness.sim.optics.inverse import heights_or_refusal

CONTACT_THRESHOLD = 0.12e-3
"""Metres of indentation, averaged over a compared pixel, below which no contact is seen."""


def contact_of(
    base_from_gel: FloatArray, heights: FloatArray, pitch: float, block: int, noise: TouchNoise
) -> Contact:
    """A contact from its pose ``(4, 4)`` and its height map in metres at ``pitch`` metres a pixel."""
    fine = touch_map(heights, pitch, block, noise.skirt, noise.edge, CONTACT_THRESHOLD)
    # A contact of one fine pixel is still seen in the four times larger one that holds it.
    coarse = touch_map(heights, pitch, 2 * block, noise.skirt, noise.edge, 0.25 * CONTACT_THRESHOLD)
    return Contact(base_from_gel, fine, coarse)


def height_map(observation: Observation, model: Model) -> tuple[FloatArray, str]:
    """``(rows, columns)`` metres of indentation, from the mean of the contact's frames, and no text.

    Zeros, and why, where the picture is not what the calibration was made of.
    """
    return heights_or_refusal(observation.images, model.calibration)
