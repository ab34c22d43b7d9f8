"""Whether the readings can be of this object at all, and which contact does not fit."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.search import SAME_AXIS, SAME_PLACE, Search
from harness.arrays import FloatArray, IntArray
from harness.errors import FitRefused

REFUSE_BELOW = -10.0
"""Nats a contact, mean over the contacts, at the best hypothesis."""

SLIPPED_BELOW = -12.0
"""Nats of one contact where the others fit."""


@dataclass(frozen=True)
class Gate:
    """How one contact fits the answer.

    Attributes:
        fit: nats at the best hypothesis, 0 at best; None where the image shows no contact.
        missed: the image shows no contact; the contact was not used.
        slipped: it fits much worse than the others: the object moved, or the gel slid.
        repeats: index of an earlier contact at the same place and attitude, or None; such
            presses together count once.
    """

    fit: float | None
    missed: bool
    slipped: bool
    repeats: int | None


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


def refuse_bad_fit(members: IntArray, fits: FloatArray) -> None:
    """Raise where the contacts taken together cannot be of this object.

    One bad contact is flagged, not refused: the median asks whether most of them fit.

    Raises:
        FitRefused: naming the worst contact.
    """
    if len(members) == 0:
        raise FitRefused(
            "no tactile image shows a contact, so there is nothing to localize; "
            "check that the gel touches (press deeper) and that the background is of this sensor"
        )
    typical = float(np.median(fits))
    if typical < REFUSE_BELOW:
        worst = int(np.argmin(fits))
        raise FitRefused(
            f"no place on this object explains the contacts: their median fit is {typical:.1f} nats, "
            f"the limit {REFUSE_BELOW:g}, and the worst is contact {int(members[worst]) + 1} with "
            f"{fits[worst]:.1f}; check that it is this object, its units, that its normals point outward, "
            "and that the tactile image is not mirrored"
        )


def refuse_inside_out(search: Search, gel: FloatArray, yaw: float, members: IntArray) -> None:
    """Raise where most contacts touch the surface from the side its normals call inside.

    Raises:
        FitRefused: naming the contact that faces away most.
    """
    facing = np.array([_facing(search, int(k), gel, yaw) for k in members])
    if np.median(facing) > 0.0:
        worst = int(members[np.argmax(facing)])
        raise FitRefused(
            f"the object is inside out: its normals point away from the gel at most contacts, the worst is "
            f"contact {worst + 1}, where the angle between tool and outward normal is "
            f"{np.degrees(np.arccos(min(1.0, float(facing.max())))):.0f} degrees (at least 90 wanted); "
            "turn the faces of the mesh"
        )


def _facing(search: Search, contact: int, gel: FloatArray, yaw: float) -> float:
    """Cosine between the tool's axis and the outward normal at a contact; -1 for a square press."""
    yaws = np.array([yaw])
    point = search.surface_points(contact, gel[None], yaws)[0]
    normal = search.surface.normals[search.surface.tree.query(point)[1]]
    axis = search.prior.object_from_base(yaws)[0] @ search.contacts[contact].axis
    return float(normal @ axis)


def _repeated(search: Search, contact: int) -> int | None:
    for earlier in range(contact):
        near = np.linalg.norm(search.positions[contact] - search.positions[earlier]) < SAME_PLACE
        if near and search.axes[contact] @ search.axes[earlier] > np.cos(SAME_AXIS):
            return earlier
    return None
