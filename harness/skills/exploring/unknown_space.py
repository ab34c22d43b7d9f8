"""An object of unknown shape: the space that it may take, and where lines to it lead.

Nothing is known of it but how large it may be. Without a look the object is anywhere in an
upright cylinder; a look adds that no part of it is beside its outline.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from harness.basics.arrays import FloatArray, read_only
from harness.basics.mesh import Mesh, closed_hull, hull_of
from harness.bench.instruments.cameras import CameraSection
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import SeenOutline, corners_of, directions
from harness.skills.exploring.lines import LINES, LineTarget

SIDES = 24
"""Of the upright prism that stands for the cylinder, and holds it."""

PIXELS = 1.5
"""By which a mask may leave out the object's border."""

FLAT = 0.25
"""Height of an object's middle over half its width below which it is thought of as lying."""

LYING = 5.0e-3
"""M above the support of the middle of an object that lies."""

ENDS = (0.7, 0.95)
"""From and to: share of the way from an object's middle to its seen end that a line leads to."""

_LEAST = 1.0e-3
_ASIDE = (-0.3, 0.3)
"""Rad from straight out, where a line to an end comes from; from farther aside the housing meets walls."""

_WANDER = 0.2
"""Of the way from the middle to an end: deviation of where lines lead about what they lead to."""

_A_TARGET = 5
"""Lines to one target before the next is tried."""

PLACES = 3.0
"""Standard deviations of its place that are kept free around it."""

MARGIN = 5.0e-3
"""M around an object wherever it may stand, in every direction: its tilt, and what its model leaves out."""

SHARE = 0.03
"""Of its size, in addition."""

_ROUND = 16


@dataclass(frozen=True, eq=False)
class UnknownStand:
    """Where an object of unknown shape was put, and what looks at it."""

    place: FloatArray  #: ``(3,)`` m in base, nominally: its middle, on the support.
    errors: CameraErrors  #: of that, and of the camera.
    camera: CameraSection | None = None  #: of the station; None without.

    @property
    def looking(self) -> CameraSection:
        """The camera; there is an outline, so there is one."""
        assert self.camera is not None
        return self.camera


@dataclass(frozen=True, eq=False)
class SeenThing:
    """Where an object of unknown shape is by a look, were it deep as it is wide."""

    middle: FloatArray  #: ``(3,)`` m in base.
    ends: FloatArray  #: ``(2, 3)`` m in base, of its longest chord in the picture.
    height: float  #: m above the support, of its top.
    off: FloatArray
    """``(2,)`` m in base: one standard deviation of where it is, along the line of sight; none where it lies,
    and the support says how far off it is."""

    @property
    def lies(self) -> bool:
        """Whether it is so flat that only a line from above meets it."""
        return not self.off.any()


def unknown_space(stand: UnknownStand, outline: SeenOutline | None, largest: float) -> Mesh:
    """All that an object of unknown shape may take, in base.

    Args:
        stand: where it was put.
        outline: of the picture; None without a look.
        largest: m, its longest side at most.
    """
    reach = largest / np.sqrt(2.0) + PLACES * stand.errors.place
    turns = np.arange(SIDES) * 2.0 * np.pi / SIDES
    normals = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(SIDES)])
    around_place = np.column_stack([normals, -normals @ stand.place - reach])
    high = PLACES * stand.errors.support
    top = np.array([0.0, 0.0, 1.0, -(stand.place[2] + largest + high)])
    bottom = np.array([0.0, 0.0, -1.0, stand.place[2] - high])
    sides = np.concatenate([around_place, top[None], bottom[None]])
    seen = sides if outline is None else np.concatenate([sides, _cone(stand, outline)])
    corners = _corners_between(seen)
    if corners is None:  # it was seen where it cannot be: the look is not believed
        corners = _corners_between(sides)
    assert corners is not None
    return around(corners, 0.0, margin_of(largest), float(stand.place[2]))


