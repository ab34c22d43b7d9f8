"""From tactile images back to the shape of the gel: colour to slope, slope to height.

The answer is the gel's surface as the camera sees it, its skirt around the contact included:
compare it with ``gel.deform`` of a prediction, not with the prediction itself.
"""

from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np
from scipy import ndimage

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused, DataRefused, PictureRefused
from harness.sim.optics.check.picture_check import checked_picture
from harness.sim.optics.poisson import anchored_heights, free_heights
from harness.sim.optics.shading import normals_from_colour
from harness.sim.optics.tactile_calibration import TactileCalibration

_NARROW, _WIDE = 5, 25
_RIDGE = 16.0
_DISTRUST = 0.1
_MOSTLY = 0.5

_LEAST_REST = 20
"""Pixels of a quiet region that can be told from a chance calm."""

_FLOOR = 0.05
"""Pixels of height, one sigma, where the gel is at rest."""

_CORRELATED = 2.0
"""Slope errors of neighbours are alike: the calibration's, not the camera's. Chosen so that two
thirds of the pixels of rendered presses lie within one sigma under another calibration."""

_SUNKEN = 3.0
"""Pixels of height: nothing of a pressed gel lies lower than its rest, but for the slopes' errors."""

_SAME_LEVEL = 1.5
"""Pixels of height within which quiet regions are taken to lie at the same level, the rest."""


@dataclass(frozen=True)
class Detection:
    """From how many grey levels on a change of colour is the gel's; lengths over the channels.

    A face tilted by one degree changes the colour by about one grey level, and so does the
    camera's noise: the mean over a window is what is compared.
    """

    quiet: float = 2.5  #: mean of 5 x 5 pixels below which the gel may be at rest.
    strong: float = 8.0  #: mean of 5 x 5 pixels that shows a contact.
    wide: float = 2.5  #: mean of 25 x 25 pixels that shows one too, for flat faces hardly tilted.
    drifting: bool = False
    """whether the light may have changed since the calibration's background was taken; the change that most
    of the picture shares is then taken out, and with it the tilt of a face that fills most of it. Better: a
    fresh background."""


STEADY = Detection()
"""For a background taken just before the contact, by the light of the contact."""

DRIFTING = Detection(quiet=6.0, strong=20.0, wide=12.0, drifting=True)
"""For a background of another day: the published presses differ from theirs by so much far from the ball."""


@dataclass(frozen=True, eq=False)
class Inversion:
    """What the pictures say the gel did."""

    height: FloatArray  #: ``(n, rows, columns)`` metres of indentation, 0 or more, zero outside the imprint.
    contact: BoolArray
    """``(n, rows, columns)`` where the object surely shapes the gel (deeper than the skirt's core share of
    the deepest point)."""
    imprint: BoolArray  #: ``(n, rows, columns)`` where the gel moved at all.
    trusted: BoolArray
    """``(n, rows, columns)`` where the colour was explained by a slope within the calibration's range;
    elsewhere the slope was held or doubtful."""
    error: FloatArray
    """``(n, rows, columns)`` metres, one sigma estimated from colour noise and the calibration's own
    residual."""
    anchored: BoolArray
    """``(n,)`` whether some of the gel was at rest in view; if not, heights are counted from their least."""
    seconds: float  #: for all of them.


