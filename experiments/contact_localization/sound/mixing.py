"""Which modes sound together: what an uneven material makes of modes whose frequencies lie close.

A real object's modes are the drawing's, mixed. To first order in the changes of stiffness and mass a pair
mixes by the angle that turns ``[[l_i, e], [e, l_j]]`` diagonal: ``l`` the squares of the drawing's angular
frequencies, ``e`` their coupling (Courant and Hilbert, Methods of Mathematical Physics I, chapter V.13). A
pair of a round object that holes or a handle split by a few per cent is turned by a coupling of as much;
modes that nothing couples stay apart at any split. Of the material's unevenness only the deviation is
known, so the angle has a spread, and a mode sounds with its neighbours admixed as strongly as is expected.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from experiments.contact_localization.sound.density import MOST_RANK
from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.errors import WrongUse

_WAVES = 64
_SAMPLES = 1000
"""Of the surface, about, over which a coupling is averaged: it varies over centimetres."""


@dataclass(frozen=True)
class ModeMixing:
    """How far an object's modes may be mixtures of its drawing's.

    Attributes:
        free: modes whose frequencies differ by less than this share mix freely.
        most: modes that mix freely at most; at most ``density.MOST_RANK``.
        uneven: relative, one sigma of the material's stiffness, and of its density, over the object.
        length: metres over which they vary.
        least: share of a neighbour's amplitude from which on it counts; what the gains are off by at best.
    """

    free: float = 0.01
    most: int = 3
    uneven: float = 0.04
    length: float = 40.0e-3
    least: float = 0.1


@dataclass(frozen=True, eq=False)
class ModeGroups:
    """Modes that sound at one peak, group by group: its own, and its neighbours' that are admixed.

    Attributes:
        own_starts: ``(G + 1,)`` first mode of each group's own.
        starts: ``(G + 1,)`` first column of each group; those of its own modes come first.
        modes: ``(M,)`` the mode of each column; it may be in several groups.
        weights: ``(M,)`` of each column's amplitude, from 0 to 1; 1 for a group's own.
        frequencies: ``(G,)`` Hz, of a group's own modes.
    """

    own_starts: IntArray
    starts: IntArray
    modes: IntArray
    weights: FloatArray
    frequencies: FloatArray


def mixed_groups(
    shapes: AnyArray, points: FloatArray, frequencies: FloatArray, mixing: ModeMixing
) -> ModeGroups:
    """Groups of near-equal frequencies, each with the neighbours that may be admixed to it.

    Args:
        shapes: ``(n, m, 3)`` modes at even samples of the surface.
        points: ``(n, 3)`` metres, of the samples.
        frequencies: ``(m,)`` Hz, ascending.
        mixing: how far.

    Raises:
        WrongUse: a group may be larger than the kernel takes.
    """
    if not 1 <= mixing.most <= MOST_RANK:
        raise WrongUse(f"groups of {mixing.most} modes were asked for; 1 to {MOST_RANK} can be weighed")
    own = group_starts(frequencies, mixing)
    sizes = np.diff(own)
    logs = np.array([np.log(frequencies[a:b]).mean() for a, b in pairwise(own)])
    squares = admixtures(_coupled(shapes, points, own, logs, mixing), logs) * sizes[:, None]
    amplitudes = np.sqrt(np.minimum(squares, 1.0))
    members = [_members(group, amplitudes[group], sizes, mixing.least) for group in range(len(sizes))]
    blocks = [np.arange(a, b) for a, b in pairwise(own)]
    modes = [np.concatenate([blocks[g] for g in chosen]) for chosen in members]
    weights = [np.repeat([1.0, *amplitudes[chosen[0], chosen[1:]]], sizes[chosen]) for chosen in members]
    return ModeGroups(
        read_only(own),
        read_only(np.cumsum([0, *map(len, modes)], dtype=np.int64)),
        read_only(np.concatenate([np.zeros(0, dtype=np.int64), *modes])),
        read_only(np.concatenate([np.zeros(0), *weights])),
        read_only(np.exp(logs)),
    )


def admixtures(couplings: FloatArray, logs: FloatArray) -> FloatArray:
    """``(G, G)``: expected square of a mode's share in another, over the other's own.

    For a coupling ``e`` and a split ``d`` the angle is half of that of ``(d, 2 e)``. The share is 1 at no
    split, ``(e / d)^2`` at a wide one and 0 without a coupling.

    Args:
        couplings: ``(G, G)`` one sigma, relative to the squares of the frequencies.
        logs: ``(G,)`` of the frequencies.
    """
    split = 2.0 * np.abs(logs[:, None] - logs)
    whole = np.hypot(split, 2.0 * couplings)
    return np.asarray((whole - split) / np.maximum(whole + split, np.finfo(np.float64).tiny))


def _coupled(
    shapes: AnyArray, points: FloatArray, own: IntArray, logs: FloatArray, mixing: ModeMixing
) -> FloatArray:
    """``(G, G)`` one sigma of the coupling of two groups' modes, the same in any basis of either."""
    sizes = np.diff(own)
    group = np.repeat(np.arange(len(logs)), sizes)
    means = np.bincount(group, np.mean(np.sum(shapes**2, axis=2), axis=0), len(logs)) / sizes
    unit = shapes / np.sqrt(np.maximum(means, np.finfo(np.float64).tiny))[group, None]
    # No field couples two modes more than ones that move the same places alike.
    reach = np.sqrt(2.0) * mixing.uneven / mixing.least
    near = 2.0 * np.abs(logs[:, None] - logs) < reach
    i, j = np.nonzero(near[group][:, group] & (group[:, None] < group))
    squares = np.zeros(near.shape)
    np.add.at(squares, (group[i], group[j]), couplings(unit, points, i, j, mixing) ** 2)
    return np.asarray(np.sqrt((squares + squares.T) / np.outer(sizes, sizes)))


