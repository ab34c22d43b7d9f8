"""Read the gel's surface from a live picture, with its error at every pixel, and its points in a tool frame.

Two colour errors cause height errors. The camera's noise is independent between pixels and hardly adds up.
The calibration's misfit is the same wherever the gel has the same slope, so it adds up along every face;
it is sampled as a random smooth function of the normal. Each sample becomes an error of slope by the linear
part of the colour's inversion, and an error of height by the same least squares as the heights,
on blocks of pixels, since height errors are smooth. The standard deviation is that of the samples.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from time import process_time

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates, uniform_filter, zoom

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused, PictureRefused
from harness.basics.geometry import apply
from harness.picture.square_pixels import aspect_stated, made_square
from harness.sim.gel.contact_force import ContactForce, ForceLevel, contact_force, pressed_of_gel
from harness.sim.gel.elastic import GelElastic
from harness.sim.optics.check.picture_check import (
    checked_picture,
    require_one_press,
    require_within_gel,
)
from harness.sim.optics.contact_depth import TOUCHED, Depth, read_depth
from harness.sim.optics.inverse import DRIFTING, Detection, Inversion, mean_picture
from harness.sim.optics.poisson import anchored_heights, free_heights
from harness.sim.optics.shading import normals_from_colour, shades
from harness.sim.optics.tactile_calibration import ColourMisfit, TactileCalibration, with_background

_RIDGE = 16.0
"""Variance in squared grey levels, as in the inversion."""

_HELD = 0.98
"""A slope above this fraction of the slope limit counts as clamped."""

_DISTRUST = 0.1
"""Weight of slopes that are not trusted, as in the solve for the heights."""

_NODES = 49
"""Number of nodes per side of the plane of normals."""

_SOLVED = 80
"""Blocks along the longer side: errors of height are smooth, and a solve costs as the cube of this."""

_STRANGE = 2.0
"""Times the calibration's residual from which a colour is none of its presses', but dirt or a shadow."""

_WINDOW = 5

_FLOOR = 0.05
"""Standard deviation of the height in pixels where the gel is at rest."""


@dataclass(frozen=True)
class ColourError:
    """Errors of the colours."""

    camera: float = 1.5  #: grey levels rms, from pixel to pixel.
    alike: float = 0.15
    """sine of the slope over which the calibration's misfit is alike (a Gaussian's sigma), where its file
    does not state it."""
    share: float = 0.4
    """of the calibration's residual that is misfit, and not texture or noise, where its file does not state
    what held-out presses showed."""
    dimming: float = 0.3  #: share by which a contact may be darker or brighter than the calibration's were.
    draws: int = 32  #: how many; the spread of 32 is known to an eighth.
    light: float = 0.0
    """grey levels rms by which the light of the picture differs from that of its resting picture, alike over
    the picture or growing from one side of it to the other."""


USUAL = ColourError()


@dataclass(frozen=True, eq=False)
class HeightErrors:
    """Equally likely errors of one recovered surface."""

    draws: FloatArray  #: ``(draws, rows, columns)`` metres.
    floor: float  #: metres, one sigma, added to all of them.

    @property
    def sigma(self) -> FloatArray:
        """``(rows, columns)`` metres, one standard deviation of each pixel's height."""
        return np.asarray(np.hypot(np.sqrt(np.mean(self.draws**2, axis=0)), self.floor))


