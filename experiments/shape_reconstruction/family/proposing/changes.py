"""Shapes next to a hypothesis: with a part put on, taken off or exchanged, or turned to its look-alike."""

from collections.abc import Iterator

import numpy as np

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import FamilyShape, add_loop, add_spout
from experiments.shape_reconstruction.family.freedom import deviations, has_yaw
from experiments.shape_reconstruction.family.layout import (
    CORED,
    DISC,
    FLAT_SIDED,
    LOOP,
    NO_LIMB,
    PLAIN,
    RING,
    ROUND,
    SLOT,
    SUPER,
    TOOL,
    TURNED,
)
from harness.basics.arrays import FloatArray

_Random = np.random.Generator

LOOPS, TURNS = 3, 8
"""Handles drawn where there is none, and turns that each is tried at."""

HEADS, _HOLE = (1.4, 2.0, 2.8), 0.55
"""Half widths of a tool's head over that of its shaft there; of its hole over its own."""

ASIDE, ASIDE_PLACE, ASIDE_TURN = 0.15, 2.0e-3, 0.1
"""Deviation of a shape beside another: of its own numbers, in deviations of their prior; of its place, in m
along x and y; of its turn, in rad."""

_ENDS = (
    (layout.END_A, layout.SHAFT_A, layout.HEAD_A, layout.HOLE_A),
    (layout.END_B, layout.SHAFT_B, layout.HEAD_B, layout.HOLE_B),
)


def changes(shape: FamilyShape, random: _Random) -> Iterator[FamilyShape]:
    """Shapes that differ from one by one part or by a turn."""
    if has_yaw(shape.code):
        yield _turned(shape, np.pi)
    if shape.code[layout.KIND] == TURNED:
        yield from _of_vessel(shape, random)
    elif shape.code[layout.KIND] == TOOL:
        yield from _of_tool(shape)


def beside(shape: FamilyShape, random: _Random) -> FamilyShape:
    """The same parts with all numbers a little off: fitted anew, it may find a better valley nearby."""
    theta = shape.theta.copy()
    for slot, sigma in deviations(shape.code).items():
        theta[slot] += ASIDE * sigma * random.standard_normal()
    theta[layout.X : layout.Y + 1] += ASIDE_PLACE * random.standard_normal(2)
    if has_yaw(shape.code):
        theta[layout.YAW] += ASIDE_TURN * random.standard_normal()
    return FamilyShape(shape.name, shape.code, theta)


def _of_vessel(shape: FamilyShape, random: _Random) -> Iterator[FamilyShape]:
    code = shape.code
    yield _coded(shape, layout.HOLLOW, 1 - int(code[layout.HOLLOW]))
    if code[layout.LIMB] != NO_LIMB:
        yield _coded(shape, layout.LIMB, NO_LIMB)
        yield _turned(shape, 0.5 * np.pi)
        yield _turned(shape, -0.5 * np.pi)
    if code[layout.LIMB] != LOOP:
        for _ in range(LOOPS):
            yield from _all_about(add_loop(shape, random), random)
    if code[layout.SPOUT] != 0:
        yield _coded(shape, layout.SPOUT, 0)
    elif code[layout.LIMB] == LOOP:
        yield add_spout(shape, random)
    if code[layout.PLAN] == ROUND:
        yield _oval(shape, SUPER, 0.9)
        if code[layout.HOLLOW] == 0:
            yield _oval(shape, FLAT_SIDED, 0.7)
    elif code[layout.PLAN] in (SUPER, FLAT_SIDED):
        yield _coded(shape, layout.PLAN, ROUND)
        if code[layout.HOLLOW] == 0:
            yield _coded(shape, layout.PLAN, SUPER if code[layout.PLAN] == FLAT_SIDED else FLAT_SIDED)
    elif code[layout.PLAN] == CORED:
        yield _turned(shape, 0.5 * np.pi)


def _of_tool(shape: FamilyShape) -> Iterator[FamilyShape]:
    for end, shaft, head, hole in _ENDS:
        for kind in (PLAIN, DISC, RING, SLOT):
            if shape.code[end] == kind:
                continue
            changed = _coded(shape, end, kind)
            yield changed
            for ratio in HEADS if kind != PLAIN else ():
                theta = changed.theta.copy()
                theta[head] = theta[shaft] + np.log(ratio)
                theta[hole] = theta[head] + np.log(_HOLE)
                yield FamilyShape(changed.name, changed.code, theta)


def _all_about(shape: FamilyShape, random: _Random) -> Iterator[FamilyShape]:
    """The same at turns that are evenly spread."""
    first = random.uniform(0.0, 2.0 * np.pi)
    for turn in range(TURNS):
        yield _turned(shape, first + 2.0 * np.pi * turn / TURNS)


def _turned(shape: FamilyShape, by: float) -> FamilyShape:
    theta = shape.theta.copy()
    theta[layout.YAW] += by
    return FamilyShape(shape.name, shape.code, theta)


def _oval(shape: FamilyShape, plan: int, across: float) -> FamilyShape:
    theta: FloatArray = shape.theta.copy()
    theta[layout.ACROSS], theta[layout.POWER] = np.log(across), np.log(2.2)
    return _coded(FamilyShape(shape.name, shape.code, theta), layout.PLAN, plan)


def _coded(shape: FamilyShape, slot: int, value: int) -> FamilyShape:
    code = shape.code.copy()
    code[slot] = value
    return FamilyShape(shape.name, code, shape.theta)
