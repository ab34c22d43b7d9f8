"""Propose shapes: draws of the prior placed by the readings, and neighbours of a hypothesis.

A neighbour has a part added, removed or exchanged, or is rotated to a look-alike pose.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.kind import FamilyShape, Random
from experiments.shape_reconstruction.family.kinds import kind_of
from experiments.shape_reconstruction.family.observed import directions_of
from harness.basics.arrays import FloatArray

OWN = 0.3
"""Share of the draws that keep the size that they were drawn with."""

ENOUGH, SPANNED = 6, 0.5
"""Contacts whose box proposes the sides of a body with straight ones; share of such draws that take them."""

_BEYOND = 0.15
"""Logarithm by which sides may reach beyond the contacts."""

_MOST_SCALE = 1.6


@dataclass(frozen=True, eq=False)
class Guides:
    """Proposals that the readings make."""

    places: FloatArray  #: ``(contacts, 3)`` m, of the contacts.
    middles: FloatArray  #: ``(n, 2)`` m, where the object's middle may be, by its contacts.
    extents: FloatArray  #: ``(3,)`` m, of the box around the contacts and the support; zero without contacts.
    turns: FloatArray  #: ``(m,)`` directions that its long side or a flat side may face, rad.
    seen: FloatArray  #: ``(2,)`` width and height of the silhouette at 1 m, m; zero without one.
    eye: FloatArray  #: ``(3,)`` m, of the camera.
    middle_ray: FloatArray  #: ``(3,)`` unit, towards the middle of the silhouette's box.
    outline: FloatArray  #: ``(k, 3)`` unit, towards the silhouette's border; none without one.

    @property
    def sighted(self) -> bool:
        """True if there is a silhouette."""
        return len(self.outline) > 0

    @property
    def touched(self) -> bool:
        """True if there are contacts."""
        return len(self.middles) > 0

    def on_level(self, height: float) -> FloatArray:
        """``(k, 2)`` m: where the border's rays cross a height; those that never do are left out."""
        down = self.outline[self.outline[:, 2] < -0.05]
        away = (self.eye[2] - height) / -down[:, 2]
        return np.asarray(self.eye[:2] + away[:, None] * down[:, :2])


def place_sample(
    shape: FamilyShape, guides: Guides, random: Random, place_error: float, yaws: int
) -> FloatArray:
    """Move and scale a sample to the readings, at several yaws.

    Args:
        shape: a sample at the origin.
        guides: proposals of the readings.
        random: chooses between the proposals.
        place_error: standard deviation of the position without a reading, m.
        yaws: number of yaws; one where a rotation changes nothing.

    Returns:
        ``(yaws, size)`` vectors.
    """
    theta, kind = shape.theta.copy(), kind_of(shape.code)
    turn = None
    if guides.sighted and kind.is_elongated:
        found = _long_direction(guides.on_level(0.5 * kind.extent(shape.code, theta)[1]))
        turn = 0.0 if found is None else found
    theta[list(kind.lengths)] += _log_scale(shape, guides, random, turn)
    theta[layout.X : layout.Y + 1] = _middle(shape, theta, guides, random, place_error)
    count = yaws if kind.traits(shape.code).has_yaw else 1
    placed = np.repeat(theta[None], count, axis=0)
    # Yaws that the readings propose and their opposites, then any, evenly spread.
    turns = random.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * np.arange(count) / count
    if turn is not None:
        proposed = turn + np.pi * np.arange(count) + random.normal(0.0, 0.05, count)
        turns[:4] = proposed[:4]
    elif len(guides.turns):
        few = (count + 1) // 3
        turns[:few] = random.choice(guides.turns, few) + 0.5 * np.pi * random.integers(0, 4, few)
    placed[:, layout.YAW] = turns
    if kind.traits(shape.code).has_sides and len(guides.places) >= ENOUGH and random.random() < SPANNED:
        # A body with straight sides has the sides and the middle of the contacts' box, as it is turned.
        for one in placed:
            cosine, sine = np.cos(one[layout.YAW]), np.sin(one[layout.YAW])
            along = guides.places[:, :2] @ np.array([[cosine, -sine], [sine, cosine]])
            low, high = along.min(axis=0), along.max(axis=0)
            half = 0.5 * (high - low) * np.exp(random.uniform(0.0, _BEYOND))
            middle = 0.5 * (low + high)
            one[layout.X] = cosine * middle[0] - sine * middle[1]
            one[layout.Y] = sine * middle[0] + cosine * middle[1]
            kind.set_sides(one, half)
    return placed


