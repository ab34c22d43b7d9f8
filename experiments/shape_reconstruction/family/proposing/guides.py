"""Where the readings themselves say that an object is, how large and how turned: proposals are laid there."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family.sight import directions_of
from harness.basics.arrays import FloatArray

_LEVEL = 0.5
"""Vertical part of a normal below which a contact is on a side."""

_REACHES = (0.0, 0.02, 0.04, 0.07)
"""M behind a side contact that the middle may be."""


@dataclass(frozen=True, eq=False)
class Guides:
    """Proposals that the readings make.

    Attributes:
        places: ``(contacts, 3)`` m, of the contacts.
        middles: ``(n, 2)`` m, where the object's middle may be, by its contacts.
        extents: ``(3,)`` m, of the box around the contacts and the support; zero without contacts.
        turns: ``(m,)`` rad, ways that its long side or a flat side may look.
        seen: ``(2,)`` m across and up the picture at a metre's distance, of the silhouette; zero without one.
        eye: ``(3,)`` m, of the camera.
        middle_ray: ``(3,)`` unit, towards the middle of the silhouette's box.
        outline: ``(k, 3)`` unit, towards the silhouette's border; none without one.
    """

    places: FloatArray
    middles: FloatArray
    extents: FloatArray
    turns: FloatArray
    seen: FloatArray
    eye: FloatArray
    middle_ray: FloatArray
    outline: FloatArray

    @property
    def sighted(self) -> bool:
        """Whether there is a silhouette."""
        return len(self.outline) > 0

    @property
    def touched(self) -> bool:
        """Whether there are contacts."""
        return len(self.middles) > 0

    def on_level(self, height: float) -> FloatArray:
        """``(k, 2)`` m: where the border's rays cross a height; those that never do are left out."""
        down = self.outline[self.outline[:, 2] < -0.05]
        away = (self.eye[2] - height) / -down[:, 2]
        return np.asarray(self.eye[:2] + away[:, None] * down[:, :2])


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
    flat = np.arctan2(normals[sides, 1], normals[sides, 0])
    return places, np.array(middles), extents, np.concatenate([flat, _long_way(places[:, :2])])


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


def _long_way(places: FloatArray) -> FloatArray:
    """``(1,)`` rad: the way that plane places spread most; none for fewer than two."""
    if len(places) < 2:
        return np.empty(0)
    _, vectors = np.linalg.eigh(np.cov(places.T))
    return np.array([np.arctan2(vectors[1, 1], vectors[0, 1])])


def long_way(places: FloatArray) -> float:
    """Rad: the way that plane places spread most; zero for fewer than two."""
    found = _long_way(places)
    return float(found[0]) if len(found) else 0.0


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
