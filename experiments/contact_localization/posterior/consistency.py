"""Whether the readings can be of this object at all, and which contact does not fit."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.likelihood import SAME_AXIS, SAME_PLACE
from experiments.contact_localization.posterior.search import Search
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import FitRefused

REFUSE_BELOW = -9.0
"""Nats: the median of the contacts' fits at the best hypothesis. Calibration runs: -3.0 to -0.5."""


REFUSE_QUARTILE_BELOW = -14.0
"""Nats: the lower quartile, of four contacts or more. Calibration runs: -4.3 to -0.8."""


REFUSE_FEW_BELOW = -20.0
"""Nats: the median of fewer than four contacts, of which a single odd one may be half."""


SLIPPED_BELOW = -10.0
"""Nats of one contact where the others fit."""


_WALL = 6.0e-3
"""M: a wall no thicker is thin beside what the place is known to."""


_ENOUGH = 4


_FAR_BELOW = -1000.0


@dataclass(frozen=True)
class Gate:
    """How one contact fits the answer."""

    fit: float | None  #: nats at the best hypothesis, 0 at best; None where the image shows no contact.
    missed: bool  #: the image shows no contact; the contact was not used.
    slipped: bool  #: it fits much worse than the others: the object moved, or the gel slid.
    repeats: int | None
    """index of an earlier contact at the same place and attitude, or None; such presses together count
    once."""

    @property
    def finite_fit(self) -> float | None:
        """The fit as JSON has it; None without one, or if the contact fits nowhere near."""
        return self.fit if self.fit is not None and np.isfinite(self.fit) else None


@dataclass(frozen=True)
class Likeness:
    """How contacts taken together fit one hypothesis."""

    typical: float  #: nats, the median of their fits.
    quartile: float  #: nats, their lower quartile, or what all but the worst of a few exceed.
    limit: float  #: nats, the least ``typical`` that is not refused.
    many: bool  #: whether they are enough to be judged by their quartile too.

    @property
    def margin(self) -> float:
        """Nats by which they are clear of being refused; below 0 they are."""
        typical = self.typical - self.limit
        return min(typical, self.quartile - REFUSE_QUARTILE_BELOW) if self.many else typical


def likeness_of(search: Search, members: IntArray, fits: FloatArray) -> Likeness:
    """How some contacts, at least one, fit where each fits with so many nats."""
    # A press repeated at one place is one witness, however often it is heard.
    heard = np.array([_repeated(search, int(k)) is None for k in members])
    # Floored: the quantile's interpolation must not subtract one infinity from another.
    floored = np.maximum(fits[heard], _FAR_BELOW)
    # Of few contacts the quartile leans on the worst; it must leave one of them out all the same.
    share = max(0.25, 1.0 / max(1, len(floored) - 1))
    many = int(heard.sum()) >= _ENOUGH
    return Likeness(
        typical=float(np.median(floored)),
        quartile=float(np.quantile(floored, share)),
        limit=REFUSE_BELOW if many else REFUSE_FEW_BELOW,
        many=many,
    )


def gates(search: Search, count: int, members: IntArray, fits: FloatArray) -> tuple[Gate, ...]:
    """One gate a contact, from the fits of those that were used."""
    fit_of = dict(zip(members.tolist(), fits.tolist(), strict=True))
    return tuple(
        Gate(
            fit=fit_of.get(k),
            missed=k not in fit_of,
            slipped=k in fit_of and fit_of[k] < SLIPPED_BELOW,
            repeats=_repeated(search, k),
        )
        for k in range(count)
    )


def refuse_bad_fit(search: Search, members: IntArray, fits: FloatArray) -> None:
    """Raise where the contacts taken together cannot be of this object.

    One bad contact is flagged, not refused: the median asks whether half of them fit, and the
    quartile whether all but one in four do.

    Raises:
        FitRefused: naming the worst contact.
    """
    if len(members) == 0:
        raise FitRefused(
            "no tactile image shows a contact, so there is nothing to localize; "
            "check that the gel touches (press deeper) and that the background is of this sensor"
        )
    likeness = likeness_of(search, members, fits)
    if likeness.margin >= 0.0:
        return
    typical, quartile, limit = likeness.typical, likeness.quartile, likeness.limit
    worst = int(np.argmin(fits))
    raise FitRefused(
        f"no place on this object explains the contacts: the median of their fits is {typical:.1f} nats "
        f"(limit {limit:g}) and the lower quartile {quartile:.1f} (limit {REFUSE_QUARTILE_BELOW:g}); "
        f"the worst is contact {int(members[worst]) + 1} with {fits[worst]:.1f}. Check that it is this "
        "object, its units, that its normals point outward, and that the tactile image is not mirrored"
    )


def refuse_inside_out(search: Search, one: Hypotheses, members: IntArray) -> None:
    """Raise where most contacts touch the surface from the side its normals call inside.

    Raises:
        FitRefused: naming the contact that faces away most.
    """
    surface, object_from_base = search.surface, search.prior.object_from_base(one.yaws)[0]
    points = [search.surface_points(int(k), one)[0] for k in members]
    axes = [object_from_base @ search.contacts[int(k)].axis for k in members]
    # Cosines between the tool's axis and the outward normal; -1 for a square press.
    normals = [surface.normals[surface.tree.query(point)[1]] for point in points]
    facing = np.array([float(normal @ axis) for normal, axis in zip(normals, axes, strict=True)])
    if np.mean(facing > 0.0) > 0.5:
        # Beside a thin wall the nearest sample may be of its other face: half of the contacts are no
        # majority, and a contact alone is believed where a wall's other face is near.
        if len(members) == 1:
            near = surface.normals[surface.tree.query_ball_point(points[0], _WALL)]
            if (near @ axes[0] < -0.5).any():
                return
        worst = int(members[np.argmax(facing)])
        raise FitRefused(
            f"the object is inside out: its normals point away from the gel at most contacts, the worst is "
            f"contact {worst + 1}, where the angle between tool and outward normal is "
            f"{np.degrees(np.arccos(min(1.0, float(facing.max())))):.0f} degrees (at least 90 wanted); "
            "turn the faces of the mesh"
        )


def _repeated(search: Search, contact: int) -> int | None:
    for earlier in range(contact):
        near = np.linalg.norm(search.positions[contact] - search.positions[earlier]) < SAME_PLACE
        if near and search.axes[contact] @ search.axes[earlier] > np.cos(SAME_AXIS):
            return earlier
    return None
