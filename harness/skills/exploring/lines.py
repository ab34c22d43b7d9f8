"""Lines into what is not known: straight ways of the gel that end at a touch, or nowhere."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import MotionRefused, WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.skills.exploring.surroundings import Surroundings
from harness.skills.press import ContactMotion
from harness.twin.motion import PlannedContact, plan_contact
from harness.twin.rehearsal import rehearse

LINES = 40
"""Lines that are tried, for a way that suggests itself first and then once more for one that is searched."""

SLANTS = (0.0, 0.0, 1.3, 1.5, 1.5)
"""Rad from straight down, of lines into the unknown: most things have level tops and upright sides, and a
sensor that slants to what it meets is stopped by its housing. A flat thing is met from above alone."""

LOWEST = 6.0e-3
"""M above the support where a line from above ends, unless what it leads to is known to be flatter."""


_LIKE = (10.0e-3, float(np.cos(np.radians(20.0))))
"""M beside each other, and cosine between them, of lines that would read the same."""


@dataclass(frozen=True, eq=False)
class LineTarget:
    """Where a line leads.

    Attributes:
        end: ``(3,)`` m in base, of the gel's middle were nothing there; a line from above goes on down.
        bearing: rad about the vertical, the side that a slanting line comes from; None for any.
        above: whether it comes straight from above.
        lowest: m above the support where it ends, coming from above.
    """

    end: FloatArray
    bearing: float | None = None
    above: bool = False
    lowest: float = LOWEST


def lines_to(
    aims: Iterable[LineTarget], here: Surroundings, support: float, random: np.random.Generator
) -> Iterator[FloatArray]:
    """``(4, 4)`` where the gel would end were nothing there.

    Args:
        aims: one a line.
        here: whose gel it is.
        support: m, height of what the object stands on.
        random: what slants and turns are drawn from.
    """
    half = 0.5 * max(here.station.gel.sensor.housing)
    for aim in aims:
        slant = 0.0 if aim.above else random.choice(SLANTS)
        way = random.uniform(-np.pi, np.pi) if aim.bearing is None else aim.bearing
        inward = -np.array([np.sin(slant) * np.cos(way), np.sin(slant) * np.sin(way), np.cos(slant)])
        lowest = support + aim.lowest + half * np.sin(slant)
        height = lowest if slant == 0.0 else max(lowest, aim.end[2])
        end = np.array([*aim.end[:2], height])
        yield transform(frame_facing(inward, random.uniform(0.0, 2.0 * np.pi)), end)


def unlike_first(lines: Iterable[FloatArray], before: Sequence[FloatArray]) -> list[FloatArray]:
    """The same lines, those last that would go where others have gone.

    Args:
        lines: ``(4, 4)`` each, of ``gel`` at their ends.
        before: ``(4, 4)`` each, those that were followed, whatever they met.
    """

    def like(one: FloatArray, other: FloatArray) -> bool:
        apart = one[:3, 3] - other[:3, 3]
        aside = apart - (apart @ one[:3, 2]) * one[:3, 2]
        return bool(one[:3, 2] @ other[:3, 2] > _LIKE[1] and np.linalg.norm(aside) < _LIKE[0])

    return sorted(lines, key=lambda line: any(like(line, other) for other in before))


def contact_along(here: Surroundings, lines: Iterable[FloatArray], press: float) -> dict[str, Any]:
    """The parameters of a contact along the first of these lines that has a free way.

    Args:
        here: where the arm moves.
        lines: ``(4, 4)`` each in base, where the gel would end were nothing there.
        press: m to press on after the first touch.

    Raises:
        WrongUse: none has.
    """
    tried = list(lines)
    for searched in (0, 1):
        for base_from_gel in tried:
            contact = _planned(here, base_from_gel, searched)
            if contact is not None:
                motion = ContactMotion.planned(contact, here.nothing.flange_from_gel, press, 0.0)
                return motion.to_parameters()
    raise WrongUse(
        f"no free way was found on any of {len(tried)} lines to where the object should be, around all the "
        "space that it may take; say that it is smaller, where that is known, or give another place"
    )


def _planned(here: Surroundings, base_from_gel: FloatArray, searched: int) -> PlannedContact | None:
    contact = plan_contact(here.nothing, base_from_gel, here.joints, searched=searched, travels=here.travels)
    if contact is None:
        return None
    try:
        rehearse(here.travels, contact.travels(0)).require()
        rehearse(here.nothing, contact.lines(0, press=False)).require()
    except MotionRefused:
        return None
    return contact