def mean_picture(frames: ByteArray) -> ByteArray:
    """``(rows, columns, 3)``: the mean of ``(n, rows, columns, 3)`` frames of one contact.

    Colour is close to linear in slope, so it is the picture of the mean shape: one inversion serves for all.
    """
    return np.asarray(np.rint(frames.mean(axis=0)), dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class GelReading:
    """The surface of the gel in one contact, by the mean picture of its frames."""

    height: FloatArray  #: ``(rows, columns)`` m of indentation; zeros if the picture is refused.
    error: FloatArray  #: ``(rows, columns)`` m, one sigma of ``height``; zeros if the picture is refused.
    refusal: str  #: reason why the picture is not used; empty if it is.
    seconds: tuple[float, float]  #: CPU and wall time of the inversion in s.

    def require_accepted(self) -> None:
        """Raise ``PictureRefused`` if the picture is not what the calibration was made of."""
        if self.refusal:
            raise PictureRefused(self.refusal)


class GelReader:
    """Inverts each picture of a gel once, for all that use its reading.

    Args:
        calibration: calibration of the gel, with a smooth model. Light that differs from its own by a gain
            per channel is corrected; a picture that needs no correction is inverted as it is.
    """

    def __init__(self, calibration: TactileCalibration) -> None:
        _load_kernels(calibration)
        self._calibration = calibration
        self._readings: dict[tuple[tuple[int, ...], bytes], GelReading] = {}

    def read(self, frames: ByteArray) -> GelReading:
        """Return the surface of the gel; it is computed when a picture is first read.

        Args:
            frames: ``(n, rows, columns, 3)`` RGB of one contact that was held still.

        Raises:
            DataRefused: frames of another shape or type than the calibration's.
            CalibrationRefused: the calibration has only a table.
        """
        picture = mean_picture(frames)
        key = picture.shape, picture.tobytes()
        if key not in self._readings:
            self._readings[key] = self._invert(picture)
        return self._readings[key]

    def _invert(self, picture: ByteArray) -> GelReading:
        cpu, wall = process_time(), perf_counter()
        refusal, height = "", read_only(np.zeros(picture.shape[:2]))
        error = height
        try:
            shown = checked_picture(picture, self._calibration, allow_wide=True).image
            found = invert(shown[None], self._calibration)
            height, error = found.height[0], found.error[0]
        except PictureRefused as reason:
            refusal = str(reason)
        return GelReading(height, error, refusal, (process_time() - cpu, perf_counter() - wall))


def invert(images: ByteArray, calibration: TactileCalibration, detection: Detection = STEADY) -> Inversion:
    """Recover the surface of a flat gel from pictures of it.

    Args:
        images: ``(n, rows, columns, 3)`` RGB.
        calibration: with a smooth model.
        detection: what counts as a change.

    Raises:
        DataRefused: images of another shape or type than the calibration's.
        CalibrationRefused: the calibration has only a table.
    """
    shape = calibration.background.shape
    if images.ndim != 4 or images.shape[1:] != shape or images.dtype != np.uint8:
        raise DataRefused(
            f"images are {images.dtype} {images.shape}; this calibration reads uint8 (n, *{shape})"
        )
    if len(calibration.smooth) == 0:
        raise CalibrationRefused(
            "this calibration has no smooth model to invert; fit it again from its presses"
        )
    began = perf_counter()
    answers = [_invert_one(image, calibration, detection) for image in images]
    height, contact, imprint, trusted, error, anchored = (
        np.array([answer[k] for answer in answers]).reshape(len(images), *([] if k == 5 else shape[:2]))
        for k in range(6)
    )
    return Inversion(
        read_only(height),
        read_only(contact.astype(np.bool_)),
        read_only(imprint.astype(np.bool_)),
        read_only(trusted.astype(np.bool_)),
        read_only(error),
        read_only(anchored.astype(np.bool_)),
        perf_counter() - began,
    )


_LOADED: set[bool] = set()
"""True once this process has loaded the kernels of an inversion."""


def _load_kernels(calibration: TactileCalibration) -> None:
    """Compile or load the kernels, so that the seconds of no reading count it: invert a bright disc."""
    if _LOADED or len(calibration.smooth) == 0:
        return
    _LOADED.add(True)
    rows, columns = np.indices(calibration.background.shape[:2])
    far = np.hypot(rows - rows.mean(), columns - columns.mean())
    disc = np.where(far < 0.2 * rows.max(), 40.0, 0.0)[..., None]
    picture = np.clip(calibration.background + disc, 0.0, 255.0).astype(np.uint8)
    invert(picture[None], calibration)


_Answer = tuple[FloatArray, BoolArray, BoolArray, BoolArray, FloatArray, bool]


def _invert_one(image: ByteArray, calibration: TactileCalibration, detection: Detection) -> _Answer:
    header = calibration.header
    change = image.astype(np.float64) - calibration.background
    if detection.drifting:
        hardly = np.sqrt((change**2).sum(axis=2)) < detection.wide
        if hardly.mean() >= _MOSTLY:
            change = change - np.median(change[hardly], axis=0)
    strength = _strength(change, _NARROW)
    quiet = strength < detection.quiet
    if strength.max() < detection.strong and _strength(change, _WIDE).max() < detection.wide:
        nothing = np.zeros(quiet.shape)
        nowhere = np.zeros(quiet.shape, np.bool_)
        return nothing, nowhere, nowhere, ~nowhere, nothing + _FLOOR * header.pitch, True
    noise = header.residual_rms
    normal, fit = np.empty((*quiet.shape, 2)), np.empty((*quiet.shape, 2))
    normals_from_colour(change, calibration.smooth, header.slope_limit, noise, _RIDGE, normal, fit)
    flatness = np.sqrt(1.0 - normal[..., 0] ** 2 - normal[..., 1] ** 2)
    right, down = -normal[..., 0] / flatness, -normal[..., 1] / flatness
    trusted = (fit[..., 0] < 3.0 * noise) & (flatness > np.sqrt(1.0 - (0.98 * header.slope_limit) ** 2))
    heights = free_heights(down, right)
    rest = _resting(heights, quiet)
    level = float(heights[rest].mean()) if rest.any() else float(heights.min())
    heights -= level
    if rest.any():
        anchored_heights(heights, down, right, np.where(trusted, 1.0, _DISTRUST), rest)
    height = np.maximum(heights, 0.0) * header.pitch
    contact = height > header.skirt.core * height.max()
    spread = fit[..., 1] / flatness**3 * np.hypot(1.0, np.maximum(fit[..., 0], 0.2 * noise))
    # Independent slope errors add up along the way from where the height is known.
    way = ndimage.distance_transform_edt(~rest) if rest.any() else np.full(rest.shape, float(max(rest.shape)))
    variance = ndimage.uniform_filter(spread**2, size=2 * _NARROW + 1, mode="nearest")
    error: FloatArray = header.pitch * np.hypot(
        _FLOOR, np.where(rest, 0.0, np.sqrt(variance * way) * _CORRELATED)
    )
    return height, contact, ~rest, trusted, error, bool(rest.any())


def _strength(change: FloatArray, window: int) -> FloatArray:
    smooth = ndimage.uniform_filter(change, size=(window, window, 1), mode="nearest")
    strength: FloatArray = np.sqrt((smooth**2).sum(axis=2))
    return strength


def _resting(heights: FloatArray, quiet: BoolArray) -> BoolArray:
    """The quiet regions at the lowest level; quiet regions above it are flat parts of the contact."""
    inner = ndimage.binary_erosion(quiet, iterations=2, border_value=1)
    labels, count = ndimage.label(inner)
    if count == 0:
        return np.zeros(quiet.shape, np.bool_)
    names = np.arange(1, count + 1)
    sizes = ndimage.sum_labels(inner, labels, names)
    levels = ndimage.mean(heights, labels, names)
    large = sizes >= _LEAST_REST
    if not large.any():
        return np.zeros(quiet.shape, np.bool_)
    lowest = levels[large].min()
    if lowest > np.percentile(heights, 2) + _SUNKEN:
        return np.zeros(quiet.shape, np.bool_)
    at_rest = np.concatenate([[False], levels < lowest + _SAME_LEVEL])
    resting: BoolArray = at_rest[labels]
    return resting
