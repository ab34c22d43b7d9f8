"""Readings of a run as each sense has them: an outline, patches of contacts, peaks of strikes."""

from collections.abc import Sequence

import numpy as np

from experiments.scale_estimation.sound.peaks import Peaks
from experiments.scale_estimation.touch.patch import Patch, patch_of
from harness.bench.acquisition import Strike
from harness.picture.object_mask import mask_by_background
from harness.picture.outline import SeenOutline, read_outline
from harness.recording.look_pictures import look_pictures
from harness.recording.observation import Observation
from harness.recording.step_file import StepRecord
from harness.sim.optics.inverse import invert_mean
from harness.sim.optics.tactile_calibration import TactileCalibration
from harness.strikes.peaks import analyse
from harness.strikes.spectra import Analysis


def outline_of(record: StepRecord) -> SeenOutline | None:
    """The object's outline in the camera's pictures; None where the step was no look.

    Raises:
        DataRefused: the object is not seen.
    """
    pictures = look_pictures(record)
    return None if pictures is None else read_outline(mask_by_background(*pictures))


def patch_of_contact(seen: Observation, calibration: TactileCalibration, pitch: float) -> Patch | None:
    """Where a contact met the object; None where the gel touched nothing.

    Args:
        seen: the contact.
        calibration: of the gel.
        pitch: m of gel that a pixel shows.

    Raises:
        PictureRefused: its picture is not what the calibration was made of.
    """
    return patch_of(invert_mean(seen.images, calibration).height[0], pitch, seen.base_from_gel)


def peaks_of(strikes: Sequence[Strike]) -> Peaks | None:
    """The resonances of all strikes together; None where none was made, or none may be used.

    Peaks that are two modes at once count too: only where they lie is asked, not which place was struck.
    """
    usable = [strike for strike in strikes if not strike.fault]
    if not usable:
        return None
    settings = Analysis()
    # One strike alone stands for two: nothing is compared between places.
    found = analyse(usable if len(usable) > 1 else usable * 2, settings)
    peaks = sorted((*found.peaks, *found.rejected), key=lambda peak: peak.frequency)
    if not peaks:
        return None
    frequencies = np.array([peak.frequency for peak in peaks])
    levels = found.loudest + np.array([peak.level for peak in peaks])
    decays = np.array([peak.damping for peak in peaks])
    return Peaks(frequencies, levels, found.band, settings.decay, decays)
