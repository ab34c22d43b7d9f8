"""Compare a tactile picture with its resting picture and its calibration; correct or refuse it.

A press is compared with a picture of the untouched gel, its own or the calibration's, and its own resting
picture with the calibration's. The gel's resting pattern gives the change of the light, the channel order and
the orientation of each pair (``harness.sim.optics.check.light``). The change of colour that the press made is
then compared with the calibration's shading.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.ndimage import uniform_filter

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, block_means, read_only
from harness.basics.errors import DataRefused, PictureRefused
from harness.sim.optics.check.light import (
    LightMatch,
    better_turned,
    channel_orders,
    fit_models,
    in_words,
    linear_shading,
    match_light,
    simplest_match,
    slope_fit,
    surface_residual,
    turns,
    without_drift,
)
from harness.sim.optics.poisson import free_heights
from harness.sim.optics.tactile_calibration import TactileCalibration

_BLOCKS = 40
"""Along the longer side."""

_GAINS = (0.4, 2.0)
"""Gains of a light that is corrected: outside, grey levels are too coarse or clipped."""

_MAX_OFFSET = 60.0
"""Grey levels of an offset that is corrected; a gamma of 1.5 is like 55."""

_CLOSE_AT_REST = 6.0
"""Grey levels within which a resting picture of another day agrees with the calibration's."""

_MIN_EXPLAINED_AT_REST = 0.4
"""Weight of the blocks of a resting picture that have to agree with the calibration's in some light."""

_SAME_PRESS = 16.0
"""Grey levels, length over the channels, within which a block is the same in two frames of one press."""

_MAX_CHANGED = 0.01
"""Share of blocks that may differ between two frames of one press, e.g. where a marker moves."""

_CLEAR = 0.25
"""Weight of the blocks from which the light is compared closely."""

_FAR_BETTER = 2.0
"""Times the blocks that agree in the same light, from which another one is used beside a wide contact."""

_MOST_IN_DOUBT = 0.5
"""Weight of the blocks that agree with another light, from which it may not be the colours of a contact."""

_SAME_EXPOSURE = 0.1
"""Share by which a wide contact may change the brightness of a picture; a face changes its colours more."""

_SIMPLE = 3
"""Models of the light, without those that would follow what a contact does to its surroundings."""

_LEAST_TOUCHED = 0.03
"""Fraction of the blocks that show a contact of their own beside a change of the light."""

_MIN_TILT_CHANGE = 0.7
"""Grey levels, length over the channels: a face that changes less is 0.1 mm from side to side."""

_MAX_UNEXPLAINED, _MAX_RELIEF = 0.1, 3.5e-3
"""Share of a change (grey levels squared) that slopes leave, and m between its highest and lowest point: a
contact within these changes the colours in the same way."""

_MAX_CLIPPED = 0.1
"""Fraction of the contact's values; real presses have 0.04. At 0.18 a depth of 0.6 mm is 0.04 mm too low."""

_VARIANT_BETTER = 0.15
"""Weight of the blocks that another channel order or orientation has to explain more, to be reported."""

_LEAST_EXPLAINED, _LEAST_SURFACE = 0.45, 0.4
"""Of a press, by slopes small enough for linear shading: steep contacts that fill the window have 0.6."""

_FOREIGN = 15.0
"""Grey levels rms that no surface of the gel explains: steep contacts that fill the window leave up to 13."""

_UNKNOWN_LIGHT = 3.0
"""Grey levels by which the light may differ where no gel at rest is in view: 2 %, as exposures vary."""

_SURROUNDINGS = 8.0
"""Grey levels, length over the channels, from which a block is the contact's and not its surroundings'."""

_SMOOTH = 5
"""Blocks over which the light is smooth, and the camera's noise is not."""

_PULLED = -0.5

_DEEPEST = 0.85
"""Of a gel's thickness: pressed deeper, faces are steeper than calibrations know, and read too low."""

_TAKE = "take both pictures as the calibration's presses were taken, or calibrate again"

