"""Household shapes drawn at random: of what a regression and networks learn, and on what they are tested."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from harness.sim.solid.household.solid_grid import HouseholdSolid, SolidGrid
from harness.sim.solid.household.vessel import Cross, Vessel, add_arm, add_handle, offset, turned

_Random = np.random.Generator


def draw(family: str, random: _Random) -> HouseholdSolid:
    """An object of that family, standing on z = 0 about z, its longest side 1."""
    return FAMILIES[family](random).standing()


def _wall(random: _Random, least: float = 0.03, most: float = 0.12) -> float:
    """Of a vessel's radius; as many thin as thick."""
    return float(np.exp(random.uniform(np.log(least), np.log(most))))


def _vessel(
    outline: list[tuple[float, float]], wall: float, cross: Cross | None = None, split: float = 0.5
) -> tuple[SolidGrid, Vessel]:
    grid = SolidGrid()
    return grid, turned(grid, outline, offset(outline, wall), split * outline[-1][1], cross)


def _cup(random: _Random) -> HouseholdSolid:
    radius, foot = random.uniform(0.3, 0.65), random.uniform(0.6, 1.0)
    outline = [(0.0, 0.0), (radius * foot, 0.0), (radius, random.uniform(0.2, 0.9)), (radius, 1.0)]
    grid, body = _vessel(outline, radius * _wall(random))
    if random.random() < 0.75:
        reach = radius + random.uniform(0.2, 0.5)
        add_handle(body, random.uniform(0.7, 0.9), random.uniform(0.1, 0.3), reach, 0.12)
    return grid.solid()


def _bowl(random: _Random) -> HouseholdSolid:
    height, foot, bulge = random.uniform(0.4, 1.1), random.uniform(0.3, 0.7), random.uniform(0.75, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (bulge, 0.5 * height), (1.0, height)]
    return _vessel(outline, _wall(random))[0].solid()


def _plate(random: _Random) -> HouseholdSolid:
    height, foot = random.uniform(0.05, 0.3), random.uniform(0.4, 0.8)
    outline = [(0.0, 0.0), (foot, 0.0), (1.0, height)]
    return _vessel(outline, _wall(random, 0.025, 0.08))[0].solid()


def _tray(random: _Random) -> HouseholdSolid:
    across, height, foot = random.uniform(0.4, 1.0), random.uniform(0.1, 0.6), random.uniform(0.75, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (1.0, height)]
    return _vessel(outline, _wall(random, 0.025, 0.08), Cross(across, random.uniform(2.0, 10.0)))[0].solid()


def _bottle(random: _Random) -> HouseholdSolid:
    radius, shoulder, neck = random.uniform(0.12, 0.35), random.uniform(0.4, 0.85), random.uniform(0.25, 0.8)
    high = 0.5 * (1.0 + shoulder)
    outline = [(0.0, 0.0), (radius, 0.0), (radius, shoulder), (neck * radius, high), (neck * radius, 1.0)]
    return _vessel(outline, radius * _wall(random, 0.04, 0.15))[0].solid()