def _log_scale(shape: FamilyShape, guides: Guides, random: Random, turn: float | None) -> float:
    """Compute the logarithm of the factor that makes a sample as large as the contacts or the silhouette."""
    if random.random() < OWN or not (guides.sighted or guides.touched):
        return 0.0
    half, height = kind_of(shape.code).extent(shape.code, shape.theta)
    if not guides.sighted:
        wide, high = float(np.linalg.norm(guides.extents[:2])), float(guides.extents[2])
        least = max(wide / (2.0 * half), high / height)
        # Contacts reach nearly all of it, or are few and in one part of it.
        scaled = np.log(least) + random.uniform(0.0, 0.35)
    elif turn is not None:
        level = guides.on_level(0.5 * height)
        along = level @ np.array([np.cos(turn), np.sin(turn)])
        scaled = np.log(max(np.ptp(along), 1e-3) / (2.0 * half)) if len(along) else 0.0
    else:
        down = -guides.middle_ray[2]
        away = (guides.eye[2] - 0.4 * height) / max(down, 0.05)
        flat = float(np.sqrt(max(1.0 - down * down, 0.0)))
        tall = height * flat + 2.0 * half * down
        scaled = np.log(away * np.sqrt(guides.seen[0] * guides.seen[1] / (2.0 * half * tall)))
    return float(np.clip(scaled, -_MOST_SCALE, _MOST_SCALE))


def _middle(
    shape: FamilyShape, theta: FloatArray, guides: Guides, random: Random, place_error: float
) -> FloatArray:
    by_touch = guides.touched and random.random() < (0.4 if guides.sighted else 0.9)
    if by_touch:
        near = guides.middles[random.integers(len(guides.middles))]
        return np.asarray(near + random.normal(0.0, 5e-3, 2))
    if not guides.sighted:
        return np.asarray(random.normal(0.0, place_error, 2))
    kind = kind_of(shape.code)
    height = kind.extent(shape.code, theta)[1]
    if kind.is_elongated:
        level = guides.on_level(0.5 * height)
        if len(level):
            return np.asarray(0.5 * (level.min(axis=0) + level.max(axis=0)))
    away = (guides.eye[2] - 0.45 * height) / max(-guides.middle_ray[2], 0.05)
    return np.asarray((guides.eye + away * guides.middle_ray)[:2])


_LEVEL = 0.5
"""Vertical part of a normal below which a contact is on a side."""

_REACHES = (0.0, 0.02, 0.04, 0.07)
"""Distances of the centre behind a side contact, m."""


def guides_of(evidence: ShapeEvidence) -> Guides:
    """Proposals of some readings."""
    places, middles, extents, turns = _by_touch(evidence)
    seen, eye, ray, outline = _by_sight(evidence)
    return Guides(places, middles, extents, turns, seen, eye, ray, outline)


def _by_touch(evidence: ShapeEvidence) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    contacts = evidence.contacts
    if not contacts:
        return np.empty((0, 3)), np.empty((0, 2)), np.zeros(3), np.empty(0)
    places = np.array([touch.points.mean(axis=0) for touch in contacts])
    normals = np.array([touch.normals.mean(axis=0) for touch in contacts])
    low, high = places.min(axis=0), places.max(axis=0)
    extents = high - low
    extents[2] = max(high[2], 0.0)
    middles = [0.5 * (low + high)[:2]]
    sides = np.abs(normals[:, 2]) < _LEVEL
    if sides.any():
        middles += [np.median(places[sides, :2] - r * normals[sides, :2], axis=0) for r in _REACHES]
    axis = _axis(places[sides], normals[sides])
    if axis is not None:
        middles.append(axis)
    turns, long = np.arctan2(normals[sides, 1], normals[sides, 0]), _long_direction(places[:, :2])
    return places, np.array(middles), extents, turns if long is None else np.append(turns, long)