_LOST = 8
"""Pixels a side of a square that is one colour to the last bit: no camera's noise leaves one."""

_DARKEST = 0.62
"""Of the resting gel in every channel, that a press leaves of a block's light; real presses leave 0.77."""

_MOST_DARK = 0.02
_MOST_LOST = 0.01
_NO_LIGHT = 0.2

_MOST_CLIPPED = 0.08
"""Share of values clipped beyond those of the calibration's background; real presses have up to 0.06."""

_MOST_NOISE = 12.0
"""Grey levels from pixel to pixel: camera noise of 9."""


@dataclass(frozen=True, eq=False)
class CheckedPicture:
    """A picture that may be read with its calibration."""

    image: ByteArray
    """``(rows, columns, 3)`` RGB as the calibration's light would have shown it."""
    background: ByteArray
    """``(rows, columns, 3)`` RGB, the untouched gel in that light."""
    gain: FloatArray
    """``(3,)``: mean gain by which the change of colour was divided, 1 where it was not."""
    light_error: float
    """Grey levels rms by which the light around the contact still differs from the resting picture's."""
    agrees: bool
    """True where the surroundings of the contact agree with the resting picture to a grey level."""
    notes: tuple[str, ...] = ()
    """Sentences for the operator about the corrections."""


def checked_picture(
    image: ByteArray,
    calibration: TactileCalibration,
    background: ByteArray | None = None,
    allow_wide: bool = False,
) -> CheckedPicture:
    """Compare a picture with its resting picture and its calibration.

    Args:
        image: ``(rows, columns, 3)`` RGB of a press, of the calibration's shape.
        calibration: of the gel.
        background: ``(rows, columns, 3)`` RGB of the untouched gel just before the press; None for the
            calibration's.
        allow_wide: whether a contact that fills the view, which cannot be told from another white balance, is
            read in the resting picture's light instead of being refused: for shapes, not for depths.

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
    untouched = calibration.background if background is None else background
    rest = block_means(untouched, block)
    for levels, picture in ((seen, image), (rest, untouched)):
        _require_light(levels, known)
        _require_unclipped(picture, calibration.background)
        require_whole(picture, calibration.background)
    rest_light = match_light(known, known) if background is None else _light_of_rest(rest, known)
    light, agrees, doubt, refusal = _settled_light(
        seen, rest, calibration, block, background is not None, allow_wide
    )
    gain = light.gain(*image.shape[:2]) * rest_light.gain(*image.shape[:2])
    _require_gain(gain, light.offset + rest_light.offset)
    shown = np.clip(light.apply(rest), 0.0, 255.0)
    _require_lit(seen, shown)
    _require_quiet(image, untouched)
    _require_colours(image, untouched, np.linalg.norm(seen - shown, axis=2) > _SURROUNDINGS, block)
    light_error = _light_error(light, _SURROUNDINGS if agrees else 3.0 * _CLOSE_AT_REST)
    light_error = max(light_error, doubt)
    if len(calibration.smooth):
        _require_own_orientation(seen, shown, calibration, block)
        if refusal:
            raise PictureRefused(refusal)
        coarse = light.gain(*rest.shape[:2]) * rest_light.gain(*rest.shape[:2])
        _require_press(without_drift(seen - shown) / coarse, calibration, block)
    assumed = not agrees and light.name == "same" and doubt > 0.0
    notes = _notes(light, rest_light, background is not None, assumed)
    if light.name == rest_light.name == "same":
        return CheckedPicture(image, untouched, read_only(np.ones(3)), light_error, agrees, notes)
    # The change is divided, over the calibration's own background: its noise is none of this picture's.
    moved = (
        calibration.background
        + (image - np.clip(light.apply(untouched.astype(np.float64)), 0.0, 255.0)) / gain
    )
    corrected = np.clip(np.rint(moved), 0.0, 255.0).astype(np.uint8)
    return CheckedPicture(
        read_only(corrected),
        calibration.background,
        read_only(gain.mean(axis=(0, 1))),
        light_error,
        agrees,
        notes,
    )


def _require_colours(image: ByteArray, untouched: ByteArray, touched: BoolArray, block: int) -> None:
    """Refuse a press of which the contact's own colours are clipped where the resting picture's are not."""
    clipped = ((image == 0) | (image == 255)) & (untouched > 0) & (untouched < 255)
    share = block_means(clipped.astype(np.float64), block)[touched]
    if len(share) and share.mean() > _MAX_CLIPPED:
        raise PictureRefused(
            f"{share.mean():.0%} of the contact's colours are at 0 or 255 (at most {_MAX_CLIPPED:.0%}): its "
            "slopes cannot be read; set exposure and gain as they were at the calibration"
        )


def _require_own_orientation(
    seen: FloatArray, shown: FloatArray, calibration: TactileCalibration, block: int
) -> None:
    """Refuse a press that another channel order or orientation makes a far better surface of the gel."""
    found = better_turned(seen, shown, calibration, block)
    if found is not None:
        words, turned, as_it_is = found
        raise PictureRefused(
            f"the press fits its resting gel only with {words}: a surface of the gel then leaves "
            f"{turned:.0f} grey levels of it unexplained, and {as_it_is:.0f} as it is; {_TAKE}"
        )


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


def require_one_press(frames: ByteArray) -> None:
    """Refuse frames that show different presses: the depth of their mean is that of none of them.

    Args:
        frames: ``(n, rows, columns, 3)`` RGB of one sensor.

    Raises:
        PictureRefused: a frame differs from the first by more than its light.
    """
    block = max(1, max(frames.shape[1:3]) // _BLOCKS)
    first = block_means(frames[0], block)
    for number, frame in enumerate(frames[1:], 2):
        seen = block_means(frame, block)
        shown = np.clip(match_light(seen, first).apply(first), 0.0, 255.0)
        changed = float((np.linalg.norm(seen - shown, axis=2) > _SAME_PRESS).mean())
        if changed > _MAX_CHANGED:
            raise PictureRefused(
                f"frame {number} of {len(frames)} differs from the first in {changed:.0%} of its area (at "
                f"most {_MAX_CHANGED:.0%}) by more than its light: give the frames of one press that was "
                "held still"
            )


@lru_cache(maxsize=8)
def _rest(calibration: TactileCalibration, block: int) -> FloatArray:
    return read_only(block_means(calibration.background, block))


def _light_of_rest(rest: FloatArray, known: FloatArray) -> LightMatch:
    """Return the light of a resting picture in terms of the calibration's."""
    light = match_light(rest, known)
    if light.explained < _MIN_EXPLAINED_AT_REST:
        light = match_light(rest, known, _CLOSE_AT_REST)
    if light.explained >= _MIN_EXPLAINED_AT_REST:
        return light
    # Find the channel order and orientation of the reference that explain a picture best, and its light.
    matches = [
        (in_words(exchanged, words), match_light(rest[::2, ::2], turned[::2, ::2, channels], _CLOSE_AT_REST))
        for exchanged, channels in channel_orders()
        for words, turned in turns(known).items()
    ]
    words, other = max(
        matches, key=lambda found: found[1].explained if (found[1].slope[0] > 0.2).all() else 0.0
    )
    if words and other.explained > light.explained + _VARIANT_BETTER:
        raise PictureRefused(
            f"the resting picture fits the calibration's only with {words}: give pictures in the camera's "
            "own channel order and orientation, as the calibration's presses were"
        )
    raise PictureRefused(
        f"the resting picture differs from the calibration's in {1.0 - light.explained:.0%} of its area (at "
        f"most {1.0 - _MIN_EXPLAINED_AT_REST:.0%}) by more than one gain and offset per channel: it is of "
        f"another gel, part of it is dark, or something touched it; {_TAKE}"
    )


