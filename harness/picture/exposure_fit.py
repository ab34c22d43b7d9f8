"""How a camera exposed what it saw, beside a simulated picture of the same: gain and offset of each channel.

In linear light ``live = gain * simulated + offset``, fitted over pixels that are sure to show the object and
that the camera could measure. Bright spots and shadows that the simulation leaves out are outliers.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import nearest
from harness.picture.srgb import LINEAR_OF_BYTE

BLOCK = 16
"""Pixels along a block: what the simulation does not know errs alike in pixels that are near each other."""

SHADES = 10
"""Groups of brightness, of equally many pixels."""

_FEWEST = 3
"""Shades of which each may disagree with a line."""

_NORMAL = 1.4826
"""Standard deviation of normal errors over their median size."""

_SECOND_DIFFERENCE = 6.0
"""Variance of ``a - 2 b + c`` of independent numbers over that of one."""


@dataclass(frozen=True, eq=False)
class Together:
    """Pixels that may err together: a group is what one block has of one shade."""

    group: AnyArray  #: ``(n,)`` of each pixel, from 0 without a gap.
    block: AnyArray  #: ``(groups,)`` from 0 without a gap.
    shade: AnyArray  #: ``(groups,)`` from 0 without a gap.

    def __post_init__(self) -> None:
        for each in (self.group, self.block, self.shade):
            read_only(each)

    def __len__(self) -> int:
        return len(self.block)


def together(where: BoolArray, light: FloatArray) -> Together:
    """Group the used pixels by blocks and by the mean over colours of their ``(n, 3)`` light."""
    rows, columns = np.nonzero(where)
    block = _counted(rows // BLOCK * (where.shape[1] // BLOCK + 1) + columns // BLOCK)
    grey = light.mean(axis=1)
    edges = np.quantile(grey, np.linspace(0.0, 1.0, SHADES + 1)[1:-1]) if grey.size else np.empty(0)
    shade = _counted(np.searchsorted(edges, grey))
    every = int(shade.max(initial=0)) + 1
    pairs, group = np.unique(block * every + shade, return_inverse=True)
    return Together(group.reshape(-1), pairs // every, pairs % every)


def _counted(numbers: AnyArray) -> AnyArray:
    """The same from 0 without a gap."""
    return np.unique(numbers, return_inverse=True)[1].reshape(-1)


def group_variance(moved: FloatArray, groups: Together) -> FloatArray:
    """Compute the variance of fitted values with errors that are correlated within groups of pixels.

    Pixels are not independent. Noise, a highlight or a network's patch have correlated errors in pixels
    that are near each other; a camera's curve and JPEG, which rounds a whole surface's colour to one code,
    in pixels of one brightness. These are two kinds of groups (Cameron, Gelbach and Miller, J. Business
    and Economic Statistics 29(2), 2011).

    The result is the variance by blocks plus that by shades minus that by both, and at least that by blocks.

    ``(groups, ...)`` is the change of each value by each group of two blocks or more.
    """
    by_block = _squares(moved, groups.block, 1)
    if int(groups.shade.max()) + 1 < _FEWEST:
        return by_block
    # A line through few shades leaves each less to disagree with: by two of them.
    by_shade = _squares(moved, groups.shade, 2)
    both: FloatArray = by_block + by_shade - _squares(moved, np.arange(len(groups)), 1)
    return np.maximum(both, by_block)


def _squares(moved: FloatArray, owner: AnyArray, fitted: int) -> FloatArray:
    count = int(owner.max()) + 1
    sums = np.zeros((count, *moved.shape[1:]))
    np.add.at(sums, owner, moved)
    squares: FloatArray = (sums**2).sum(axis=0) * (count / (count - fitted))
    return squares


def mistaken_light(left: FloatArray, measured: BoolArray, reach: float) -> float:
    """Variance of what is left of a fit beyond the noise of single pixels: at most that of the simulation.

    Noise is what a pixel differs by from its neighbours in most places; at edges, which are few, networks and
    JPEG err so too, and that is not taken for noise.

    Args:
        left: ``(n,)`` what is left of each measured pixel.
        measured: ``(rows, columns)`` which these are.
        reach: beyond which a pixel had no weight in the fit.

    Returns:
        The square of the unit of ``left``; 0 where it is all noise.
    """
    held = np.clip(left, -reach, reach)
    picture = np.full(measured.shape, np.nan)
    picture[measured] = held
    bent = [p[2:] - 2.0 * p[1:-1] + p[:-2] for p in (picture, picture.T)]
    found = np.concatenate([each[np.isfinite(each)] for each in bent])
    noise = _NORMAL * float(np.median(np.abs(found))) if found.size else 0.0
    return max(0.0, float(np.mean(held**2)) - noise**2 / _SECOND_DIFFERENCE)


TUKEY = 4.685
"""Robust standard deviations beyond which a point says nothing: 95 % efficient where errors are normal."""

_STARTS = 30
_ROUNDS = 300
_SETTLED = 1e-7


@dataclass(frozen=True, eq=False)
class RobustFit:
    """Values of a linear model."""

    values: FloatArray  #: ``(values,)``.
    moved: FloatArray
    """``(blocks, values)`` how far each block's points pull the values; the root of the sum of their squares
    is the standard error, but for ``blocks / (blocks - 1)`` under the root."""
    scale: float  #: robust standard deviation of what is left.
    outliers: float  #: share of the points that have no weight.

    def __post_init__(self) -> None:
        read_only(self.values)
        read_only(self.moved)


def scatter(left: FloatArray) -> float:
    """Compute the robust standard deviation of residuals from the median of their absolute values."""
    return float(_NORMAL * np.median(np.abs(left)))


def robust_fit(
    design: FloatArray, wanted: FloatArray, blocks: AnyArray, count: int, floor: float
) -> RobustFit | None:
    """Fit values such that ``design @ values`` is ``wanted``, robust to outliers.

    The fit starts with least absolute deviations and ends with Tukey's bisquare (Huber and Ronchetti, 2009,
    chapters 4 and 7). Standard errors are clustered by blocks of points (Liang and Zeger, 1986).

    Args:
        design: ``(n, values)`` of full rank, finite.
        wanted: ``(n,)`` finite.
        blocks: ``(n,)`` integers, the block of each point, 0 to ``count - 1``.
        count: number of blocks, two or more.
        floor: minimum scale, e.g. of rounding; greater than zero.

    Returns:
        None if no values fit most points, or the fit does not converge to 1e-7.
    """
    # Least absolute deviations, to a few parts of the scatter, where the bisquare takes over.
    start = _weighted(design, wanted, np.ones(wanted.size))
    for _ in range(_STARTS):
        left = np.abs(wanted - design @ start)
        start = _weighted(design, wanted, 1.0 / np.maximum(left, 0.1 * floor))
    # The scale is that of the start and stays: it would else creep up with every outlier that is let in.
    scale = max(scatter(wanted - design @ start), floor)
    values = start
    for _ in range(_ROUNDS):
        u = (wanted - design @ values) / (TUKEY * scale)
        weights = np.where(np.abs(u) < 1.0, (1.0 - u**2) ** 2, 0.0)
        before, values = values, _weighted(design, wanted, weights)
        if np.abs(values - before).max() <= _SETTLED:
            break
    else:
        return None
    u = (wanted - design @ values) / (TUKEY * scale)
    inside = np.abs(u) < 1.0
    slope = np.where(inside, (1.0 - u**2) * (1.0 - 5.0 * u**2), 0.0)
    bread = (design * slope[:, None]).T @ design
    if np.linalg.eigvalsh(bread)[0] <= 0.0:
        return None
    pull = np.where(inside, TUKEY * scale * u * (1.0 - u**2) ** 2, 0.0)[:, None] * design
    pulls = np.column_stack([np.bincount(blocks, column, count) for column in pull.T])
    moved: FloatArray = np.asarray(np.linalg.solve(bread, pulls.T).T, np.float64)
    return RobustFit(values, moved, scale, float(np.mean(~inside)))


def _weighted(design: FloatArray, wanted: FloatArray, weights: FloatArray) -> FloatArray:
    heavy = design * weights[:, None]
    return np.asarray(np.linalg.lstsq(heavy.T @ design, heavy.T @ wanted, rcond=None)[0])


ExposureKind = Literal["gain-offset", "gain", "none"]
KINDS: tuple[ExposureKind, ...] = get_args(ExposureKind)

DARKEST, BRIGHTEST = 2, 250
"""Grey levels that a camera measures; JPEG smears black and white by some levels."""

LEAST_PIXELS = 200
LEAST_BLOCKS = 8
"""Blocks of which each holds a part of the pixels: errors are told by how these disagree."""

CHANNELS = ("red", "green", "blue")

_LEAST_SCATTER = 1.0 / 255.0 / np.sqrt(12.0)
"""Of a grey level's rounding, in linear light, where the slope of sRGB is one."""

