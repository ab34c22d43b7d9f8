"""Household shapes drawn at random, as far as an outline sees them: points whose hull is the object's."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from harness.basics.arrays import FloatArray

_TURNS = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


def draw(family: str, random: np.random.Generator) -> FloatArray:
    """``(n, 3)`` corners of an object of that family, standing on z = 0 about z, its longest side 1."""
    points = FAMILIES[family](random)
    low, high = points.min(axis=0), points.max(axis=0)
    middle = np.array([*(0.5 * (low + high))[:2], low[2]])
    return np.asarray((points - middle) / (high - low).max())


def _turned(profile: list[tuple[float, float]]) -> FloatArray:
    """``(n, 3)`` of a solid of revolution from its radii and heights."""
    rings = [
        np.column_stack([r * np.cos(_TURNS), r * np.sin(_TURNS), np.full(len(_TURNS), z)]) for r, z in profile
    ]
    return np.concatenate(rings)


def _box(middle: tuple[float, float, float], sides: tuple[float, float, float]) -> FloatArray:
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(np.array(middle) + 0.5 * signs * np.array(sides))


def _handle(reach: float, low: float, high: float, thick: float) -> FloatArray:
    """A loop beside a vessel, out to a distance from its axis."""
    return _box((reach - 0.5 * thick, 0.0, 0.5 * (low + high)), (thick, thick, high - low))


def _cup(random: np.random.Generator) -> FloatArray:
    radius, foot = random.uniform(0.3, 0.65), random.uniform(0.6, 1.0)
    body = _turned([(radius * foot, 0.0), (radius, random.uniform(0.2, 1.0)), (radius, 1.0)])
    if random.random() < 0.25:
        return body
    reach = radius + random.uniform(0.2, 0.5)
    return np.concatenate([body, _handle(reach, random.uniform(0.1, 0.3), random.uniform(0.7, 0.9), 0.12)])


def _bowl(random: np.random.Generator) -> FloatArray:
    height, foot, bulge = random.uniform(0.4, 1.1), random.uniform(0.3, 0.7), random.uniform(0.75, 1.0)
    return _turned([(foot, 0.0), (bulge, 0.5 * height), (1.0, height)])


def _plate(random: np.random.Generator) -> FloatArray:
    height = random.uniform(0.05, 0.3)
    return _turned([(random.uniform(0.4, 0.8), 0.0), (1.0, height)])


def _tray(random: np.random.Generator) -> FloatArray:
    across, height, foot = random.uniform(0.4, 1.0), random.uniform(0.05, 0.3), random.uniform(0.75, 1.0)
    bottom = _box((0.0, 0.0, 0.0), (foot, foot * across, 0.0))
    return np.concatenate([bottom, _box((0.0, 0.0, height), (1.0, across, 0.02))])


def _bottle(random: np.random.Generator) -> FloatArray:
    radius, shoulder, neck = random.uniform(0.12, 0.35), random.uniform(0.4, 0.85), random.uniform(0.25, 0.8)
    return _turned(
        [(radius, 0.0), (radius, shoulder), (neck * radius, 0.5 * (1 + shoulder)), (neck * radius, 1.0)]
    )


def _bar(random: np.random.Generator) -> FloatArray:
    return _box((0.0, 0.0, 0.0), (1.0, random.uniform(0.04, 0.3), random.uniform(0.03, 0.2)))


def _block(random: np.random.Generator) -> FloatArray:
    return _box((0.0, 0.0, 0.0), (1.0, random.uniform(0.3, 1.0), random.uniform(0.2, 1.2)))


def _tool(random: np.random.Generator) -> FloatArray:
    thick = random.uniform(0.03, 0.1)
    shaft = _box((0.0, 0.0, 0.0), (1.0, random.uniform(0.05, 0.12), thick))
    ends = [
        _box(
            (side * random.uniform(0.38, 0.46), 0.0, 0.0),
            (random.uniform(0.08, 0.24), random.uniform(0.1, 0.35), thick),
        )
        for side in (-1.0, 1.0)
    ]
    return np.concatenate([shaft, *ends[: random.integers(1, 3)]])


def _pan(random: np.random.Generator) -> FloatArray:
    height, length = random.uniform(0.15, 0.6), random.uniform(0.6, 1.8)
    body = _turned([(random.uniform(0.7, 1.0), 0.0), (1.0, height)])
    level = random.uniform(0.6, 1.1) * height
    return np.concatenate([body, _box((1.0 + 0.5 * length, 0.0, level), (length, 0.2, 0.08))])


def _glass(random: np.random.Generator) -> FloatArray:
    rim, widest = random.uniform(0.15, 0.32), random.uniform(0.18, 0.36)
    return _turned(
        [(random.uniform(0.15, 0.3), 0.0), (0.03, 0.1), (widest, random.uniform(0.55, 0.8)), (rim, 1.0)]
    )


def _pot(random: np.random.Generator) -> FloatArray:
    height, belly = random.uniform(0.8, 1.6), random.uniform(0.4, 0.6)
    body = _turned(
        [(0.6, 0.0), (1.0, belly * height), (random.uniform(0.3, 0.7), 0.85 * height), (0.1, height)]
    )
    spout = _box((-random.uniform(1.2, 1.7), 0.0, random.uniform(0.5, 0.9) * height), (0.15, 0.15, 0.1))
    return np.concatenate([body, spout, _handle(random.uniform(1.2, 1.7), 0.2 * height, 0.8 * height, 0.15)])


def _jug(random: np.random.Generator) -> FloatArray:
    radius, waist = random.uniform(0.22, 0.4), random.uniform(0.6, 1.0)
    body = _turned(
        [(radius * random.uniform(0.7, 1.0), 0.0), (radius, 0.4), (radius * waist, 0.8), (radius, 1.0)]
    )
    lip = _box((-radius - random.uniform(0.0, 0.12), 0.0, 0.97), (0.05, 0.1, 0.04))
    return np.concatenate([body, lip, _handle(radius + random.uniform(0.12, 0.3), 0.2, 0.9, 0.08)])


FAMILIES: MappingProxyType[str, Callable[[np.random.Generator], FloatArray]] = MappingProxyType(
    {
        "cup": _cup, "bowl": _bowl, "plate": _plate, "tray": _tray, "bottle": _bottle, "bar": _bar,
        "block": _block, "tool": _tool, "pan": _pan, "glass": _glass, "pot": _pot, "jug": _jug,
    }
)  # fmt: skip
"""By name."""