class _Slopes:
    """Draws errors of the slope on blocks of pixels, given how the colour at their middle was explained."""

    def __init__(
        self,
        image: ByteArray,
        by: TactileCalibration,
        dimming: FloatArray,
        still: BoolArray,
        block: int,
        assumed: ColourError,
    ) -> None:
        header = by.header
        change = image.astype(np.float64) - by.background
        normal, fit = np.empty((*change.shape[:2], 2)), np.empty((*change.shape[:2], 2))
        noise = header.residual_rms
        normals_from_colour(change, by.smooth, header.slope_limit, noise, _RIDGE, normal, fit)
        rows, columns = change.shape[:2]
        place = np.minimum(np.argwhere(~still) * block + block // 2, (rows - 1, columns - 1))
        misfit = header.misfit or ColourMisfit(assumed.share * noise, assumed.alike)
        self._where, self._camera, self._alike = ~still, assumed.camera / block, misfit.alike
        across = 2.0 * place / (rows, columns) - 1.0
        # Of unit variance over the picture: one third of it for each direction, and the rest alike.
        self._light = assumed.light * np.sqrt(0.6) * np.column_stack([np.ones(len(place)), across])
        self._dimming = assumed.dimming * dimming[place[:, 0], place[:, 1]].T
        self._normal = normal[place[:, 0], place[:, 1]]
        shade, slope = np.empty((len(place), 3)), np.empty((len(place), 3, 2))
        shades(by.smooth, self._normal, place, rows, columns, shade, slope)
        bent = np.einsum("pca,pcb->pab", slope, slope) + _RIDGE * np.eye(2)
        self._gain = np.linalg.solve(bent, slope.transpose(0, 2, 1))
        # Two of three colours are taken up by the slope: what is left over shows a third of the error.
        # The filter's running sum may leave a little below zero where nothing is left over.
        around = uniform_filter(fit[..., 0] ** 2, _WINDOW, mode="nearest")
        left = np.sqrt(3.0 * np.maximum(around, 0.0))
        left = left[place[:, 0], place[:, 1]]
        self._misfit = np.where(left > _STRANGE * noise, np.maximum(left, misfit.rms), misfit.rms)
        size = np.hypot(*self._normal.T)
        held = size > _HELD * header.slope_limit
        # Held at the limit, the sine may be anything from there to one.
        self._beyond = np.where(
            held, (1.0 - header.slope_limit) / np.sqrt(12.0) / np.maximum(size, 1e-9), 0.0
        )
        self._flat = np.sqrt(np.maximum(1.0 - size**2, 1e-4))

    def drawn(self, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """One error of the slope, down and right, ``(blocks down, blocks right)`` each."""
        width = self._alike * 0.5 * (_NODES - 1)
        noise = gaussian_filter(rng.normal(size=(4, _NODES, _NODES)), (0.0, width, width), mode="wrap")
        noise /= _smoothed_deviation(width)
        at = 0.5 * (self._normal.T + 1.0) * (_NODES - 1)
        fields = np.stack([map_coordinates(one, at, order=1, mode="nearest") for one in noise])
        colour = self._misfit * fields[:3] + rng.normal(0.0, self._camera, (3, len(self._flat)))
        colour += rng.normal() * self._dimming
        if self._light.any():
            colour += rng.normal(size=(3, 3)) @ self._light.T
        by_colour = np.einsum("pac,cp->ap", self._gain, colour)
        normal = self._normal.T
        moved = by_colour + normal * (self._beyond * fields[3])
        along = (normal * moved).sum(axis=0) / self._flat**2
        right, down = -(moved + normal * along) / self._flat
        return self._spread(down), self._spread(right)

    def _spread(self, values: FloatArray) -> FloatArray:
        picture = np.zeros(self._where.shape)
        picture[self._where] = values
        return picture


@lru_cache(maxsize=8)
def _smoothed_deviation(width: float) -> float:
    """Return the standard deviation that noise of unit variance keeps when smoothed over ``width`` nodes."""
    impulse = np.zeros((_NODES, _NODES))
    impulse[_NODES // 2, _NODES // 2] = 1.0
    return float(np.sqrt(np.mean(gaussian_filter(impulse, width, mode="wrap") ** 2)) * _NODES)


_THICKEST = 5e-3
"""Metres of a gel whose thickness is not known: the thickest of the sensors that come with the program."""

_SURROUNDINGS = 0.25
"""Share of the depth, one standard deviation, that surroundings of another colour may add. Real balls of
known radius read 2.0 to 2.6 mm deep where the radius of their contact gives 1.0 to 1.6 mm."""


_OTHER_SHARES = (0.05, 0.2)
"""Of the deepest pixel, from which the gel might be taken to be pressed as well."""


@dataclass(frozen=True, eq=False)
class DepthReading:
    """What one press did to the gel."""

    image: ByteArray  #: ``(rows, columns, 3)`` RGB that was read, its pixels square.
    height: FloatArray  #: ``(rows, columns)`` metres of indentation, 0 or more.
    sigma: FloatArray  #: ``(rows, columns)`` metres, one standard deviation of each height.
    depth: Depth  #: the reading with all it says of itself.
    pitch: float  #: metres a pixel.
    aspect: float  #: by which the picture was made square; 1 where it was.
    seconds: tuple[float, float]  #: of the processor, reading and its error.
    notes: tuple[str, ...] = ()  #: sentences for people about what was corrected before it was read.

    @property
    def contact(self) -> BoolArray:
        """``(rows, columns)`` where the object surely shapes the gel."""
        return np.asarray(self.depth.read.contact[0])

    @property
    def trusted(self) -> BoolArray:
        """``(rows, columns)`` where the colour was explained by a slope within the calibration's range."""
        return np.asarray(self.depth.read.trusted[0])

    @property
    def anchored(self) -> bool:
        """Whether some of the gel was at rest in view; if not, heights are counted from their least."""
        return bool(self.depth.read.anchored[0])

    @property
    def deepest(self) -> tuple[int, int]:
        """Row and column of the deepest pixel."""
        row, column = np.unravel_index(int(np.argmax(self.height)), self.height.shape)
        return int(row), int(column)

    def points(self, frame_from_gel: FloatArray | None = None) -> FloatArray:
        """``(n, 3)`` metres: the gel's surface at the pixels of the contact, in the order of its rows.

        Args:
            frame_from_gel: ``(4, 4)``, of the tool; None for points in the gel's own frame (x along columns,
                y along rows, z out of the sensor), whose origin is the centre of the untouched surface.
        """
        rows, columns = self.height.shape
        row, column = np.nonzero(self.contact)
        x = (column + 0.5 - 0.5 * columns) * self.pitch
        y = (row + 0.5 - 0.5 * rows) * self.pitch
        # Pushed in, the surface lies behind where it rested, and z points out.
        points = np.column_stack([x, y, -self.height[row, column]])
        return points if frame_from_gel is None else apply(frame_from_gel, points)


def read_press(
    frames: ByteArray,
    calibration: TactileCalibration,
    detection: Detection,
    background: ByteArray | None = None,
    thickness: float | None = None,
) -> DepthReading:
    """Read one press as a camera gave it, once it is known to be of the calibration's gel and light.

    Args:
        frames: ``(n, rows, columns, 3)`` RGB, of one press that was held still; their mean is read.
        calibration: with a smooth model and a table of the same presses, of a flat gel.
        detection: what counts as a change; one that is ``drifting`` also asks for the light of the moment.
        background: ``(rows, columns, 3)`` RGB of the untouched gel as it looks now; None for the
            calibration's.
        thickness: metres of the gel, deeper than which no reading is; None where it is not known.

    Raises:
        DataRefused: no frames, or of another shape or type than the calibration's.
        PictureRefused: not what the calibration was made of, or deeper than the gel.
        CalibrationRefused: a calibration with no smooth model, or a table of too few bins.
    """
    wanted = calibration.background.shape
    if frames.ndim != 4 or len(frames) == 0 or frames.dtype != np.uint8 or frames.shape[1:] != wanted:
        described = f"{frames.dtype} {frames.shape}"
        if frames.ndim == 4 and frames.dtype == np.uint8 and frames.shape[3] == 3:
            described = f"{len(frames)} of {frames.shape[2]} x {frames.shape[1]} pixels"
        raise DataRefused(
            f"the frames are {described}; this calibration reads at least one of "
            f"{wanted[1]} x {wanted[0]} pixels in 8-bit colour: give the camera's own pictures, not cropped "
            "or scaled"
        )
    if background is not None and background.shape != wanted:
        raise DataRefused(
            f"the background is {background.shape[1]} x {background.shape[0]} pixels and the calibration's "
            f"{wanted[1]} x {wanted[0]}; give the camera's own picture, not cropped"
        )
    require_one_press(frames)
    aspect = aspect_stated(calibration.header.made_from)
    mean = mean_picture(made_square(frames, aspect))
    rest = None if background is None else made_square(background, aspect)
    began = process_time()
    checked = checked_picture(mean, calibration, rest)
    by = with_background(calibration, checked.background)
    depth = read_depth(checked.image[None], by, detection if checked.agrees else DRIFTING)
    if not (checked.agrees or background is None or depth.read.imprint.any()):
        raise PictureRefused(
            "the whole picture differs from the resting picture and no contact stands out: the light "
            "changed, or a face covers the whole view; take a resting picture just before the press, and "
            "leave some of the gel free"
        )
    read_in = process_time() - began
    least = float(checked.gain.min())
    assumed = replace(USUAL, camera=USUAL.camera / least, light=checked.light_error / least)
    sigma = height_errors(checked.image[None], depth, assumed)[0].sigma
    sigma = np.hypot(sigma, _level_error(depth.read, checked.agrees, thickness))
    if thickness is not None:
        require_within_gel(depth.read.height[0], sigma, thickness)
    stated_in = process_time() - began - read_in
    return DepthReading(
        read_only(mean),
        read_only(depth.read.height[0]),
        read_only(sigma),
        depth,
        by.header.pitch,
        aspect,
        (read_in, stated_in),
        checked.notes,
    )


def _level_error(read: Inversion, agrees: bool, thickness: float | None) -> FloatArray:
    """Return ``(rows, columns)`` metres, one standard deviation of the level from which heights are counted.

    Without gel at rest in view the least height may be pressed in too, by anything up to what remains of the
    gel. Where the surroundings of the contact do not agree with the resting picture, colours that a contact
    spreads around itself are read as slopes that lead up to it.
    """
    height = read.height[0]
    deepest = float(height.max())
    if not read.anchored[0]:
        remaining = max(0.0, (_THICKEST if thickness is None else thickness) - deepest)
        return np.full(height.shape, remaining / np.sqrt(3.0))
    if agrees or deepest == 0.0:
        return np.zeros(height.shape)
    return np.asarray(_SURROUNDINGS * deepest * np.minimum(1.0, height / (TOUCHED * deepest)))


@dataclass(frozen=True, eq=False)
class ReadForce:
    """The force of one reading."""

    pressed: ContactForce  #: all but the reading's own error, of one press.
    reading: float  #: share of the force, one standard deviation: what the reading is off by.
    newtons: float  #: exactly 0 where nothing was seen to press.
    uncertainty: float  #: N, one standard deviation.


def read_force(
    read: DepthReading, thickness: float, gel: GelElastic, level: ForceLevel = "layer"
) -> ReadForce:
    """The force of a press that was read.

    Args:
        read: surface and error.
        thickness: metres of the gel.
        gel: how stiff it is.
        level: how it is computed; what the reading adds is computed by springs.

    Raises:
        OutOfDomain: the reading is deeper than the gel is thick.
    """
    surface = read.height if read.contact.any() else np.zeros_like(read.height)
    pressed = contact_force(pressed_of_gel(surface)[None], read.pitch, thickness, gel, level)
    newtons = float(pressed.newtons[0])
    if newtons == 0.0:
        return ReadForce(pressed, 0.0, 0.0, 0.0)

    def springs(depth: FloatArray) -> float:
        held = np.clip(depth, 0.0, thickness)
        return float(contact_force(held[None], read.pitch, thickness, gel, "winkler").newtons[0])

    middle = pressed_of_gel(surface)
    here = springs(middle)
    high, low = (springs(np.where(middle > 0.0, surface + by * read.sigma, 0.0)) for by in (1.0, -1.0))
    by_error = (high - low) / (2.0 * here)
    more, less = (springs(pressed_of_gel(surface, share)) for share in _OTHER_SHARES)
    reading = float(np.hypot(by_error, (more - less) / (2.0 * here)))
    return ReadForce(pressed, reading, newtons, float(np.hypot(pressed.uncertainty[0], newtons * reading)))


def height_errors(
    images: ByteArray, depth: Depth, assumed: ColourError = USUAL, seed: int = 0
) -> tuple[HeightErrors, ...]:
    """Errors that the heights of ``depth`` may have, one answer a picture.

    Args:
        images: ``(n, rows, columns, 3)`` that were read.
        depth: what ``read_depth`` made of them.
        assumed: what colours are off by.
        seed: of the draws; the same one gives the same answer.

    Raises:
        DataRefused: other images than were read, or fewer than two draws.
    """
    if images.shape[:3] != depth.read.height.shape:
        raise DataRefused(
            f"images are {images.shape} and the heights {depth.read.height.shape}; give the pictures that "
            "were read"
        )
    if assumed.draws < 2:
        raise DataRefused(f"{assumed.draws} draws were asked for; a spread needs at least 2")
    rng = np.random.default_rng(seed)
    return tuple(
        _errors(images[k], by, depth.dimming[k], depth.read.trusted[k], ~depth.read.imprint[k], assumed, rng)
        for k, by in enumerate(depth.calibrations)
    )


def _errors(
    image: ByteArray,
    by: TactileCalibration,
    dimming: FloatArray,
    trusted: BoolArray,
    rest: BoolArray,
    assumed: ColourError,
    rng: np.random.Generator,
) -> HeightErrors:
    pitch, shape = by.header.pitch, rest.shape
    if rest.all():
        return HeightErrors(read_only(np.zeros((assumed.draws, *shape))), _FLOOR * pitch)
    block = max(1, int(np.ceil(max(shape) / _SOLVED)))
    still = _blocks(rest.astype(np.float64), block) > 0.5
    weight = np.where(_blocks(trusted.astype(np.float64), block) > 0.5, 1.0, _DISTRUST)
    slopes = _Slopes(image, by, dimming, still, block, assumed)
    draws = np.empty((assumed.draws, *shape))
    for k in range(assumed.draws):
        down, right = slopes.drawn(rng)
        coarse = free_heights(down, right)
        if still.any():
            coarse -= coarse[still].mean()
            anchored_heights(coarse, down, right, weight, still)
        if block > 1:
            coarse = zoom(coarse, block, order=1, mode="nearest", grid_mode=True)
        draws[k] = coarse[: shape[0], : shape[1]] * (block * pitch)
    return HeightErrors(read_only(draws), _FLOOR * pitch)


def _blocks(picture: FloatArray, block: int) -> FloatArray:
    """Means over blocks, the picture's edge repeated where the last ones reach beyond it."""
    rows, columns = picture.shape
    padded = np.pad(picture, ((0, -rows % block), (0, -columns % block)), mode="edge")
    means: FloatArray = padded.reshape(-(-rows // block), block, -(-columns // block), block).mean(
        axis=(1, 3)
    )
    return means
