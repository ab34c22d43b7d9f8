"""Depth of a press from its picture, with what a contact itself does to the colour taken out.

Two readings. The first, by the smooth model of the calibration, says roughly where the object is: its
slopes lean, for it takes a contact's own dimming for slope. In the second that dimming is taken out there
(``harness.sim.optics.contact_colour``). Before both, the light of the moment is compared with the
calibration's.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.sim.optics.contact_colour import ContactColour, contact_colour
from harness.sim.optics.inverse import STEADY, Detection, Inversion, invert
from harness.sim.optics.tactile_calibration import TactileCalibration, with_background

TOUCHED = 0.4
"""Share of the deepest point, above the gel around, beyond which the object is taken to touch. Published
balls read alike from 0.35 to 0.5: the colours of a contact reach a little past its line."""

_AROUND = 5.0
"""Percentile of the heights that is the gel around; the lowest one may be an outlier."""

_RIM = 2.0
"""Pixels over which a contact's dimming is let in."""

_ALIKE = 12.0
"""Grey levels within which pixels are taken to have changed alike."""

_TURNS = 30


@dataclass(frozen=True, eq=False)
class Depth:
    """A reading, and by what.

    Attributes:
        read: heights, contact, where it can be trusted.
        calibrations: of each picture: the colours of contacts over what the picture's gel would show at rest.
        dimming: ``(n, rows, columns, 3)`` grey levels that contacts were taken to add whatever their slope.
        drift: ``(n, 3)`` grey levels by which the light differs from the calibration's; zero where none was
            looked for.
    """

    read: Inversion
    calibrations: tuple[TactileCalibration, ...]
    dimming: FloatArray
    drift: FloatArray


def read_depth(images: ByteArray, calibration: TactileCalibration, detection: Detection = STEADY) -> Depth:
    """Recover the surface of a flat gel from pictures of presses.

    Args:
        images: ``(n, rows, columns, 3)`` RGB.
        calibration: with a smooth model and a table of the same presses.
        detection: what counts as a change; ``drifting`` also asks for the light of the moment.

    Raises:
        DataRefused: images of another shape or type than the calibration's.
        CalibrationRefused: a calibration with no smooth model, or a table of too few bins.
    """
    if images.ndim != 4 or images.shape[1:] != calibration.background.shape or images.dtype != np.uint8:
        raise DataRefused(
            f"images are {images.dtype} {images.shape}; this calibration reads uint8 "
            f"(n, *{calibration.background.shape})"
        )
    began = perf_counter()
    colour = contact_colour(calibration)
    answers = [_read_one(image, calibration, colour, detection) for image in images]
    drift = np.array([drift for *_, drift in answers]).reshape(len(images), 3)
    dimming = np.array([dimming for _, _, dimming, _ in answers]).reshape(images.shape)
    return Depth(
        replace(_stacked([read for read, *_ in answers]), seconds=perf_counter() - began),
        tuple(by for _, by, _, _ in answers),
        read_only(dimming),
        read_only(drift),
    )


def drift_of(image: ByteArray, background: ByteArray) -> FloatArray:
    """``(3,)`` grey levels by which most of a picture differs from the untouched gel: the mode's mean.

    A contact with its halo may fill half of a picture; the pixels that changed alike are still more than
    those that share any other change.
    """
    change = (image[::2, ::2].astype(np.float64) - background[::2, ::2]).reshape(-1, 3)
    drift = np.asarray(np.median(change, axis=0))
    for _ in range(_TURNS):
        alike = ((change - drift) ** 2).sum(axis=1) < _ALIKE**2
        if not alike.any():
            return drift
        moved = change[alike].mean(axis=0)
        settled, drift = bool(np.abs(moved - drift).max() < 0.01), np.asarray(moved)
        if settled:
            return drift
    return drift


def _read_one(
    image: ByteArray, calibration: TactileCalibration, colour: ContactColour, detection: Detection
) -> tuple[Inversion, TactileCalibration, FloatArray, FloatArray]:
    drift = drift_of(image, calibration.background) if detection.drifting else np.zeros(3)
    rest = calibration.background + drift
    first = invert(image[None], with_background(calibration, _byte(rest)), detection)
    if not first.imprint.any():
        return first, with_background(calibration, _byte(rest)), np.zeros(image.shape), drift
    dimming = colour.offset * _touched(first.height[0])[..., None]
    by = with_background(replace(calibration, smooth=colour.slopes), _byte(rest + dimming))
    return invert(image[None], by, detection), by, dimming, drift


def _touched(height: FloatArray) -> FloatArray:
    above = height - np.percentile(height, _AROUND)
    share: FloatArray = gaussian_filter((above > TOUCHED * above.max()).astype(np.float64), _RIM)
    return share


def _byte(picture: FloatArray) -> ByteArray:
    return np.clip(np.rint(picture), 0.0, 255.0).astype(np.uint8)


def _stacked(reads: list[Inversion]) -> Inversion:
    names = ("height", "contact", "imprint", "trusted", "error", "anchored")
    return Inversion(
        **{name: read_only(np.concatenate([vars(read)[name] for read in reads])) for name in names},
        seconds=0.0,
    )
