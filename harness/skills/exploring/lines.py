"""Lines into what is not known: straight ways of the gel that end at a touch, or nowhere.

What of the sensor a surface meets first on a line, the gel or the housing, comes from the face of the sensor,
which is looked at in a few places, each as a ray along the way.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import MotionRefused, WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.basics.mesh import Mesh, closed_hull
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.skills.press import ContactMotion
from harness.skills.strike import StrikeMotion
from harness.twin.bench import TwinBench
from harness.twin.motion import PlannedContact, PlannedStrike, plan_contact
from harness.twin.rehearsal import rehearse


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The bench around an object of which too little is known."""

    scene: SceneFile  #: of the run.
    station: Station  #: whose arm it is.
    travels: TwinBench  #: the bench with all the space that the object may take in its place.
    nothing: TwinBench  #: the bench without an object.
    joints: FloatArray  #: ``(6,)`` rad, where the arm is.


LINES = 40
"""Lines that are tried, for a way that suggests itself first and then once more for one that is searched."""

SLANTS = (0.0, 0.0, 1.3, 1.5, 1.5)
"""Rad from straight down, of lines into the unknown: most things have level tops and upright sides, and a
sensor that slants to what it meets is stopped by its housing. A flat thing is met from above alone."""

LOWEST = 6.0e-3
"""M above the support where a line from above ends, unless what it leads to is known to be flatter."""

_LIKE = (10.0e-3, float(np.cos(np.radians(20.0))))
"""M beside each other, and cosine between them, of lines that would read the same."""

_STEPS = (-1.0, -0.5, 0.0, 0.5, 1.0)
_GRID = np.array([[x, y] for x in _STEPS for y in _STEPS])
_GEL = read_only(_GRID * [8.0e-3, 6.0e-3])
_AROUND = read_only(0.5 * _GRID[np.abs(_GRID).max(axis=1) == 1.0])

MIDDLE = 12
"""Of ``face_places``, the gel's middle."""

PRESSED = 1.0e-3
"""M that the gel is pressed on by after it has met something, for which the housing must have room."""


@dataclass(frozen=True, eq=False)
class LineTarget:
    """Where a line leads."""

    end: FloatArray
    """``(3,)`` m in base, of the gel's middle were nothing there; a line from above goes on down."""
    bearing: float | None = None
    """rad about the vertical, the side that a slanting line comes from; None for any."""
    above: bool = False  #: whether it comes straight from above.
    lowest: float = LOWEST  #: m above the support where it ends, coming from above.


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


def face_places(housing: tuple[float, float], gel_thickness: float) -> FloatArray:
    """``(41, 3)`` m in ``gel``: 25 places of the gel's face, then 16 of the housing's border.

    Args:
        housing: ``(x, y)`` m, sides of the housing.
        gel_thickness: m by which the gel stands out of it.
    """
    gel = np.column_stack([_GEL, np.zeros(len(_GEL))])
    return np.concatenate([gel, np.column_stack([_AROUND * housing, np.full(len(_AROUND), -gel_thickness)])])


def ways_of(lines: FloatArray, places: FloatArray, back: float) -> tuple[FloatArray, FloatArray]:
    """Rays along which places of the face go.

    Args:
        lines: ``(n, 4, 4)`` of ``gel`` at the ends of straight ways along its z.
        places: ``(k, 3)`` m in ``gel``.
        back: m before its end from where on each way is followed.

    Returns:
        ``(n k, 3)`` m where rays begin, line by line; and their ``(n k, 3)`` unit directions.
    """
    begun = places - [0.0, 0.0, back]
    starts = lines[:, None, :3, 3] + np.einsum("nij,kj->nki", lines[:, :3, :3], begun)
    directions = np.repeat(lines[:, :3, 2], len(places), axis=0)
    return np.ascontiguousarray(starts.reshape(-1, 3)), np.ascontiguousarray(directions)


def gel_first(along: FloatArray) -> tuple[BoolArray, IntArray]:
    """Whether the gel reads what is met.

    Args:
        along: ``(n, 41)`` m that each of ``face_places`` goes until it meets something; infinite where it
            meets nothing.

    Returns:
        ``(n,)`` whether the gel meets something, and can be pressed on before the housing does; and ``(n,)``
        the place of the gel that does first.
    """
    gel, housing = along[:, : len(_GEL)], along[:, len(_GEL) :]
    first = gel.argmin(axis=1)
    at = gel[np.arange(len(gel)), first]
    return np.isfinite(at) & (housing.min(axis=1) > at + PRESSED), first


def nowhere(place: FloatArray) -> Mesh:
    """A mark of 2 mm on the support, in base: stands for an object of which nothing is known.

    Args:
        place: ``(3,)`` m in base: where the object nominally stands.
    """
    low = np.array([-1.0e-3, -1.0e-3, 0.0])
    ends = np.array([low, low + 2.0e-3]) + place
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    return closed_hull(corners)


def rehearsed_strike(strike: PlannedStrike, travels: TwinBench, lines: TwinBench) -> StrikeMotion:
    """A planned strike, gone through in the twin.

    Raises:
        MotionRefused: it must not be made.
    """
    rehearse(travels, strike.travels(0)).require()
    rehearse(lines, strike.lines(0)).require()
    return StrikeMotion.planned(strike)


def end_of(parameters: Any) -> FloatArray:
    """``(6,)`` rad: where a contact or a strike of these parameters leaves the arm."""
    travel = np.asarray(parameters["travel_rad"], dtype=np.float64).reshape(-1, 6)
    return travel[-1] if len(travel) else np.asarray(parameters["start_rad"], dtype=np.float64)
