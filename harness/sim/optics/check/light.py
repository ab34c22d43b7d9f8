"""Compare the light of two pictures of one gel: gains, offsets, an uneven light, channel order, orientation.

Where nothing touches the gel, ``picture = gain * reference + offset`` in each channel. A contact changes the
other pixels by any amount, so the light is the model that explains most blocks of the picture closely, and
not the fit with the least squares. Of several models the simplest one that explains as many blocks is used.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, permutations

import numpy as np

from harness.basics.arrays import FloatArray, IntArray

CLOSE = 1.0
"""Grey levels, length over the channels, within which a block is explained. The noise of a block is 0.6."""

MODELS = ("same", "gain", "offset", "gain and offset", "uneven gain")
"""Changes of the light, the simplest first."""

_WIDEST = 4.0
"""Multiple of the close limit at which a fit starts."""

_ITERATIONS = 8
_PROPOSALS = 250
"""Blocks whose own change is tried as the light of the picture."""

_MORE, _RELATIVELY_MORE = 0.02, 0.04
"""Weight of the blocks that a more complex model has to explain more: of all, and of those explained."""

MIN_EXPLAINED = 0.08
"""Weight of the blocks from which the light is known. Below, too little of the gel is at rest in view."""

_MIN_EXPLAINED_UNEVEN = 0.5
_CHANNELS = ("red", "green", "blue")


@dataclass(frozen=True, eq=False)
class LightMatch:
    """``picture = gain * reference + offset`` in each channel, and how much of the picture it explains."""

    name: str
    """Kind of the change, one of ``MODELS``."""
    slope: FloatArray
    """``(3, 3)``: gain at the centre, and its change from there to the right and lower edges; by channel."""
    offset: FloatArray
    """``(3,)`` grey levels."""
    explained: float
    """Weight of the blocks that it explains closely, 0 to 1."""
    residual: FloatArray
    """``(rows, columns, 3)`` grey levels that it leaves of each block."""

    @property
    def is_known(self) -> bool:
        """True where enough of the picture follows the light for a correction."""
        return self.explained >= MIN_EXPLAINED

    def gain(self, rows: int, columns: int) -> FloatArray:
        """Return the gain of each pixel of a picture of this size, ``(rows, columns, 3)``."""
        terms = np.stack([np.ones((rows, columns)), *_from_centre(rows, columns)])
        return np.asarray(np.einsum("pij,pc->ijc", terms, self.slope))

    def apply(self, reference: FloatArray) -> FloatArray:
        """Return the reference ``(rows, columns, 3)`` in this light."""
        return np.asarray(self.gain(*reference.shape[:2]) * reference + self.offset)


def match_light(
    picture: FloatArray, reference: FloatArray, close: float = CLOSE, models: int = len(MODELS)
) -> LightMatch:
    """Find the simplest change of the light that explains most blocks of a picture by a reference.

    Args:
        picture: ``(rows, columns, 3)`` grey levels, means over blocks.
        reference: the same, of the gel at rest.
        close: grey levels, length over the channels, within which a block is explained.
        models: how many of ``MODELS`` are fitted.
    """
    matches = islice(_models(picture, reference, close), models)
    best = next(matches)
    for match in matches:
        wanted = max(
            (1.0 + _RELATIVELY_MORE) * best.explained + _MORE,
            _MIN_EXPLAINED_UNEVEN if match.name == MODELS[-1] else MIN_EXPLAINED,
        )
        if match.explained > wanted:
            best = match
    return best


def _models(picture: FloatArray, reference: FloatArray, close: float) -> Iterator[LightMatch]:
    """Yield every model of the light fitted to the picture, the simplest first."""
    y, x = picture.reshape(-1, 3), reference.reshape(-1, 3)
    u, v = (axis.reshape(-1, 1) for axis in _from_centre(*picture.shape[:2]))
    one, nothing = np.ones_like(x), np.zeros(3)

    def match(name: str, gain: FloatArray, offset: FloatArray) -> LightMatch:
        slope = np.zeros((3, 3))
        slope[: len(gain)] = gain
        residual = picture - LightMatch(name, slope, offset, 0.0, picture).apply(reference)
        explained = _weight(np.linalg.norm(residual, axis=2), close).mean()
        return LightMatch(name, slope, offset, float(explained), residual)

    same = match(MODELS[0], np.ones((1, 3)), nothing)
    yield same
    by_gain = by_offset = np.linalg.norm(same.residual, axis=2).ravel()
    if same.explained < MIN_EXPLAINED:
        chosen = slice(None, None, max(1, len(y) // _PROPOSALS))
        by_gain = _most_common(y, (y[chosen] + 1.0) / (x[chosen] + 1.0) * x[:, None], close)
        by_offset = _most_common(y, y[chosen] - x[chosen] + x[:, None], close)
    start = min(by_gain, by_offset, key=lambda residual: float(np.median(residual)))
    yield match(MODELS[1], _fit(y, np.stack([x]), by_gain, close), nothing)
    yield match(MODELS[2], np.ones((1, 3)), _fit(y - x, np.stack([one]), by_offset, close)[0])
    found = _fit(y, np.stack([x, one]), start, close)
    yield match(MODELS[3], found[:1], found[1])
    yield match(MODELS[4], _fit(y, np.stack([x, u * x, v * x]), by_gain, close), nothing)


def _from_centre(rows: int, columns: int) -> tuple[FloatArray, FloatArray]:
    """Return ``(rows, columns)`` distances right of and below the centre, -1 and 1 at the edges."""
    v, u = np.mgrid[:rows, :columns]
    return (2.0 * u + 1.0) / columns - 1.0, (2.0 * v + 1.0) / rows - 1.0


def _weight(residual: FloatArray, width: float) -> FloatArray:
    return np.asarray(np.exp(-0.5 * (residual / width) ** 2))


def _most_common(picture: FloatArray, proposed: FloatArray, close: float) -> FloatArray:
    """Return the residuals ``(blocks,)`` of the one of ``(blocks, proposals, 3)`` that explains most."""
    residual = np.sqrt(((picture[:, None] - proposed) ** 2).sum(axis=2))
    return np.asarray(residual[:, int(_weight(residual, 2.0 * close).sum(axis=0).argmax())])


def _fit(target: FloatArray, terms: FloatArray, residual: FloatArray, close: float) -> FloatArray:
    """Fit each channel to the blocks near the light, first loosely and then closely.

    Args:
        target: ``(blocks, 3)`` grey levels.
        terms: ``(terms, blocks, 3)``.
        residual: ``(blocks,)`` grey levels from the light to start from.
        close: grey levels, width of the last step.

    Returns:
        ``(terms, 3)`` coefficients.
    """
    found = np.zeros((len(terms), 3))
    for width in close * np.geomspace(_WIDEST, 1.0, _ITERATIONS):
        weight = _weight(residual, width) + 1e-9
        normal = np.einsum("pnc,qnc,n->cpq", terms, terms, weight)
        normal += 1e-9 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(len(terms))
        pull = np.einsum("pnc,nc,n->cp", terms, target, weight)
        found = np.linalg.solve(normal, pull[..., None])[..., 0].T
        residual = np.linalg.norm(target - np.einsum("pnc,pc->nc", terms, found), axis=1)
    return found


def matching_variant(picture: FloatArray, reference: FloatArray, close: float) -> tuple[str, LightMatch]:
    """Find the channel order and orientation of the reference that explain a picture best, and its light.

    Args:
        picture: ``(rows, columns, 3)`` grey levels, means over blocks.
        reference: the same, of the gel at rest.
        close: grey levels, length over the channels, within which a block is explained.

    Returns:
        The variant in words and its light; an empty text for the reference as it is.
    """
    matches = [
        (in_words(exchanged, words), match_light(picture[::2, ::2], turned[::2, ::2, channels], close))
        for exchanged, channels in channel_orders()
        for words, turned in turns(reference).items()
    ]
    return max(matches, key=lambda found: found[1].explained if (found[1].slope[0] > 0.2).all() else 0.0)


def turns(picture: FloatArray, back: bool = False) -> dict[str, FloatArray]:
    """Return a picture ``(rows, columns, 3)`` in every orientation by its words; empty for itself, first.

    Args:
        picture: to turn.
        back: whether the picture is in each of the orientations, and turned back from it.
    """
    quarter = -1 if back else 1
    turned = {
        "": picture,
        "mirrored left to right": picture[:, ::-1],
        "upside down": picture[::-1],
        "turned by 180 degrees": picture[::-1, ::-1],
    }
    if picture.shape[0] == picture.shape[1]:
        turned["turned by 90 degrees"] = np.rot90(picture, quarter)
        turned["turned by 270 degrees"] = np.rot90(picture, 3 * quarter)
    return turned


def channel_orders(back: bool = False) -> list[tuple[str, IntArray]]:
    """Return every order of channels in words, with the ``(3,)`` channels to take for it; their own first."""
    return [
        (
            "" if order == (0, 1, 2) else f"channels {', '.join(_CHANNELS[k] for k in order)}",
            np.argsort(order) if back else np.array(order),
        )
        for order in permutations(range(3))
    ]


def in_words(exchanged: str, turned: str) -> str:
    """Join the words for an order of channels and for an orientation; empty for neither."""
    return ", ".join(part for part in (exchanged, turned) if part)
