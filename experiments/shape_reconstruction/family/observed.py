"""Readings as arrays that a shape is compared with: contact points, free places, rays of the silhouette."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.contact_points import CLEAR
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.geometry import apply

POINTS_A_TOUCH = 6
"""Points of a contact that are fitted: they span it, and more say the same again."""

POINT_WEIGHT = 3.0
"""Independent points that a contact counts as: its height and its two slopes."""

CLEAR_WEIGHT = 4.0
"""Independent places that those of a contact's gel that touched nothing count as, at most."""

PRIOR_POINTS, PRIOR_WEIGHT = 48, 8.0
"""Points of the single-view prior that a shape is compared with; independent points that they count as."""

MODEL = 0.7e-3
"""Standard deviation of the nearest shape of the family from a real surface, m."""

NORMAL_MODEL = float(np.radians(6.0))
"""Standard deviation of its normals from those of the surface, rad."""

NORMAL_SPREAD_FACTOR = 0.5
"""Error of the mean normal over the spread of a contact's normals, which is wide at an edge."""

HOUSING_FACTOR = 2.0
"""Factor on a contact's deviation for a housing in contact: its nearest place jumps as a shape moves, and a
smaller factor leads more searches to a wrong local minimum."""

_LEVEL_SIGHT = 0.1
"""A camera that looks less steeply down does not see places on the support apart."""

_LAYERS = (0.0, 8.0e-3, 20.0e-3, 40.0e-3, 70.0e-3, 110.0e-3)
_ACROSS = 5
_WAY_STEP = 8.0e-3


class SightRays(NamedTuple):
    """Rays of one camera in ``stand``."""

    eye: FloatArray  #: ``(3,)`` m.
    directions: FloatArray  #: ``(n, 3)`` unit.
    kinds: IntArray  #: ``(n,)`` ``PASS``, ``GRAZE`` or ``MEET``.
    weight: FloatArray  #: ``(n,)`` weight of each one's squared residual.
    gain: FloatArray  #: ``(n,)`` factors on distances: thin parts far outside the mask are as wrong.
    pixel: float  #: m per pixel at the object, a first guess of it.
    right: FloatArray  #: ``(3,)`` unit, axes of the picture.
    down: FloatArray  #: ``(3,)`` unit, axes of the picture.
    middle: FloatArray  #: ``(3,)`` unit, towards the middle of the mask.
    position_sigma: float  #: m at the object, by which the camera's errors shift the picture.
    scale_sigma: float  #: relative error of the picture's scale.
    step: float  #: m between places on a ray where a shape is looked for.


class FamilyEvidence(NamedTuple):
    """Readings as the compiled residuals take them."""

    points: FloatArray  #: ``(n, 3)`` m of the surface.
    touch: IntArray  #: ``(n,)`` which contact each is of.
    sigma: FloatArray  #: ``(contacts,)`` m of each contact's points.
    weight: FloatArray  #: ``(contacts,)`` weight of each point's squared residual.
    middles: FloatArray  #: ``(contacts, 3)`` m, where the normals are taken.
    normals: FloatArray  #: ``(contacts, 3)`` unit, outward.
    normal_sigma: FloatArray  #: ``(contacts,)``.
    gel: FloatArray  #: ``(contacts, 3, 3)`` rotations, stand from gel.
    clear: FloatArray  #: ``(c, 3)`` points of the gel's face that touched nothing next to a contact, m.
    clear_touch: IntArray  #: ``(c,)`` which contact each is of.
    clear_weight: FloatArray  #: ``(contacts,)`` weight of each such place's squared residual.
    faces: FloatArray
    """``(h, 3, 3)`` m, of each housing in contact: the middle of its face, and half of either side."""
    face_gel: FloatArray  #: ``(h, 3, 3)`` rotations, stand from gel.
    face_sigma: FloatArray  #: ``(h,)`` m.
    free: FloatArray  #: ``(k, 3)`` m where the sensor was, so that the object is not.
    rays: SightRays  #: of the picture; none without one.
    prior_points: FloatArray  #: ``(s, 3)`` points of the single-view prior, m.
    prior_weight: float  #: weight of each such place's squared residual.
    prior_right: FloatArray  #: ``(3,)`` their shift along the support per shift of the picture to the right.
    prior_down: FloatArray  #: ``(3,)`` the same of a shift down.


