"""The true object of a run as something that sounds: its modes, how they decay, how loud each is.

The volume mesh is another one than any estimator's: other surface, other elements. It is made
once for an object; a run's own wall and material move its nodes and fill its cells.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from harness.basics.materials import Material, material
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder, digest
from harness.bench.scene import SceneFile
from harness.sim.modal.modal import default_edge, from_arrays, solve_modes, to_arrays
from harness.sim.modal.modes import Modes, dampings
from harness.sim.modal.solve import Elasticity
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra, tetrahedralize
from harness.sim.solid.walls import walled
from harness.sim.sound.modal_radiation import radiation
from mocks.world.gap_draw import GapDraw
from mocks.world.modes import perturbed, uneven
from mocks.world.sound import SoundingObject
from mocks.world.sound_draw import SoundDraw
from mocks.world.world import World

VERSION = 1
"""Raised with every change of what is computed here, so that stored modes are dropped."""

LIMIT = 10e3
"""Hz: a blow of 0.2 ms has a tenth of its force left at 6 kHz, and a thirtieth here."""

FINER = 0.85
"""Of the edge that an estimator's elements have where nobody asks for another."""

FIELD_LENGTH = 40e-3
"""m over which the true material varies."""

DISTANCE = 0.25
"""m from the object to the microphone."""

RUNG = 1.2
"""Between the edges, over its size, with which an object of hidden size is filled: not every size needs a
volume mesh of its own, and filling takes longer than all else."""


def instrument_of(world: World, scene: SceneFile, draw: GapDraw) -> SoundingObject:
    """The true object's modes and how loud each is at the microphone.

    Args:
        world: of the run.
        scene: names the material, and the wall of a hollow thing scanned as a solid.
        draw: of the run.

    Raises:
        MeshRefused: an object that cannot be filled with elements.
    """
    made_of = material(scene.object.material)
    wall = scene.object.wall
    solid = walled(world.nominal, None if wall is None else wall * world.made_scale)
    edge = FINER * default_edge(solid, made_of, LIMIT)
    store = Store(default_folder())
    if world.made_scale == 1.0:
        body = _Body(solid, edge, partial(_filled, solid, edge, store))
    else:
        body = _scaled_body(solid, walled(world.drawing, wall), world.made_scale, edge, store)
    modes = _modes(body, made_of, SoundDraw(draw), store)
    return SoundingObject(
        modes, dampings(modes.frequencies, made_of), radiation(modes, DISTANCE), made_of.name
    )


@dataclass(frozen=True, eq=False)
class _Body:
    """What is solved.

    Attributes:
        solid: its surface, m.
        edge: m, of its elements.
        fill: makes its volume mesh.
    """

    solid: Mesh
    edge: float
    fill: Callable[[], Tetrahedra]


def _scaled_body(solid: Mesh, drawn: Mesh, scale: float, edge: float, store: Store) -> _Body:
    """An object of hidden size: its drawing filled with elements no longer than asked for, and scaled."""
    size = drawn.diagonal
    rung = np.floor(np.log(edge / scale / size) / np.log(RUNG))
    own = size * float(RUNG**rung)

    def fill() -> Tetrahedra:
        inside = _filled(drawn, own, store)
        return tetrahedra(scale * inside.nodes, inside.cells)

    return _Body(solid, scale * own, fill)


def _modes(body: _Body, made_of: Material, draw: SoundDraw, store: Store) -> Modes:
    """The modes of one run's object, kept by everything that they depend on."""
    fields = draw.material_random()
    wall, poisson, sigma = draw.wall_change, draw.poisson_change, draw.elastic_field
    # The first numbers of the stream stand for the stream; without fields all runs share their modes.
    told = [wall, poisson, sigma, FIELD_LENGTH, draw.material_random().standard_normal(4) if sigma else 0.0]
    solid = body.solid
    key = digest(["world modes", VERSION, solid.vertices, solid.faces, made_of, LIMIT, body.edge, *told])
    kept = store.get(key)
    if isinstance(kept, Mapping):
        return from_arrays(kept)
    drawn = body.fill()
    made = perturbed(drawn, wall) if wall else drawn
    elasticity = (
        uneven(made, made_of, sigma, FIELD_LENGTH, fields, poisson)
        if sigma or poisson
        else Elasticity.uniform(made_of, len(made.cells))
    )
    solved = solve_modes(made, elasticity, LIMIT, solid, undeformed=drawn)
    store.put(key, to_arrays(solved))
    return solved


def _filled(solid: Mesh, edge: float, store: Store) -> Tetrahedra:
    """The world's volume mesh of an object."""
    key = digest(["world tetrahedra", VERSION, solid.vertices, solid.faces, edge])
    kept = store.get(key)
    if isinstance(kept, Mapping):
        return tetrahedra(kept["nodes"], kept["cells"])
    filled = tetrahedralize(solid, edge)
    store.put(key, {"nodes": filled.nodes, "cells": filled.cells})
    return filled