def _light_of_press(seen: FloatArray, rest: FloatArray) -> tuple[LightMatch, bool]:
    """Return the light of a press in terms of its resting picture's, and whether it agrees closely."""
    matches = tuple(fit_models(seen, rest))
    light = simplest_match(matches)
    if light.explained >= _CLEAR:
        return light, True
    # Real gels change their colour around a contact, and a resting picture of another day differs by more.
    # Where a contact fills most of the view, some of its own colours agree with some gain as well.
    light, same = simplest_match(matches[:2]), matches[0]
    light = light if light.explained > _FAR_BETTER * same.explained else same
    loose = match_light(seen, rest, _CLOSE_AT_REST, _SIMPLE)
    if loose.explained < (_MIN_EXPLAINED_AT_REST if light.is_known else _CLEAR):
        return light, light.is_known
    change = np.linalg.norm(loose.apply(rest) - rest, axis=2).mean()
    return (loose if change > _CLOSE_AT_REST else match_light(seen, rest, _CLOSE_AT_REST, 1)), False


def _settled_light(
    seen: FloatArray,
    rest: FloatArray,
    calibration: TactileCalibration,
    block: int,
    has_own_rest: bool,
    allow_wide: bool,
) -> tuple[LightMatch, bool, float, str]:
    """Return the light to read a press in, whether it agrees closely, grey levels in doubt, and a refusal.

    A face pressed over the whole view changes the colours much as another white balance does. Where most of
    the view agrees closely with another light, the two cannot be told apart; where less does, the light of
    the resting picture is the likelier one. The refusal is empty where the light can be told, or is assumed.
    """
    light, agrees = _light_of_press(seen, rest)
    if not len(calibration.smooth):
        return light, agrees, 0.0, ""
    touched = np.linalg.norm(seen - np.clip(light.apply(rest), 0.0, 255.0), axis=2) > _SURROUNDINGS
    edge = np.concatenate([touched[0], touched[-1], touched[:, 0], touched[:, -1]])
    stands_out = bool(touched.mean() > max(_LEAST_TOUCHED, edge.mean()))
    change = light.apply(rest) - rest if agrees else seen - rest
    size, relief = _tilt_like_change(change, rest, calibration, block)
    doubtful = size > 0.0 if agrees else not stands_out and (size > 0.0 or has_own_rest)
    doubt = size / float(np.sqrt(3.0))
    if not doubtful:
        return light, agrees, doubt, ""
    exposure = float(light.apply(rest).mean() / rest.mean())
    is_little = size < _UNKNOWN_LIGHT or light.explained < _MOST_IN_DOUBT
    if allow_wide and abs(exposure - 1.0) < _SAME_EXPOSURE and (is_little or not agrees):
        return match_light(seen, rest, models=1), False, max(_UNKNOWN_LIGHT, doubt), ""
    whole = max(size, float(np.linalg.norm(seen - rest, axis=2).mean()))
    face = f" ({1e3 * relief:.1f} mm from its highest to its lowest point)" if relief > 0.0 else ""
    refusal = (
        f"the whole picture differs from the resting picture by {whole:.1f} grey levels, as "
        f"another white balance or a face over the whole view{face} does: fix the white balance, "
        "take a resting picture just before the press, and leave some of the gel free"
    )
    return light, agrees, doubt, refusal


