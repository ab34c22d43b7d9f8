"""A tactile picture compared with its calibration before it is read: corrected, or refused with the reason.

The resting gel of a calibration has a structure of its own: the lights fall on it unevenly. By it a picture's
channel order, orientation, gain and lost parts are known. What a press changed is then compared with the
calibration's shading (``harness.sim.optics.check.slopes``).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, block_means, read_only
from harness.basics.errors import DataRefused, PictureRefused
from harness.sim.optics.check.faults import (
    require_light,
    require_lit,
    require_quiet,
    require_unclipped,
    require_whole,
)
from harness.sim.optics.check.light import LightMatch, fit_light, orientation, same
from harness.sim.optics.check.light_under_contact import light_under_contact, multiplies
from harness.sim.optics.check.slopes import SlopeFit, slope_fit, surface_residual
from harness.sim.optics.check.turned import better_turned, without_drift
from harness.sim.optics.tactile_calibration import TactileCalibration

_BLOCKS = 40
"""Along the longer side."""

_GAINS = (0.4, 2.0)
"""Of a light that is corrected: beyond, grey levels are too coarse or clipped."""

_SAME_GAIN = 0.04
_SAME_GAIN_PRESSED = 0.08
"""Gains this near to 1 are the fit's own error; beside a contact they are known less well."""

_LEAST_ALIKE, _SURE = 0.6, 0.75
"""Shares of a resting picture, and of a reference in another orientation, explained by the light alone."""

_LEAST_EXPLAINED, _LEAST_SURFACE = 0.45, 0.4
"""Of a press, by slopes small enough for linear shading: steep contacts that fill the window have 0.6."""

_FOREIGN = 15.0
"""Grey levels rms that no surface of the gel explains: steep contacts that fill the window leave up to 13."""

_MOSTLY = 0.7
"""Share of a picture in one light, from which no contact can have made it look so."""

_PATTERN = 4.0
"""Grey levels of standard deviation of a resting gel, from which a light is told from a contact by it."""

_PULLED = -0.5
_DEEPEST = 0.85
"""Of a gel's thickness: pressed deeper, faces are steeper than calibrations know, and read too low."""

_TAKE = "take both pictures as the calibration's presses were taken, or calibrate again"


@dataclass(frozen=True, eq=False)
class CheckedPicture:
    """A picture that may be read with its calibration.

    Attributes:
        image: ``(rows, columns, 3)`` RGB as the calibration's light would have shown it.
        background: ``(rows, columns, 3)`` RGB, the untouched gel in that light.
        gain: ``(3,)`` by which the picture's light was divided, 1 where it was not.
        notes: sentences for people about what was corrected.
    """

    image: ByteArray
    background: ByteArray
    gain: FloatArray
    notes: tuple[str, ...] = ()


