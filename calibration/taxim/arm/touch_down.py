"""Where a ball first touched, from pictures of it sinking into the gel: one place a press, in pixels.

What the middle of a contact is cannot be read off its colours. Lights differ from one side of the gel to the
other, every way to see a middle is drawn aside by that, and more so the larger the contact: over the picture
it looks like another scale. The pictures of the arm's way down tell: the centre of brightness wanders in
proportion to the strength of the change, and where that is carried back to no strength at all the ball is a
point, and lights have nothing left to draw aside. Strength is the root of the change's energy, for small
contacts proportional to the depth: the depth itself need not be known.

There is more than one way to see it, by how much of the outskirts counts and how many pictures; their
disagreement is what the answer is uncertain by, beside its scatter.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import FloatArray, block_means
from harness.bench.device import Reading, TactileCamera

_BLOCK = 8
"""Side of a block in pixels: a noise of two grey levels per pixel is half a level between two images."""

_SHARE = 99.5
"""Percentile of the blocks that must be at rest: a contact fills a fiftieth of the picture."""


@dataclass(frozen=True)
class Stillness:
    """When a picture counts."""

    limit: float = 1.0  #: grey levels by which two looks may differ.
    looks: int = 2  #: looks in a row, each still against the one before, that make it settled.
    interval: float = 0.2  #: s between looks.
    patience: float = 5.0  #: s after which it is given up.
    frames: int = 3  #: a look is the mean of so many.
    timeout: float = 3.0  #: s that the camera may take for a look.


@dataclass(frozen=True, eq=False)
class Settling:
    """The last images of a settling gel, and the changes between them."""

    frames: Reading  #: the last look.
    unrest: FloatArray  #: ``(n,)`` grey levels between each look and the one before.
    settled: bool  #: whether it came to rest within the patience.
    seconds: float  #: from the first look to the last.


BLUR = 1.0
"""Pixels, of the change before it is looked at."""

_FIND = 3.0
"""Pixels of blur within which a contact is looked for."""

_REACH = 1.05
"""Ball radii around its middle that are looked at."""

_TURNS = 6
_SOFT = 0.3
"""Of the strongest change, over which a pixel begins to count: whole pixels would jump by a tenth of one."""

_FAINT = 3.0
"""Grey levels that noise may reach."""


@dataclass(frozen=True)
class Descent:
    """One way to see the middle of a contact."""

    above: float  #: share of the strongest change from which on a pixel counts.
    even: bool  #: whether pixels that count, count alike; else by how far they are above.
    pictures: int  #: of the way down, from the first touch on.
    degree: int = 1  #: of the polynomial by which the middle is carried back.


WAYS = (
    Descent(0.15, False, 4),
    Descent(0.15, False, 6),
    Descent(0.15, False, 6, degree=2),
    Descent(0.35, True, 4),
    Descent(0.35, True, 6),
    Descent(0.35, True, 6, degree=2),
)
"""The first is the one whose presses off the map are named."""

PICTURES = max(way.pictures for way in WAYS)
"""Of the way down that are worth taking."""


def touch_downs(descents: list[FloatArray], ball: float) -> tuple[tuple[FloatArray, ...], FloatArray]:
    """Where each press began, once for every one of ``WAYS``.

    Args:
        descents: of every press ``(pictures, rows, columns, 3)`` grey levels against the untouched gel, from
            the first picture that showed the touch on; fewer than three are no way down.
        ball: radius in pixels.

    Returns:
        ``(presses, 2)`` pixels (column, row) a way; and where the middles are before they are carried back:
        in the deepest picture, by the first of ``WAYS``. NaN where a press shows nothing.
    """
    seen = [_contact(change, ball) for change in descents]
    began = tuple(np.array([_began(one, way) for one in seen]).reshape(-1, 2) for way in WAYS)
    deepest = [_middle(_weight(one[-1], WAYS[0])) if len(one) else np.full(2, np.nan) for one in seen]
    return began, np.array(deepest).reshape(-1, 2)


def _contact(change: FloatArray, ball: float) -> FloatArray:
    """The strength of change within reach of one contact: ``(pictures, rows, columns)`` grey levels."""
    if not len(change):
        return np.zeros((0, 1, 1))
    # The root of the energy of all channels.
    blurred = [gaussian_filter((picture**2).sum(axis=2), BLUR) for picture in change]
    strength = np.sqrt(np.stack(blurred).astype(np.float64))
    smooth = gaussian_filter(strength[min(2, len(strength) - 1)], _FIND)
    row, column = np.unravel_index(int(np.argmax(smooth)), smooth.shape)
    centre = np.array([float(column), float(row)])
    y, x = (axis.astype(np.float64) for axis in np.mgrid[: strength.shape[1], : strength.shape[2]])
    for _ in range(_TURNS):
        near = np.hypot(x - centre[0], y - centre[1]) <= _REACH * ball
        strongest = strength[-1] * near
        weight = np.maximum(strongest - 0.15 * strongest.max(), 0.0)
        centre = _middle(weight)
    return np.asarray(strength * near)


def _began(contact: FloatArray, way: Descent) -> FloatArray:
    strength = contact[: way.pictures]
    if len(strength) < way.degree + 2 or strength[-1].max() < 2.0 * _FAINT:
        return np.full(2, np.nan)
    middles = np.array([_middle(_weight(one, way)) for one in strength])
    total = np.sqrt((strength**2).sum(axis=(1, 2)))
    share = total / total[-1]
    powers = np.vander(share, way.degree + 1, increasing=True)
    # The noise of a middle is as one over its strength: so much less does a faint picture weigh.
    solved = np.linalg.lstsq(powers * share[:, None], middles * share[:, None], rcond=None)[0]
    return np.asarray(solved[0], dtype=np.float64)


def _weight(strength: FloatArray, way: Descent) -> FloatArray:
    strongest = float(strength.max())
    floor = max(way.above * strongest, _FAINT)
    if way.even:
        return np.clip(0.5 + (strength - floor) / (_SOFT * strongest + 1e-9), 0.0, 1.0)
    return np.maximum(strength - floor, 0.0)


def _middle(weight: FloatArray) -> FloatArray:
    """Centre of gravity (column, row) in pixels; NaN of nothing."""
    total = float(weight.sum())
    if total <= 0.0:
        return np.full(2, np.nan)
    rows, columns = (np.arange(size, dtype=np.float64) for size in weight.shape)
    return np.array([weight.sum(axis=0) @ columns, weight.sum(axis=1) @ rows]) / total


def settle(gel: TactileCamera, pause: Callable[[float], None], still: Stillness) -> Settling:
    """Look until the picture is at rest, or until patience ends.

    Args:
        gel: the camera.
        pause: waits so many seconds of the bench's own time.
        still: when it counts as at rest.

    Raises:
        BenchFault: the camera sends nothing.
    """
    frames = gel.read(still.frames, still.timeout)
    began, unrest, calm = float(frames.times[0]), [], 0
    while calm < still.looks and float(frames.times[-1]) - began < still.patience:
        pause(still.interval)
        later = gel.read(still.frames, still.timeout)
        unrest.append(unrest_between(look(frames), look(later)))
        calm = calm + 1 if unrest[-1] <= still.limit else 0
        frames = later
    return Settling(frames, np.array(unrest), calm >= still.looks, float(frames.times[-1]) - began)


def look(frames: Reading) -> FloatArray:
    """``(rows, columns, 3)`` grey levels, the mean of the frames."""
    mean: FloatArray = frames.values.astype(np.float64).mean(axis=0)
    return mean


def unrest_between(one: FloatArray, other: FloatArray) -> float:
    """Return the difference in grey levels that 199 of 200 blocks of two images do not exceed."""
    return float(np.percentile(np.abs(block_means(other - one, _BLOCK)).max(axis=2), _SHARE))