def _tilt_like_change(
    change: FloatArray, rest: FloatArray, calibration: TactileCalibration, block: int
) -> tuple[float, float]:
    """Return how much of a change of the picture a face pressed over the whole view could have made.

    Slopes cannot change all three colours by one gain or offset, as an exposure does. What remains of the
    change without that is compared with the slopes of a surface as deep as a gel is thick.

    Args:
        change: ``(rows, columns, 3)`` grey levels, means over blocks.
        rest: the same, of the resting picture.
        calibration: with a smooth model.
        block: pixels per side of a block.

    Returns:
        Grey levels, length over the channels, and m between the highest and the lowest point of the face;
        zeros where no such face explains the change.
    """
    shading, inverse = linear_shading(calibration, block)
    across = np.cross(shading[..., 0, :], shading[..., 1, :])
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
    exposure = np.stack([(across * rest).sum(axis=2).ravel(), across.sum(axis=2).ravel()], axis=1)
    by_exposure = np.linalg.lstsq(exposure, (across * change).sum(axis=2).ravel(), rcond=None)[0]
    change = change - by_exposure[0] * rest - by_exposure[1]
    unexplained = (across * change).sum(axis=2)
    size = float(np.sqrt((change**2).sum(axis=2).mean()))
    if size < _MIN_TILT_CHANGE or (unexplained**2).mean() > _MAX_UNEXPLAINED * size**2:
        return 0.0, 0.0
    normal = np.einsum("ijac,ijc->ija", inverse, change)
    heights = free_heights(-normal[..., 1], -normal[..., 0])
    relief = float(np.ptp(heights)) * block * calibration.header.pitch
    return (size, relief) if relief < _MAX_RELIEF else (0.0, 0.0)