def _cone(stand: UnknownStand, outline: SeenOutline) -> FloatArray:
    """``(n, 4)`` half-spaces through the camera: the object is on the inner side of each."""
    camera, errors = stand.looking, stand.errors
    pose, focal = camera.base_from_camera.matrix, camera.focal_length
    towards, centre = directions(), _centre(camera)
    off_axis = float(np.linalg.norm(corners_of(outline) - centre, axis=1).max())
    turned = errors.rotation * (focal + off_axis + off_axis**2 / focal) + errors.focal_length * off_axis
    reach = outline.extents + PIXELS + PLACES * turned - towards @ centre
    in_camera = np.column_stack([focal * towards, -reach])[~outline.hidden]
    normals = in_camera @ pose[:3, :3].T / np.linalg.norm(in_camera, axis=1)[:, None]
    return np.column_stack([normals, -normals @ pose[:3, 3] - PLACES * errors.position])


def _centre(camera: CameraSection) -> FloatArray:
    return np.array([0.5 * camera.columns, 0.5 * camera.rows])


def _corners_between(sides: FloatArray) -> FloatArray | None:
    """``(n, 3)`` corners of what is within all half-spaces; None where nothing is."""
    spaced = np.column_stack([sides[:, :3], np.ones(len(sides))])
    inner = linprog([0.0, 0.0, 0.0, -1.0], A_ub=spaced, b_ub=-sides[:, 3], bounds=[(None, None)] * 4).x
    if inner is None or inner[3] < _LEAST:
        return None
    return np.asarray(HalfspaceIntersection(sides, inner[:3]).intersections)


def seen_thing(stand: UnknownStand, outline: SeenOutline) -> SeenThing:
    """Where an outline's middle and its ends are: at the distance of the support, or of the nominal place."""
    camera, support = stand.looking, float(stand.place[2])
    level = (stand.place - camera.base_from_camera.matrix[:3, 3]) * [1.0, 1.0, 0.0]
    sight = level / np.linalg.norm(level)
    centre = 2.0 * (outline.extents[:, None] * directions()).mean(axis=0)  # Steiner's point of the outline
    middle, *ends = (_met(camera, pixel, sight, stand.place) for pixel in (centre, *_chord(outline)))
    tall = float(middle[2]) - support
    off = stand.errors.place * sight[:2]
    if tall < FLAT * 0.5 * np.linalg.norm(ends[1] - ends[0]):
        above = np.array([*stand.place[:2], support + LYING])
        up = np.array([0.0, 0.0, 1.0])
        middle, *ends = (_met(camera, pixel, up, above) for pixel in (centre, *_chord(outline)))
        off = np.zeros(2)
    return SeenThing(middle, np.array(ends), max(2.0 * tall, 0.0), off)


def _chord(outline: SeenOutline) -> list[FloatArray]:
    """``(2,)`` pixels each: the two corners of an outline that are farthest apart along a direction."""
    half, corners = len(outline.extents) // 2, corners_of(outline)
    longest = directions()[int((outline.extents[:half] + outline.extents[half:]).argmax())]
    return [corners[int((side * corners @ longest).argmax())] for side in (-1.0, 1.0)]


def _met(camera: CameraSection, pixel: FloatArray, normal: FloatArray, place: FloatArray) -> FloatArray:
    """``(3,)`` m in base, where the line of sight of a pixel meets a plane through a place."""
    pose = camera.base_from_camera.matrix
    ray = pose[:3, :3] @ np.array([*(pixel - _centre(camera)) / camera.focal_length, 1.0])
    return np.asarray(pose[:3, 3] + ray * (normal @ (place - pose[:3, 3])) / (normal @ ray))