def checked_picture(
    image: ByteArray, calibration: TactileCalibration, background: ByteArray | None = None
) -> CheckedPicture:
    """Compare a picture with its calibration.

    Args:
        image: ``(rows, columns, 3)`` RGB of a press, of the calibration's shape.
        calibration: of the gel.
        background: ``(rows, columns, 3)`` RGB of the untouched gel in the same light; None for the
            calibration's.

    Raises:
        DataRefused: pictures of another shape or type than the calibration's.
        PictureRefused: no light, part of the picture dark, lost or clipped; another gel, channel order or
            orientation; press and rest exchanged; colours that no pressed gel shows.
    """
    for picture in (image, image if background is None else background):
        if picture.shape != calibration.background.shape or picture.dtype != np.uint8:
            raise DataRefused(
                f"the picture is {picture.dtype} {picture.shape}; this calibration reads uint8 "
                f"{calibration.background.shape}: give the camera's own, not cropped or scaled"
            )
    block = max(1, max(image.shape) // _BLOCKS)
    known = _rest(calibration, block)
    seen = block_means(image, block)
    require_light(seen, known)
    require_unclipped(image, calibration.background)
    require_whole(image, calibration.background)
    rest = known if background is None else block_means(background, block)
    light = None if background is None else _light_of_rest(rest, known)
    if len(calibration.smooth):
        _require_own_orientation(seen, rest, calibration, block)
    if background is None:
        light = _light_of_press(seen, known, calibration, block)
        rest = known if light is None else light.shown(known)
    gain = _gain(light, _SAME_GAIN_PRESSED if background is None else _SAME_GAIN)
    require_lit(seen, rest)
    require_quiet(image, calibration.background if background is None else background)
    _require_press(without_drift(seen - rest) / gain, calibration, block)
    return _corrected(image, calibration, background, light, gain)


def require_within_gel(height: FloatArray, sigma: FloatArray, thickness: float) -> None:
    """Refuse a surface that lies deeper than its gel can be read.

    Args:
        height: ``(rows, columns)`` metres of indentation.
        sigma: ``(rows, columns)`` metres, one standard deviation of each.
        thickness: metres of the gel.

    Raises:
        PictureRefused: some pixel is deeper than 0.85 of the gel by more than two standard deviations.
    """
    beyond = height - 2.0 * sigma
    if beyond.max() > _DEEPEST * thickness:
        at = np.unravel_index(int(np.argmax(beyond)), height.shape)
        raise PictureRefused(
            f"the picture reads {1e3 * height[at]:.2f} mm deep (standard deviation {1e3 * sigma[at]:.2f}) "
            f"in a gel of {1e3 * thickness:.2f} mm, of which {_DEEPEST:.0%} can be read: press less, and "
            "check that the picture is of this sensor"
        )


@lru_cache(maxsize=8)
def _rest(calibration: TactileCalibration, block: int) -> FloatArray:
    return read_only(block_means(calibration.background, block))


def _light_of_rest(rest: FloatArray, known: FloatArray) -> LightMatch:
    light = fit_light(rest, known)
    if light.alike < _LEAST_ALIKE:
        words, other = orientation(rest, known)
        if not same(words) and other.alike > _SURE:
            raise PictureRefused(
                f"the resting picture is the calibration's with {words}: give pictures in the camera's own "
                "channel order and orientation, as the calibration's presses were"
            )
        raise PictureRefused(
            f"the resting picture differs from the calibration's in {1.0 - light.alike:.0%} of its area (at "
            f"most {1.0 - _LEAST_ALIKE:.0%}) by more than one gain and offset a channel: of another gel, "
            f"part of it is dark, or something touched it; {_TAKE}"
        )
    return light


def _light_of_press(
    seen: FloatArray, known: FloatArray, calibration: TactileCalibration, block: int
) -> LightMatch | None:
    """The light that a press was made in; None where that is the calibration's, or not known.

    A tilted face that fills the window changes its colour as another light does: only beside a contact is
    the light the picture's own. Under one it is found across the slopes, by the resting gel's pattern.
    """
    beside = fit_light(seen, known)
    if beside.sure and (np.abs(beside.gain - 1.0) <= _SAME_GAIN_PRESSED).all():
        return None
    patterned = len(calibration.smooth) > 0 and float(known.std(axis=(0, 1)).min()) > _PATTERN
    if not patterned:
        return beside if beside.sure else None
    if beside.tight > _MOSTLY:
        return beside if multiplies(beside, seen, known, calibration, block) else None
    return light_under_contact(seen, known, calibration, block)


def _require_own_orientation(
    seen: FloatArray, rest: FloatArray, calibration: TactileCalibration, block: int
) -> None:
    found = better_turned(seen, rest, calibration, block)
    if found is not None:
        words, turned, as_it_is = found
        raise PictureRefused(
            f"the press fits its resting gel only with {words}: a surface of the gel then leaves "
            f"{turned:.0f} grey levels of it unexplained, and {as_it_is:.0f} as it is; {_TAKE}"
        )


def _gain(light: LightMatch | None, deadband: float) -> FloatArray:
    if light is None:
        return np.ones(3)
    low, high = _GAINS
    if (light.gain < low).any() or (light.gain > high).any():
        shown = ", ".join(f"{value:.2f}" for value in light.gain)
        raise PictureRefused(
            f"the light is {shown} times the calibration's (red, green, blue); {low:g} to {high:g} can be "
            "corrected: set exposure and white balance as they were at the calibration"
        )
    return np.where(np.abs(light.gain - 1.0) <= deadband, 1.0, light.gain)


def _require_press(change: FloatArray, calibration: TactileCalibration, block: int) -> None:
    fit = slope_fit(change, calibration, block)
    if fit is None:
        return
    _require_pressed(fit)
    little = fit.explained < _LEAST_EXPLAINED or fit.surface < _LEAST_SURFACE
    if not little or surface_residual(change, calibration, block) < _FOREIGN:
        return
    if fit.explained < _LEAST_EXPLAINED:
        raise PictureRefused(
            f"slopes explain {fit.explained:.0%} of the press's change of colour (at least "
            f"{_LEAST_EXPLAINED:.0%}): it is of another sensor; {_TAKE}"
        )
    raise PictureRefused(
        f"{fit.surface:.0%} of the press's slopes are the slopes of one surface (at least "
        f"{_LEAST_SURFACE:.0%}): it is of another sensor; {_TAKE}"
    )


def _require_pressed(fit: SlopeFit) -> None:
    if fit.raised < _PULLED:
        raise PictureRefused(
            "by its colours the gel was pulled out, not pressed in: press and resting picture are exchanged, "
            f"or both are upside down; {_TAKE}"
        )


def _corrected(
    image: ByteArray,
    calibration: TactileCalibration,
    background: ByteArray | None,
    light: LightMatch | None,
    gain: FloatArray,
) -> CheckedPicture:
    rest = calibration.background if background is None else background
    if light is None or (gain == 1.0).all():
        return CheckedPicture(image, rest, read_only(np.ones(3)))
    # The change is divided, over the calibration's own background: its noise is none of this picture's.
    known = calibration.background.astype(np.float64)
    shown = light.shown(known) if background is None else background
    moved = known + (image - shown) / gain
    words = ", ".join(f"{value:.2f}" for value in gain)
    note = f"the light is {words} times the calibration's (red, green, blue); the change was divided by it"
    corrected = np.clip(np.rint(moved), 0.0, 255.0).astype(np.uint8)
    return CheckedPicture(read_only(corrected), calibration.background, read_only(gain), (note,))
