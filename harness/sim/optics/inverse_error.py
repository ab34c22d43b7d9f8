"""How far a recovered height may be off, pixel by pixel: errors of colour carried through the solve.

Two errors of colour make a height wrong. The camera's noise differs from pixel to pixel and hardly adds up.
The calibration's misfit is the same wherever the gel has the same slope, so it adds up along every face;
it is drawn as a random smooth function of the normal. Each draw becomes an error of slope by the linear
part of the colour's inversion, and an error of height by the very least squares that gave the heights,
on blocks of pixels, for errors of height are smooth. The spread of the draws is the standard deviation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates, uniform_filter, zoom

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused
from harness.sim.optics.contact_depth import Depth
from harness.sim.optics.poisson import anchored_heights, free_heights
from harness.sim.optics.shading import normals_from_colour, shades
from harness.sim.optics.tactile_calibration import ColourMisfit, TactileCalibration

_RIDGE = 16.0
"""Grey levels squared: as the inversion's own."""

_HELD = 0.98
"""Share of the slope limit from which a slope was held there."""

_DISTRUST = 0.1
"""Weight of slopes that are not trusted, as in the solve for the heights."""

_NODES = 49
"""Of the plane of normals, a side."""

_SOLVED = 80
"""Blocks along the longer side: errors of height are smooth, and a solve costs as the cube of this."""

_STRANGE = 2.0
"""Times the calibration's residual from which a colour is none of its presses', but dirt or a shadow."""

_WINDOW = 5

_FLOOR = 0.05
"""Pixels of height, one sigma, where the gel is at rest."""


@dataclass(frozen=True)
class ColourError:
    """What colours are off by."""

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
        impulse = np.zeros((_NODES, _NODES))
        impulse[_NODES // 2, _NODES // 2] = 1.0
        noise /= np.sqrt(np.mean(gaussian_filter(impulse, width, mode="wrap") ** 2)) * _NODES
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


def _blocks(picture: FloatArray, block: int) -> FloatArray:
    """Means over blocks, the picture's edge repeated where the last ones reach beyond it."""
    rows, columns = picture.shape
    padded = np.pad(picture, ((0, -rows % block), (0, -columns % block)), mode="edge")
    means: FloatArray = padded.reshape(-(-rows // block), block, -(-columns // block), block).mean(
        axis=(1, 3)
    )
    return means