def _require_gain(gain: FloatArray, offset: FloatArray) -> None:
    if np.abs(offset).max() > _MAX_OFFSET:
        shown = ", ".join(f"{value:+.0f}" for value in offset)
        raise PictureRefused(
            f"the light differs from the calibration's by {shown} grey levels (red, green, blue; at most "
            f"{_MAX_OFFSET:g}): set exposure, gamma and black level as they were at the calibration"
        )
    low, high = _GAINS
    if gain.min() < low or gain.max() > high:
        shown = ", ".join(f"{value:.2f}" for value in gain.mean(axis=(0, 1)))
        raise PictureRefused(
            f"the light is {shown} times the calibration's (red, green, blue); {low:g} to {high:g} can be "
            "corrected: set exposure and white balance as they were at the calibration"
        )


def _notes(
    light: LightMatch, rest_light: LightMatch, has_own_rest: bool, is_assumed: bool
) -> tuple[str, ...]:
    notes = []
    if rest_light.name != "same":
        notes.append(
            f"the light of the resting picture differs from the calibration's by {_in_words(rest_light)}; "
            "the reading is corrected for it"
        )
    if light.name != "same":
        notes.append(
            f"the light changed between the resting picture and the press by {_in_words(light)}; the "
            "reading is corrected for it"
        )
    if is_assumed or not light.is_known:
        notes.append(
            f"{light.explained:.0%} of the press agrees with the resting picture, too little to compare "
            "their light: the contact fills the view or the light is uneven; the same light is assumed"
        )
    if not has_own_rest:
        notes.append(
            "no resting picture was given: the press is compared with the calibration's; one taken just "
            "before the press (--background) is more accurate"
        )
    return tuple(notes)


def _in_words(light: LightMatch) -> str:
    gains = ", ".join(f"{value:.3f}" for value in light.slope[0])
    offsets = ", ".join(f"{value:+.1f}" for value in light.offset)
    if light.name == "offset":
        return f"{offsets} grey levels (red, green, blue)"
    if light.name == "gain and offset":
        return f"a gain of {gains} and {offsets} grey levels (red, green, blue)"
    uneven = " at the centre, uneven over the picture" if light.name == "uneven gain" else ""
    return f"a gain of {gains} (red, green, blue){uneven}"


def _light_error(light: LightMatch, most: float) -> float:
    """Return the grey levels rms by which the surroundings of the contact differ smoothly from the light."""
    if not light.is_known:
        return _UNKNOWN_LIGHT
    smooth = uniform_filter(light.residual, size=(_SMOOTH, _SMOOTH, 1), mode="nearest")
    around = np.linalg.norm(light.residual, axis=2) < most
    return float(np.sqrt((smooth[around] ** 2).mean())) if around.any() else _UNKNOWN_LIGHT