def _grid_box(
    sides: tuple[float, float, float], cells: tuple[int, int, int]
) -> tuple[SolidGrid, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
    axes = [np.linspace(-0.5 * side, 0.5 * side, count + 1) for side, count in zip(sides, cells, strict=True)]
    return SolidGrid(), np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def _bar(random: _Random) -> HouseholdSolid:
    grid, places = _grid_box((1.0, random.uniform(0.04, 0.3), random.uniform(0.03, 0.2)), (16, 2, 2))
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _block(random: _Random) -> HouseholdSolid:
    grid, places = _grid_box((1.0, random.uniform(0.3, 1.0), random.uniform(0.2, 1.2)), (6, 6, 6))
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _tool(random: _Random) -> HouseholdSolid:
    """A flat shaft with a wider end or two."""
    shaft = random.uniform(0.05, 0.12)
    grid, places = _grid_box((1.0, shaft, random.uniform(0.03, 0.1)), (20, 4, 2))
    first, second = random.uniform(1.0, 3.5, 2) if random.random() < 0.6 else (1.0, random.uniform(1.5, 3.5))
    knots = [-0.5, -0.5 + random.uniform(0.1, 0.2), -0.25, 0.25, 0.5 - random.uniform(0.1, 0.2), 0.5]
    wider = np.interp(places[..., 0], knots, [0.7 * first, first, 1.0, 1.0, second, 0.7 * second])
    places[..., 1] *= wider
    grid.add_block(grid.add_nodes(places))
    return grid.solid()


def _hammer(random: _Random) -> HouseholdSolid:
    """A shaft with a head across its end, lying."""
    thick, head = random.uniform(0.06, 0.14), random.uniform(0.25, 0.5)
    grid, places = _grid_box((thick, head, thick), (2, 6, 2))
    numbers = grid.add_nodes(places + np.array([0.5, 0.0, 0.0]))
    grid.add_block(numbers)
    shaft = random.uniform(0.3, 1.0) * head / 6.0
    ends = numbers[0, 2:5]
    layers = [ends]
    for x in np.linspace(0.5 - 0.5 * thick, -0.5, 16)[1:]:
        at = places[0, 2:5].copy()
        at[..., 0], at[..., 1] = x, at[..., 1] * shaft / (head / 6.0)
        layers.append(grid.add_nodes(at))
    grid.add_block(np.stack(layers))
    return grid.solid()


def _pan(random: _Random) -> HouseholdSolid:
    height, length = random.uniform(0.15, 0.6), random.uniform(0.6, 1.8)
    outline = [(0.0, 0.0), (random.uniform(0.7, 1.0), 0.0), (1.0, height)]
    grid, body = _vessel(outline, _wall(random, 0.025, 0.08), split=0.0)
    add_arm(body, 0.8 * height, (1.0 + length, random.uniform(0.6, 1.1) * height), 0.14)
    return grid.solid()


def _glass(random: _Random) -> HouseholdSolid:
    rim, widest = random.uniform(0.15, 0.32), random.uniform(0.18, 0.36)
    foot, stem = random.uniform(0.15, 0.3), random.uniform(0.02, 0.04)
    low, high = random.uniform(0.2, 0.45), random.uniform(0.6, 0.8)
    wall = widest * _wall(random, 0.03, 0.1)
    outer = [(foot, 0.0), (foot, 0.02), (stem, 0.06), (stem, low), (widest, high), (rim, 1.0)]
    inner = [
        (0.0, 0.0),
        (0.0, 0.02),
        (0.0, 0.06),
        (0.0, low + 0.03),
        (widest - wall, high),
        (rim - wall, 1.0),
    ]
    grid = SolidGrid()
    turned(grid, outer, inner, 0.5)
    return grid.solid()


def _pot(random: _Random) -> HouseholdSolid:
    height, belly, lid = random.uniform(0.8, 1.6), random.uniform(0.4, 0.6), random.uniform(0.3, 0.7)
    outline = [(0.0, 0.0), (0.6, 0.0), (1.0, belly * height), (lid, 0.95 * height), (lid, height)]
    grid, body = _vessel(outline, _wall(random))
    end = random.uniform(1.2, 1.7), random.uniform(0.6, 1.0) * height
    add_arm(body, 0.6 * height, end, 0.2, opposite=True)
    add_handle(body, 0.8 * height, 0.25 * height, random.uniform(1.2, 1.7), 0.15)
    return grid.solid()


def _jug(random: _Random) -> HouseholdSolid:
    radius, waist = random.uniform(0.22, 0.4), random.uniform(0.6, 1.0)
    foot = radius * random.uniform(0.7, 1.0)
    outline = [(0.0, 0.0), (foot, 0.0), (radius, 0.4), (radius * waist, 0.8), (radius, 1.0)]
    grid, body = _vessel(outline, radius * _wall(random))
    add_handle(body, 0.85, 0.25, radius + random.uniform(0.12, 0.3), 0.08)
    return grid.solid()


FAMILIES: MappingProxyType[str, Callable[[_Random], HouseholdSolid]] = MappingProxyType(
    {
        "cup": _cup, "bowl": _bowl, "plate": _plate, "tray": _tray, "bottle": _bottle, "bar": _bar,
        "block": _block, "tool": _tool, "hammer": _hammer, "pan": _pan, "glass": _glass, "pot": _pot,
        "jug": _jug,
    }
)  # fmt: skip
"""By name."""
