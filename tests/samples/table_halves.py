"""Two tables of disjoint presses of one gel, and how far they are apart against what each says of itself."""

from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from calibration.taxim.held_out import FittedModel, teach
from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import Pictures, PressPack, in_order_of_content
from calibration.taxim.smooth_fit import changes
from calibration.taxim.table import table_error
from harness.basics.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Taught:
    """A table with its errors."""

    model: FittedModel  #: of some presses.
    error: FloatArray  #: of its table.


def taught(pack: PressPack, which: IntArray, ball: float) -> Taught:
    """The table of some presses of a pack, for a ball's radius in pixels."""
    with threadpool_limits(limits=1, user_api="blas"):
        part = pack.of(which)
        change = changes(pack)[which]
        model = teach(part, change, ball)
        error = table_error(part, change - model.rest, model.fit, ball)
    return Taught(model, error.astype(np.float64))


def halves(pack: PressPack, ball: float) -> tuple[Taught, Taught]:
    """Of every other press each."""
    count = len(pack.images)
    return taught(pack, np.arange(0, count, 2), ball), taught(pack, np.arange(1, count, 2), ball)


def packed(pictures: Pictures, centres: FloatArray, identity: Identity) -> PressPack:
    """Pictures with about the right centres, in the order in which a calibration takes them: of no place."""
    ordered = in_order_of_content(pictures)
    order = np.array([pictures.names.index(name) for name in ordered.names])
    radii = np.full(len(order), 0.75 * identity.ball)
    return PressPack(
        ordered.background, ordered.images, centres[order], radii, np.arange(len(order)), ordered.sha256
    )


def apart(pair: tuple[Taught, Taught]) -> tuple[FloatArray, FloatArray]:
    """``(120, 120, 3)`` grey levels rms over the presses' places by which tables differ, and should."""
    x, y = np.concatenate([one.model.fit.centres for one in pair]).T
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    first, second = (np.einsum("pt,ijtc->pijc", terms, one.model.table.astype(np.float64)) for one in pair)
    return np.sqrt(((first - second) ** 2).mean(axis=0)), np.hypot(pair[0].error, pair[1].error)


def reached(pair: tuple[Taught, Taught]) -> dict[str, BoolArray]:
    """``(120, 120)`` by words: bins that both halves' presses reached, that one's did, that neither's did."""
    one, other = (each.model.support for each in pair)
    rows = np.minimum(*(np.nonzero(each.any(axis=1))[0].max() for each in (one, other)))
    inside = np.zeros_like(one)
    # The first row is flat gel, the last column the first one's copy.
    inside[1 : rows + 1, :-1] = True
    return {"both": one & other & inside, "one": (one ^ other) & inside, "neither": ~(one | other) & inside}