_LEAST_SPREAD = 1e-3
"""Linear light that simulated pixels must spread over for gain and offset to be told apart."""

_SURE = 3.0
"""Standard errors that a gain must be above zero."""


@dataclass(frozen=True, eq=False)
class ExposureFit:
    """Gain and offset of each channel, red, green and blue, and what they are off by."""

    kind: ExposureKind  #: what was fitted; of what was not the error is zero.
    gain: FloatArray  #: ``(3,)`` linear light of the picture for one of the simulation.
    offset: FloatArray  #: ``(3,)`` linear light where the simulation is black.
    gain_error: FloatArray  #: ``(3,)`` one standard deviation, with ``attenuation``.
    offset_error: FloatArray  #: the same.
    balance_error: FloatArray
    """``(3,)`` one standard deviation of the gain over green's, relative; zero for green."""
    attenuation: FloatArray
    """``(3,)`` of it, what the simulation's own errors may have made the gain smaller by."""
    scatter: FloatArray  #: ``(3,)`` robust standard deviation of what is left, linear light.
    pixels: AnyArray  #: ``(3,)`` that were fitted.
    saturated: AnyArray  #: ``(3,)`` that were asked for, and left out as black or white.
    outliers: FloatArray  #: ``(3,)`` share of the fitted that have no weight.

    def __post_init__(self) -> None:
        errors = (self.gain_error, self.offset_error, self.balance_error, self.attenuation)
        for each in (self.gain, self.offset, *errors):
            read_only(each)

    @property
    def stops(self) -> float:
        """Exposure: powers of two in green."""
        return float(np.log2(self.gain[1]))

    @property
    def balance(self) -> FloatArray:
        """White balance: ``(3,)`` gains over green's."""
        over_green: FloatArray = self.gain / self.gain[1]
        return over_green

    def exposed(self, light: FloatArray, alpha: FloatArray | float = 1.0) -> FloatArray:
        """``(..., 3)`` simulated light as this camera exposes it, multiplied by coverage as it is given."""
        given: FloatArray = self.gain * light + self.offset * np.asarray(alpha)[..., None]
        return given