def _require_press(change: FloatArray, calibration: TactileCalibration, block: int) -> None:
    fit = slope_fit(change, calibration, block)
    if fit is None:
        return
    if fit.raised < _PULLED:
        raise PictureRefused(
            "by its colours the gel was pulled out, not pressed in: press and resting picture are exchanged, "
            f"or both are upside down; {_TAKE}"
        )
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


def _require_light(seen: FloatArray, known: FloatArray) -> None:
    """Refuse a picture that is almost black compared with its calibration's resting picture."""
    left = float(seen.sum() / max(float(known.sum()), 1.0))
    if left < _NO_LIGHT:
        raise PictureRefused(
            f"the picture has {left:.0%} of the calibration's light (at least {_NO_LIGHT:.0%}): the sensor's "
            "lights are off, or the camera sent no picture; check its cable and exposure"
        )


def require_whole(image: ByteArray, known: ByteArray) -> None:
    """Refuse a picture of which a part was lost on its way.

    Args:
        image: ``(rows, columns, 3)`` RGB.
        known: the same, of the resting gel.

    Raises:
        PictureRefused: with the share of the picture and what to do.
    """
    flat = _flat(image)
    lost = float((flat & ~_flat(known)).mean()) if flat.any() else 0.0
    if lost > _MOST_LOST:
        raise PictureRefused(
            f"{lost:.0%} of the picture is one colour without any noise (at most {_MOST_LOST:.0%}): part of "
            "the frame was lost on its way; take another"
        )


def _require_unclipped(image: ByteArray, known: ByteArray) -> None:
    """Refuse a picture with far more clipped pixels than its calibration's background."""
    clipped = _clipped(image) - _clipped(known)
    if clipped > _MOST_CLIPPED:
        raise PictureRefused(
            f"{clipped:.0%} more of the picture's values are at 0 or 255 than of the calibration's (at most "
            f"{_MOST_CLIPPED:.0%}): set exposure and gain as they were at the calibration"
        )


def _require_quiet(image: ByteArray, rest: ByteArray) -> None:
    """Refuse colours that change randomly between pixels, e.g. by a bad cable or a camera without light."""
    jump = float(np.median(np.abs(np.diff(image[::8].astype(np.int16) - rest[::8], axis=1))))
    if jump > _MOST_NOISE:
        raise PictureRefused(
            f"colours change by {jump:.0f} grey levels from pixel to pixel in the median (at most "
            f"{_MOST_NOISE:.0f}): the picture is noise; check light, gain and cable, or average more frames"
        )


def _require_lit(seen: FloatArray, rest: FloatArray) -> None:
    """Refuse a picture with a region that is darker or brighter in every channel than any press."""
    ratio = (seen + 1.0) / (rest + 1.0)
    dark = float((ratio.max(axis=2) < _DARKEST).mean())
    bright = float((ratio.min(axis=2) > 1.0 / _DARKEST).mean())
    if max(dark, bright) > _MOST_DARK:
        raise PictureRefused(
            f"{max(dark, bright):.0%} of the picture is {'darker' if dark > bright else 'brighter'} in every "
            f"channel than a press makes the gel (beyond a factor of {_DARKEST:g}): part of the lights "
            "is off, something lies before the camera, or press and rest are of different lights"
        )


def _flat(image: ByteArray) -> BoolArray:
    """``(rows, columns)`` of the squares that are one colour to the last bit."""
    rows, columns = image.shape[0] // _LOST, image.shape[1] // _LOST
    strips = image[: rows * _LOST, : columns * _LOST].reshape(rows, _LOST, -1)
    shape = (rows, columns, _LOST, 3)
    least, most = strips.min(axis=1), strips.max(axis=1)
    if not (least == most).any():
        return np.zeros((rows, columns), np.bool_)
    least, most = least.reshape(shape), most.reshape(shape)
    return np.asarray((least.min(axis=2) == most.max(axis=2)).all(axis=2))


def _clipped(image: ByteArray) -> float:
    return np.count_nonzero((image == 0) | (image == 255)) / image.size