def _axis(places: FloatArray, normals: FloatArray) -> FloatArray | None:
    """``(2,)`` m: the point that most level normal lines pass; None where they are parallel."""
    if len(places) < 3:
        return None
    level = normals[:, :2] / np.linalg.norm(normals[:, :2], axis=1, keepdims=True)
    aside = np.column_stack([-level[:, 1], level[:, 0]])
    offset = np.sum(aside * places[:, :2], axis=1)
    weights = np.ones(len(places))
    middle = np.zeros(2)
    for _ in range(8):
        square = (aside * weights[:, None]).T @ aside
        if np.linalg.eigvalsh(square)[0] < 0.05 * weights.sum():
            return None
        middle = np.linalg.solve(square, (aside * weights[:, None]).T @ offset)
        weights = 1.0 / np.maximum(np.abs(aside @ middle - offset), 2e-3)
        weights *= len(weights) / weights.sum()
    return np.asarray(middle)


def _long_direction(places: FloatArray) -> float | None:
    """Direction along which plane places spread most, rad; None for fewer than two places."""
    if len(places) < 2:
        return None
    _, vectors = np.linalg.eigh(np.cov(places.T))
    return float(np.arctan2(vectors[1, 1], vectors[0, 1]))


def _by_sight(evidence: ShapeEvidence) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    look = evidence.look
    if look is None or not look.mask.any():
        return np.zeros(2), np.zeros(3), np.zeros(3), np.empty((0, 3))
    rows, columns = np.nonzero(look.mask)
    low = np.array([columns.min(), rows.min()])
    high = np.array([columns.max(), rows.max()]) + 1.0
    edge = look.mask.copy()
    edge[1:-1, 1:-1] &= ~(
        look.mask[:-2, 1:-1] & look.mask[2:, 1:-1] & look.mask[1:-1, :-2] & look.mask[1:-1, 2:]
    )
    rows, columns = np.nonzero(edge)
    outline = directions_of(look, np.column_stack([columns + 0.5, rows + 0.5]))
    ray = directions_of(look, 0.5 * (low + high)[None])[0]
    return (high - low) / look.focal_length, look.stand_from_camera[:3, 3].copy(), ray, outline


PERTURBATION, PERTURBATION_PLACE, PERTURBATION_YAW = 0.15, 2.0e-3, 0.1
"""Standard deviations of a perturbed shape: of its parameters, in deviations of their prior; of its position
along x and y, m; of its yaw, rad."""


def change(shape: FamilyShape, random: Random) -> Iterator[FamilyShape]:
    """Yield shapes that differ from one by one part or by a rotation."""
    kind = kind_of(shape.code)
    if kind.traits(shape.code).has_yaw:
        yield shape.rotate(np.pi)
    yield from kind.changes(shape, random)


def perturb(shape: FamilyShape, random: Random) -> FamilyShape:
    """Return a shape with slightly different numbers: fitted again, it may reach a better local minimum."""
    theta = shape.theta.copy()
    kind = kind_of(shape.code)
    for slot, sigma in kind.deviations(shape.code).items():
        theta[slot] += PERTURBATION * sigma * random.standard_normal()
    theta[layout.X : layout.Y + 1] += PERTURBATION_PLACE * random.standard_normal(2)
    if kind.traits(shape.code).has_yaw:
        theta[layout.YAW] += PERTURBATION_YAW * random.standard_normal()
    return FamilyShape(shape.name, shape.code, theta)