def observe(evidence: ShapeEvidence, coarse: bool = False) -> FamilyEvidence:
    """The arrays of some evidence; ``coarse`` takes fewer of all, for ranking many shapes.

    A shape that is not yet laid meets a face at any of its places: those are for shapes that nearly fit.
    """
    contacts = evidence.contacts
    per_touch = 3 if coarse else POINTS_A_TOUCH
    chosen = [farthest_points(touch.points, per_touch) for touch in contacts]
    points = [touch.points[rows] for touch, rows in zip(contacts, chosen, strict=True)]
    # They lie far from each other, each from those before: the first are spread as all are.
    clear = [touch.clear[: CLEAR // 2 if coarse else CLEAR] for touch in contacts]
    sigma = np.array([np.hypot(touch.sigma, MODEL) for touch in contacts])
    stopped = () if coarse else evidence.ended_by_housing
    faces = []
    for touch in stopped:
        # The middle of the housing's face at the end of a way, and half of either side.
        turn, half = touch.stand_from_gel[:3, :3], 0.5 * np.array(evidence.housing)
        middle = apply(touch.stand_from_gel, np.array([[0.0, 0.0, -evidence.gel_thickness]]))[0]
        faces.append([middle, half[0] * turn[:, 0], half[1] * turn[:, 1]])
    most = PRIOR_POINTS // 3 if coarse else PRIOR_POINTS
    predicted = evidence.prior_points[:: max(-(-len(evidence.prior_points) // most), 1)]
    rays = no_rays() if evidence.look is None else sight_rays(evidence.look, coarse)
    return FamilyEvidence(
        points=_stacked(points, 3),
        touch=_numbered(points),
        sigma=sigma,
        weight=np.array([min(POINT_WEIGHT, len(rows)) / len(rows) for rows in points]),
        middles=_stacked([touch.points.mean(axis=0)[None] for touch in contacts], 3),
        normals=_stacked([touch.mean_normal[None] for touch in contacts], 3),
        normal_sigma=np.array(
            [
                np.hypot(np.hypot(one.normal_sigma, NORMAL_MODEL), NORMAL_SPREAD_FACTOR * one.normal_spread)
                for one in contacts
            ]
        ),
        gel=np.array([touch.stand_from_gel[:3, :3] for touch in contacts]).reshape(-1, 3, 3),
        clear=_stacked(clear, 3),
        clear_touch=_numbered(clear),
        clear_weight=np.array([min(1.0, CLEAR_WEIGHT / max(len(rows), 1)) for rows in clear]),
        faces=np.array(faces).reshape(-1, 3, 3),
        face_gel=np.array([touch.stand_from_gel[:3, :3] for touch in stopped]).reshape(-1, 3, 3),
        face_sigma=np.array([HOUSING_FACTOR * np.hypot(touch.sigma, MODEL) for touch in stopped]),
        free=_free_places(evidence, coarse),
        rays=rays,
        prior_points=_stacked([predicted], 3),
        prior_weight=PRIOR_WEIGHT / max(len(predicted), 1),
        prior_right=_along_support(rays.right, rays.middle),
        prior_down=_along_support(rays.down, rays.middle),
    )


def _along_support(shift: FloatArray, sight: FloatArray) -> FloatArray:
    """``(3,)`` level: where a line of sight goes to on the support as the camera is shifted by a vector."""
    if sight[2] > -_LEVEL_SIGHT:
        return np.array([shift[0], shift[1], 0.0])
    return np.asarray(shift - sight * (shift[2] / sight[2]))


def _stacked(parts: list[FloatArray], columns: int) -> FloatArray:
    return read_only(np.concatenate([np.empty((0, columns)), *parts]))


def _numbered(parts: list[FloatArray]) -> IntArray:
    return np.repeat(np.arange(len(parts)), [len(rows) for rows in parts]).astype(np.int64)


def _free_places(evidence: ShapeEvidence, coarse: bool) -> FloatArray:
    """``(k, 3)`` m inside the housing and, of a miss, before the gel, above the support."""
    across = 3 if coarse else _ACROSS
    depths = [0.0, 25.0e-3] if coarse else [d for d in _LAYERS if d <= evidence.housing_depth]
    housing = [_plate(evidence.housing, across, -evidence.gel_thickness - depth) for depth in depths]
    half = (0.6 * evidence.housing[0], 0.6 * evidence.housing[1])
    places = []
    for touch in evidence.distinct:
        boxes = list(housing)
        if not touch.met:
            # The gel itself went all this way and touched nothing.
            steps = np.arange(0.0, max(touch.way, _WAY_STEP), _WAY_STEP * (2 if coarse else 1))
            boxes += [_plate(half, 3, -step) for step in steps]
        places.append(apply(touch.stand_from_gel, np.concatenate(boxes)))
    free = _stacked(places, 3)
    return np.ascontiguousarray(free[free[:, 2] > 0.0])


def _plate(sides: tuple[float, float], across: int, z: float) -> FloatArray:
    share = np.linspace(-0.5, 0.5, across)
    x, y = np.meshgrid(share * sides[0], share * sides[1])
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


PASS, GRAZE, MEET = 0, 1, 2
"""Kinds of rays."""

OUTLINE_WEIGHT = 60.0
"""Independent readings that all grazing rays together count as at most: neighbours err alike."""

GAIN = 0.5
"""Growth of a factor on distances per pixel from the mask."""

_GRAZING = (36, 120)
_MEETING = (12, 60)
_PASSING = ((2.0, 14, 70), (4.0, 12, 60), (9.0, 10, 50), (20.0, 8, 40), (45.0, 5, 30), (90.0, 3, 20))
"""Distances from the mask, pixels, and numbers of rays there: for ranking and for fitting."""

_STEPS = (5.0e-3, 2.5e-3)
"""M between places on a ray, for ranking and for fitting: a cup then seems 0.1 mm too far from it
at most."""

_SMOOTH = 0.8
_CLEAR = 2


def no_rays() -> SightRays:
    """Return the rays of no picture."""
    zero, empty = np.zeros(3), np.empty(0)
    kinds = np.empty(0, np.int64)
    return SightRays(
        zero, np.empty((0, 3)), kinds, empty, empty, 1e-3, zero, zero, zero, 1e-3, 1e-3, _STEPS[1]
    )


@lru_cache(maxsize=4)
def sight_rays(look: SeenMask, coarse: bool) -> SightRays:
    """Rays through a mask; none where it is empty. A run's estimates share one look: its rays are kept."""
    if not look.mask.any():
        return no_rays()
    which = 0 if coarse else 1
    clear = ~ndimage.binary_dilation(look.hidden, iterations=_CLEAR) if look.hidden.any() else ~look.hidden
    outline = _spread(_outline(look.mask, clear), _GRAZING[which])
    rows, columns = np.nonzero((ndimage.distance_transform_edt(look.mask) > 1.5) & clear)
    inside = _spread(np.column_stack([columns + 0.5, rows + 0.5]), _MEETING[which])
    # Places around the mask, dense near it: what is near is what a shape would stick out into.
    distances = ndimage.distance_transform_edt(~look.mask)
    around, pixels_away = [np.empty((0, 2))], [np.empty(0)]
    for pixels, *counts in _PASSING:
        rows, columns = np.nonzero((np.abs(distances - pixels) < 0.8) & clear)
        spread = _spread(np.column_stack([columns + 0.5, rows + 0.5]), counts[which])
        around.append(spread)
        pixels_away.append(np.full(len(spread), pixels))
    outside, away = np.concatenate(around), np.concatenate(pixels_away)
    places = np.concatenate([outline, inside, outside])
    kinds = np.repeat([GRAZE, MEET, PASS], [len(outline), len(inside), len(outside)]).astype(np.int64)
    weight = np.ones(len(places))
    weight[: len(outline)] = min(1.0, OUTLINE_WEIGHT / max(len(outline), 1))
    gain = np.ones(len(places))
    gain[len(places) - len(outside) :] += GAIN * away
    return _rays(look, places, kinds, (weight, gain), _STEPS[which])


def _rays(
    look: SeenMask, places: FloatArray, kinds: IntArray, weights: tuple[FloatArray, FloatArray], step: float
) -> SightRays:
    rotation, eye = look.stand_from_camera[:3, :3], np.ascontiguousarray(look.stand_from_camera[:3, 3])
    directions = directions_of(look, places)
    rows, columns = np.nonzero(look.mask)
    middle = directions_of(look, np.array([[columns.mean() + 0.5, rows.mean() + 0.5]]))[0]
    # Down to the support, where the middle of the mask looks; a few metres where it never does.
    away = min(eye[2] / max(-middle[2], 0.05), 5.0) if eye[2] > 0.0 else 1.0
    return SightRays(
        eye=eye,
        directions=directions,
        kinds=kinds,
        weight=weights[0],
        gain=weights[1],
        pixel=away / look.focal_length,
        right=np.ascontiguousarray(rotation[:, 0]),
        down=np.ascontiguousarray(rotation[:, 1]),
        middle=middle,
        position_sigma=float(np.hypot(look.position_error, look.rotation_error * away)),
        scale_sigma=float(np.hypot(look.focal_length_error, look.position_error / away)) + 1e-4,
        step=step,
    )


def directions_of(look: SeenMask, places: FloatArray) -> FloatArray:
    """``(n, 3)`` unit in ``stand``: where ``(n, 2)`` places (x, y) in the picture look."""
    rows, columns = look.mask.shape
    in_camera = np.ones((len(places), 3))
    in_camera[:, :2] = (places - 0.5 * np.array([columns, rows])) / look.focal_length
    in_camera /= np.linalg.norm(in_camera, axis=1, keepdims=True)
    return np.ascontiguousarray(in_camera @ look.stand_from_camera[:3, :3].T)


def _spread(places: FloatArray, count: int) -> FloatArray:
    if len(places) > 20 * count:
        places = places[:: len(places) // (20 * count) + 1]
    return places[farthest_points(np.ascontiguousarray(places), count)]


def _outline(mask: BoolArray, clear: BoolArray) -> FloatArray:
    """``(n, 2)`` places (x, y) where the smoothed mask passes one half, between pixels that are clear."""
    smooth = ndimage.gaussian_filter(mask.astype(np.float64), _SMOOTH)
    found = []
    for axis in (0, 1):
        before, after = (smooth[:-1], smooth[1:]) if axis == 0 else (smooth[:, :-1], smooth[:, 1:])
        seen = clear[:-1] & clear[1:] if axis == 0 else clear[:, :-1] & clear[:, 1:]
        rows, columns = np.nonzero(((before >= 0.5) != (after >= 0.5)) & seen)
        a, b = before[rows, columns], after[rows, columns]
        share = (0.5 - a) / (b - a)
        y = rows + 0.5 + (share if axis == 0 else 0.0)
        x = columns + 0.5 + (share if axis == 1 else 0.0)
        found.append(np.column_stack([x, y]))
    places = np.concatenate(found)
    height, width = mask.shape
    edge = (places[:, 0] < 3) | (places[:, 1] < 3) | (places[:, 0] > width - 3) | (places[:, 1] > height - 3)
    return np.asarray(places[~edge])


@compiled
def farthest_points(points: FloatArray, count: int) -> IntArray:
    """Rows of ``(n, d)`` points, each the farthest from those before it (Gonzalez, 1985); all where few.

    The first is the nearest to their middle, so that the choice does not depend on their order.
    """
    n = len(points)
    if n <= count:
        return np.arange(n)
    middle = np.zeros(points.shape[1])
    for i in range(n):
        middle += points[i] / n
    gap = np.empty(n)
    for i in range(n):
        gap[i] = np.sum((points[i] - middle) ** 2)
    chosen = np.empty(count, np.int64)
    chosen[0] = np.argmin(gap)
    gap[:] = np.inf
    for k in range(1, count):
        for i in range(n):
            gap[i] = min(gap[i], np.sum((points[i] - points[chosen[k - 1]]) ** 2))
        chosen[k] = np.argmax(gap)
    return chosen