@dataclass(frozen=True, eq=False)
class _Channel:
    """One channel's ``(gain, offset)``, how much each group moves them, and what a wrong simulation may."""

    values: FloatArray
    moved: FloatArray
    biased: FloatArray
    scatter: float
    pixels: int
    saturated: int
    outliers: float


def exposure_kind(text: str) -> ExposureKind:
    """Return the kind of that name; ``WrongUse`` if there is none."""
    for kind in KINDS:
        if text == kind:
            return kind
    raise WrongUse(f"nothing to fit is called {text!r}; {nearest(text, KINDS)}")


def fit_exposure(
    live: ByteArray, simulated: FloatArray, where: BoolArray, kind: ExposureKind = "gain-offset"
) -> ExposureFit:
    """Fit gain and offset of each channel.

    Standard errors are by blocks of 16 x 16 pixels and by shades, which may disagree for any reason: noise, a
    highlight, a network's patch, a colour that JPEG rounded. The simulation's own errors make gains smaller,
    as errors of any abscissa do; what they may have done, if they are all that is left beyond the noise of
    single pixels, is counted as an error and not corrected.

    Args:
        live: ``(rows, columns, 3)`` RGB in sRGB.
        simulated: ``(rows, columns, 3)`` linear light of what covers the pixel wholly.
        where: ``(rows, columns)`` pixels that show the object and nothing else.
        kind: gain and offset; the gain alone; or none, which says what is left without a fit.

    Raises:
        DataRefused: pictures of two sizes, light that is not finite, too few pixels that are neither black
            nor white, a simulated object of one brightness, or no light of it in the live picture.
    """
    _require_alike(live, simulated, where)
    groups = together(where, simulated[where])
    found = [
        _channel(live[..., k][where], simulated[..., k][where], where, groups, kind, name)
        for k, name in enumerate(CHANNELS)
    ]
    values, biased = np.array([each.values for each in found]), np.array([each.biased for each in found])
    moved = np.array([each.moved for each in found])
    errors = np.sqrt(np.array([group_variance(each, groups) for each in moved]) + biased**2)
    # Of a balance both gains may be too small, by chance one more than the other.
    relative, loss = moved[:, :, 0] / values[:, 0, None], biased[:, 0] / values[:, 0]
    apart = group_variance((relative - relative[1]).T, groups)
    balance = np.sqrt(apart + loss**2 + loss[1] ** 2)
    balance[1] = 0.0
    return ExposureFit(
        kind=kind,
        gain=values[:, 0],
        offset=values[:, 1],
        gain_error=errors[:, 0],
        offset_error=errors[:, 1],
        balance_error=balance,
        attenuation=biased[:, 0],
        scatter=np.array([each.scatter for each in found]),
        pixels=np.array([each.pixels for each in found]),
        saturated=np.array([each.saturated for each in found]),
        outliers=np.array([each.outliers for each in found]),
    )


