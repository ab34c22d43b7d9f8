"""A draw of the prior laid where the readings are: place, size and turn are theirs, the shape the prior's."""

import numpy as np

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.freedom import has_yaw, sizes_of
from experiments.shape_reconstruction.family.layout import (
    CORED,
    KNOTS,
    TURNED,
)
from experiments.shape_reconstruction.family.proposing.guides import Guides, long_way
from experiments.shape_reconstruction.family.sizes import size_of
from harness.basics.arrays import FloatArray

_Random = np.random.Generator

OWN = 0.3
"""Share of the draws that keep the size that they were drawn with."""

ENOUGH, SPANNED = 6, 0.5
"""Contacts whose box proposes the sides of a body with straight ones; share of such draws that take them."""

_BEYOND = 0.15
"""Logarithm by which sides may reach beyond the contacts."""

_MOST_SCALE = 1.6


def lay(shape: FamilyShape, guides: Guides, random: _Random, place_error: float, yaws: int) -> FloatArray:
    """Vectors of a draw at a place and in a size of the readings, at several turns.

    Args:
        shape: about the origin.
        guides: of the readings.
        random: choices between what the readings allow.
        place_error: m, where nothing was read.
        yaws: turns, one where a turn changes nothing.

    Returns:
        ``(yaws, SIZE)``.
    """
    theta = shape.theta.copy()
    long = _is_long(shape)
    turn = long_way(guides.on_level(0.5 * size_of(shape.code, theta)[1])) if guides.sighted and long else None
    theta[list(sizes_of(shape.code))] += _log_scale(shape, guides, random, turn)
    theta[layout.X : layout.Y + 1] = _middle(shape, theta, guides, random, place_error, long)
    count = yaws if has_yaw(shape.code) else 1
    laid = np.repeat(theta[None], count, axis=0)
    laid[:, layout.YAW] = _turns(guides, random, turn, count)
    if shape.code[layout.PLAN] == CORED and len(guides.places) >= ENOUGH and random.random() < SPANNED:
        for one in laid:
            _span(one, guides.places, random)
    return laid


def _span(theta: FloatArray, places: FloatArray, random: _Random) -> None:
    """Give a body with straight sides the sides and the middle of the contacts' box, as it is turned."""
    cosine, sine = np.cos(theta[layout.YAW]), np.sin(theta[layout.YAW])
    along = places[:, :2] @ np.array([[cosine, -sine], [sine, cosine]])
    low, high = along.min(axis=0), along.max(axis=0)
    half = 0.5 * (high - low) * np.exp(random.uniform(0.0, _BEYOND))
    middle = 0.5 * (low + high)
    theta[layout.X] = cosine * middle[0] - sine * middle[1]
    theta[layout.Y] = sine * middle[0] + cosine * middle[1]
    corner = float(np.exp(theta[layout.RADII : layout.RADII + KNOTS].max()))
    theta[[layout.CORE_X, layout.CORE_Y]] = np.log(np.maximum(half - corner, 0.1 * half))


def _is_long(shape: FamilyShape) -> bool:
    return bool(shape.code[layout.KIND] != TURNED)


def _log_scale(shape: FamilyShape, guides: Guides, random: _Random, turn: float | None) -> float:
    """By which all lengths of a draw are scaled, so that it is as large as what was seen or touched."""
    if random.random() < OWN:
        return 0.0
    half, height = size_of(shape.code, shape.theta)
    if guides.sighted:
        return float(np.clip(np.log(_seen_scale(guides, half, height, turn)), -_MOST_SCALE, _MOST_SCALE))
    if not guides.touched:
        return 0.0
    wide, high = float(np.linalg.norm(guides.extents[:2])), float(guides.extents[2])
    least = max(wide / (2.0 * half), high / height)
    # Contacts reach nearly all of it, or are few and in one part of it.
    fitting = np.log(least) + random.uniform(0.0, 0.35)
    return float(np.clip(fitting, -_MOST_SCALE, _MOST_SCALE))


def _seen_scale(guides: Guides, half: float, height: float, turn: float | None) -> float:
    down = -guides.middle_ray[2]
    away = (guides.eye[2] - 0.4 * height) / max(down, 0.05)
    if turn is not None:
        level = guides.on_level(0.5 * height)
        along = level @ np.array([np.cos(turn), np.sin(turn)])
        return float(max(np.ptp(along), 1e-3) / (2.0 * half)) if len(along) else 1.0
    flat = float(np.sqrt(max(1.0 - down * down, 0.0)))
    tall = height * flat + 2.0 * half * down
    return float(away * np.sqrt(guides.seen[0] * guides.seen[1] / (2.0 * half * tall)))


def _middle(
    shape: FamilyShape, theta: FloatArray, guides: Guides, random: _Random, place_error: float, long: bool
) -> FloatArray:
    by_touch = guides.touched and random.random() < (0.4 if guides.sighted else 0.9)
    if by_touch:
        near = guides.middles[random.integers(len(guides.middles))]
        return np.asarray(near + random.normal(0.0, 5e-3, 2))
    if not guides.sighted:
        return np.asarray(random.normal(0.0, place_error, 2))
    height = size_of(shape.code, theta)[1]
    if long:
        level = guides.on_level(0.5 * height)
        if len(level):
            return np.asarray(0.5 * (level.min(axis=0) + level.max(axis=0)))
    away = (guides.eye[2] - 0.45 * height) / max(-guides.middle_ray[2], 0.05)
    return np.asarray((guides.eye + away * guides.middle_ray)[:2])


def _turns(guides: Guides, random: _Random, turn: float | None, count: int) -> FloatArray:
    """``(count,)`` rad: those that the readings propose and their opposites, then any, evenly spread."""
    even = random.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * np.arange(count) / count
    if turn is not None:
        proposed = turn + np.pi * np.arange(count) + random.normal(0.0, 0.05, count)
        proposed[min(4, count) :] = even[min(4, count) :]
        return np.asarray(proposed)
    if len(guides.turns):
        few = (count + 1) // 3
        even[:few] = random.choice(guides.turns, few) + 0.5 * np.pi * random.integers(0, 4, few)
    return np.asarray(even)
