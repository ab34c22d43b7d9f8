"""What a fitted exposure is off by: pixels that err together, and simulated light that is itself wrong.

Pixels are not so many witnesses as there are. Noise, a highlight or a network's patch err alike in pixels
that are near each other; a camera's curve and JPEG, which rounds a whole surface's colour to one code, in
those of one brightness. Both at once are groups of two kinds (Cameron, Gelbach and Miller, J. Business and
Economic Statistics 29(2), 2011). And what the simulated light is wrong by makes a gain smaller, everywhere
alike, which no group tells (Frisch, Statistical Confluence Analysis, 1934): by how much at most, what is left
of the pixels does.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only

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
    """Pixels that may err together: a group is what one block has of one shade.

    Attributes:
        group: ``(n,)`` of each pixel, from 0 without a gap.
        block: ``(groups,)`` from 0 without a gap.
        shade: ``(groups,)`` from 0 without a gap.
    """

    group: AnyArray
    block: AnyArray
    shade: AnyArray

    def __post_init__(self) -> None:
        for each in (self.group, self.block, self.shade):
            read_only(each)

    def __len__(self) -> int:
        return len(self.block)


def together(where: BoolArray, light: FloatArray) -> Together:
    """The groups of pixels.

    Args:
        where: ``(rows, columns)`` pixels that count.
        light: ``(n, 3)`` simulated light of these, by whose mean over colours they are shaded.
    """
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
    """Variance of values that groups of pixels move, each kind of group as a whole.

    Of blocks, and of shades, less what both count: a group. It is never less than that of blocks alone.

    Args:
        moved: ``(groups, ...)`` how far each group moves each value.
        groups: of two blocks or more.

    Returns:
        ``(...)`` the square of the values' unit.
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