def _require_alike(live: ByteArray, simulated: FloatArray, where: BoolArray) -> None:
    if live.shape != simulated.shape or live.shape != (*where.shape, 3):
        raise DataRefused(
            f"a live picture of {live.shape}, a simulated one of {simulated.shape} and a mask of "
            f"{where.shape} cannot be compared; give them one size in pixels"
        )
    if live.dtype != np.uint8:
        raise DataRefused(f"a live picture of {live.dtype}; 8 bits a channel, as cameras send, are wanted")
    wrong = np.count_nonzero(~np.isfinite(simulated))
    if wrong:
        raise DataRefused(
            f"{wrong} of {simulated.size} values of the simulated picture are not finite; check its object "
            "with `touchstone object verify`"
        )


def _channel(
    levels: ByteArray, light: FloatArray, where: BoolArray, groups: Together, kind: ExposureKind, name: str
) -> _Channel:
    measured = (levels >= DARKEST) & (levels <= BRIGHTEST)
    _require_enough(levels, measured, groups.block[groups.group], name)
    live, x = LINEAR_OF_BYTE[levels[measured]], light[measured]
    _require_told(x, kind, name)
    pixels, saturated = live.size, levels.size - live.size
    if kind == "none":
        left, still = scatter(live - x), np.zeros((len(groups), 2))
        return _Channel(np.array([1.0, 0.0]), still, np.zeros(2), left, pixels, saturated, 0.0)
    design = np.column_stack([x, np.ones_like(x)]) if kind == "gain-offset" else x[:, None]
    fit = robust_fit(design, live, groups.group[measured], len(groups), _LEAST_SCATTER)
    if fit is None:
        raise DataRefused(
            f"{name}: its pixels are mostly outliers to any gain and offset; check object, pose and light"
        )
    # A simulation's errors make a gain smaller, never one of nothing: they are no doubt that there is light.
    error = float(np.sqrt(group_variance(fit.moved, groups)[0]))
    if not fit.values[0] > _SURE * error:
        raise DataRefused(
            f"{name}: the live picture does not get brighter where the simulated one does (gain "
            f"{fit.values[0]:.3g} +- {error:.2g}, to be {_SURE:g} of these above zero); check object, pose "
            "and light, or fit the gain alone"
        )
    values, moved = np.zeros(2), np.zeros((len(groups), 2))
    values[: fit.values.size], moved[:, : fit.values.size] = fit.values, fit.moved
    seen = where.copy()
    seen[where] = measured
    wrong = mistaken_light(live - design @ fit.values, seen, TUKEY * fit.scale)
    # Light that the simulation gets wrong moves gain and offset. The fitted line turns about the mean of its
    # pixels: a gain that is too small comes with an offset that is too large.
    middle = float(x.mean()) if kind == "gain-offset" else 0.0
    loss = wrong / values[0] / float(np.mean((x - middle) ** 2))
    bias = np.array([loss, loss * middle])
    return _Channel(values, moved, bias, fit.scale, pixels, saturated, fit.outliers)


def _require_enough(levels: ByteArray, measured: BoolArray, blocks: AnyArray, name: str) -> None:
    count, parts = int(measured.sum()), np.unique(blocks[measured]).size
    if levels.size < LEAST_PIXELS or np.unique(blocks).size < LEAST_BLOCKS:
        raise DataRefused(
            f"the object covers {levels.size} whole pixels in {np.unique(blocks).size} blocks of {BLOCK} x "
            f"{BLOCK}; {LEAST_PIXELS} in {LEAST_BLOCKS} are needed to fit an exposure: go nearer, take a "
            "larger picture, or check that the camera's pose shows the object"
        )
    if count < LEAST_PIXELS or parts < LEAST_BLOCKS:
        dark, bright = int((levels < DARKEST).sum()), int((levels > BRIGHTEST).sum())
        raise DataRefused(
            f"{name}: of {levels.size} pixels of the object {bright} are saturated (above {BRIGHTEST} of "
            f"255) and {dark} black (below {DARKEST}); {count} in {parts} blocks are left and {LEAST_PIXELS} "
            f"in {LEAST_BLOCKS} needed: {'shorten' if bright > dark else 'lengthen'} the exposure"
        )


def _require_told(light: FloatArray, kind: ExposureKind, name: str) -> None:
    if kind == "gain-offset" and float(light.std()) < _LEAST_SPREAD:
        raise DataRefused(
            f"{name}: the simulated object is of one brightness, {light.mean():.3g} with a spread of "
            f"{light.std():.1g} (at least {_LEAST_SPREAD:g}), so gain and offset cannot be told apart; fit "
            "the gain alone, or light it from another side"
        )
    if kind == "gain" and float(light.mean()) < _LEAST_SPREAD:
        raise DataRefused(
            f"{name}: the simulated object is black ({light.mean():.1g} of 1), so no gain can be told"
        )