def aims_of_seen(
    seen: SeenThing, support: float, contacts: int, random: np.random.Generator
) -> Iterator[LineTarget]:
    """Where lines lead after a look: to its middle and its ends in turn, at heights drawn anew.

    Args:
        seen: by the look.
        support: m, height of what it stands on.
        contacts: made before: each begins with another target.
        random: what heights and bearings are drawn from.
    """
    wander = _WANDER * 0.5 * float(np.linalg.norm(seen.ends[1] - seen.ends[0]))
    for k in range(LINES):
        target = (contacts + k // _A_TARGET) % 3
        out = np.zeros(2)
        if target > 0:
            out = random.uniform(*ENDS) * (seen.ends[target - 1] - seen.middle)[:2]
        off = random.normal() * seen.off + wander * random.normal(size=2) if k else np.zeros(2)
        height = support + random.uniform(0.0, 0.9) * seen.height
        bearing = None if target == 0 else float(np.arctan2(out[1], out[0])) + random.uniform(*_ASIDE)
        above = seen.lies or (k == 0 and contacts == 0)
        yield LineTarget(np.array([*seen.middle[:2] + out + off, height]), bearing, above)


def aims_unseen(
    place: FloatArray, error: float, height: float, first: bool, random: np.random.Generator
) -> Iterator[LineTarget]:
    """Where lines lead without a look: to where the object should stand, and about.

    Args:
        place: ``(3,)`` m in base, where the object, or what was seen of it, nominally stands.
        error: m, one standard deviation of that, per axis.
        height: m above the support, up to which lines end.
        first: whether the first of them leads right there.
        random: what the rest is drawn from.
    """
    for k in range(LINES):
        aside = np.zeros(2) if k == 0 and first else random.normal(0.0, error, 2)
        yield LineTarget(place + np.array([*aside, random.uniform(0.0, height)]), above=first and k == 0)


def margin_of(size: float) -> float:
    """M that are kept free around an object of a size in m, beside where it may be put."""
    return MARGIN + SHARE * size


def around(places: FloatArray, off: float, margin: float, support: float) -> Mesh:
    """The convex hull of all that is near ``(n, 3)`` m in base, above a support.

    Args:
        places: of an object.
        off: m along the support, in any direction.
        margin: m beyond that, in every direction.
        support: m, height of the support: what the hull has below it is cut off.
    """
    moved = hull_of(_sum(places, off * _disc()))
    return closed_hull(_above(_sum(moved, margin * _ball()), support))


def _sum(places: FloatArray, shifts: FloatArray) -> FloatArray:
    return np.asarray((places[:, None] + shifts).reshape(-1, 3))


@cache
def _disc() -> FloatArray:
    """``(n, 3)`` corners of a level polygon that holds the unit disc."""
    turns = np.arange(_ROUND) * 2.0 * np.pi / _ROUND
    reach = 1.0 / np.cos(np.pi / _ROUND)
    return read_only(np.column_stack([reach * np.cos(turns), reach * np.sin(turns), np.zeros(_ROUND)]))


@cache
def _ball() -> FloatArray:
    """``(26, 3)`` corners of a polytope that holds the unit ball: to a cube's sides, edges and corners."""
    ways = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
    ways = ways / np.linalg.norm(ways, axis=1)[:, None]
    nearest_side = -float(ConvexHull(ways).equations[:, 3].max())
    return read_only(ways / nearest_side)


def _above(places: FloatArray, height: float) -> FloatArray:
    """``(m, 3)`` that span the part above a height of the convex hull of ``(n, 3)`` m.

    To lift what is below would not do: the hull of lifted corners lacks places above the height.
    """
    hull = ConvexHull(places)
    edges = np.concatenate([hull.simplices[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    start, end = places[edges[:, 0]], places[edges[:, 1]]
    crossing = (start[:, 2] - height) * (end[:, 2] - height) < 0.0
    start, end = start[crossing], end[crossing]
    share = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
    cut = start + share[:, None] * (end - start)
    cut[:, 2] = height
    corners = places[hull.vertices]
    return np.concatenate([corners[corners[:, 2] >= height], cut])