def couplings(
    shapes: AnyArray, points: FloatArray, i: IntArray, j: IntArray, mixing: ModeMixing
) -> FloatArray:
    """``(p,)``: one sigma of the coupling of pairs of modes, relative to the square of their frequency.

    Stiffness and density vary independently, each with a squared exponential covariance. What a field couples
    is its product with both modes over the object, and the variance of that is a mean over the field's waves.
    Strain is taken to lie where the motion is, and the surface to stand for the volume, as in a shell.

    Args:
        shapes: ``(n, m, 3)`` modes at even samples of the surface, each of unit mean square.
        points: ``(n, 3)`` metres, of the samples.
        i: ``(p,)`` the pairs' first modes.
        j: ``(p,)`` their second modes.
        mixing: gives the material's unevenness.
    """
    few = slice(None, None, max(1, len(points) // _SAMPLES))
    some = np.asarray(shapes[few], dtype=np.float64)
    waves = np.random.default_rng(0).standard_normal((3, _WAVES)) / mixing.length
    fields = np.exp(1j * (points[few] @ waves)) / len(some)
    squares = np.zeros(len(i))
    for mode in np.unique(i):  # one after the other: all pairs' products together fill hundreds of MB
        of = i == mode
        together = np.sum(some[:, [mode]] * some[:, j[of]], axis=2)
        squares[of] = np.mean(np.abs(together.T @ fields) ** 2, axis=1)
    return np.asarray(mixing.uneven * np.sqrt(2.0 * squares))


def _members(group: int, amplitudes: FloatArray, sizes: IntArray, least: float) -> list[int]:
    """A group, and behind it the neighbours with at least such an amplitude, strongest first, that fit."""
    chosen, left = [group], MOST_RANK - int(sizes[group])
    for other in np.argsort(-amplitudes, kind="stable"):
        if other != group and amplitudes[other] >= least and sizes[other] <= left:
            chosen.append(int(other))
            left -= int(sizes[other])
    return chosen


def group_starts(frequencies: FloatArray, mixing: ModeMixing) -> IntArray:
    """``(G + 1,)`` first mode of every group of near-equal frequencies.

    Within a group the eigenvectors are any rotation of each other, and a small asymmetry of the real
    object picks another one; a group is therefore taken whole.

    Args:
        frequencies: ``(m,)`` Hz, ascending.
        mixing: gives the group's width.
    """
    starts = [0]
    for mode in range(1, len(frequencies)):
        close = frequencies[mode] < (1.0 + mixing.free) * frequencies[mode - 1]
        if not close or mode - starts[-1] >= mixing.most:
            starts.append(mode)
    return np.array([*starts, len(frequencies)] if len(frequencies) else [0], dtype=np.int64)
