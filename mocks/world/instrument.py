"""The true object of a run as something that sounds: its modes, how they decay, how loud each is.

The volume mesh is another one than any estimator's: other surface, other elements. It is made
once for an object; a run's own wall and material move its nodes and fill its cells.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import Material, material
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder, digest
from harness.bench.scene import SceneFile
from harness.sim.modal.modal import default_edge, from_arrays, solve_modes, to_arrays
from harness.sim.modal.modes import Modes, dampings
from harness.sim.modal.solve import Elasticity
from harness.sim.solid.tetrahedra import Tetrahedra, signed_volumes, tetrahedra, tetrahedralize
from harness.sim.solid.walls import wall_thickness, walled
from harness.sim.sound.modal_sound import radiation
from mocks.world.gap_draw import GapDraw
from mocks.world.sound import SoundDraw, SoundingObject
from mocks.world.world import World

_WAVES = 128
_THICKEST = 1.5
"""Of the median wall: behind a rim, straight inwards is along the wall and not across it."""

_EASINGS = 20
"""Rounds of carrying a cell whole; each takes in those that the last one flattened."""

_LEAST_LEFT = 0.2
"""Share of a cell's volume that a change of a few per cent leaves of all but slivers."""

_ROUNDS = 4
"""Of averaging a node's wall with its neighbours', so that the surface stays smooth."""


def perturbed(nominal: Tetrahedra, wall_change: float) -> Tetrahedra:
    """The same cells with the wall of the object thicker by a share of itself.

    Each node of the surface goes out by half of ``wall_change`` times the wall behind it; the
    nodes within follow smoothly.

    Args:
        nominal: the volume mesh of the drawing.
        wall_change: relative, above -0.5 and below 0.5.

    Raises:
        MeshRefused: the change is so large that a cell turns inside out.
    """
    if not abs(wall_change) < 0.5:
        raise MeshRefused(
            f"a wall cannot change by {wall_change:.0%} without another mesh; say less than half"
        )
    surface = nominal.surface
    outer = np.unique(surface.faces)
    normals = surface.vertex_normals[outer]
    # The wall at the surface's nodes, without what is only a rim's height.
    wall = wall_thickness(surface, surface.vertices[outer], normals)
    wall = np.minimum(wall, _THICKEST * float(np.median(wall)))
    joined = _graph(surface.faces, len(surface.vertices))[outer][:, outer]
    neighbours = joined.sum(axis=1)
    for _ in range(_ROUNDS):
        wall = 0.5 * wall + 0.5 * (joined @ wall) / neighbours
    way = _extended(nominal, outer, 0.5 * wall_change * wall[:, None] * normals)
    made = tetrahedra(nominal.nodes + _eased(nominal, way), nominal.cells)
    if not np.array_equal(made.cells, nominal.cells):
        raise MeshRefused(
            f"a wall changed by {wall_change:.1%} turns a cell inside out; change it less, or mesh the "
            "object with smaller elements"
        )
    return made


def smooth_field(points: FloatArray, sigma: float, length: float, random: np.random.Generator) -> FloatArray:
    """``(n,)``: a Gaussian field of deviation ``sigma``, alike over ``length`` m, at ``(n, 3)`` points in m.

    Its covariance is a squared exponential, sampled as random plane waves (Rahimi and Recht,
    Random Features for Large-Scale Kernel Machines, 2007), so that it does not depend on the mesh.
    """
    waves = random.standard_normal((_WAVES, 3)) / length
    phases = random.uniform(0.0, 2.0 * np.pi, _WAVES)
    field: FloatArray = sigma * np.sqrt(2.0 / _WAVES) * np.cos(points @ waves.T + phases).sum(axis=1)
    return field


def uneven(
    made: Tetrahedra,
    material: Material,
    sigma: float,
    length: float,
    random: np.random.Generator,
    poisson_change: float = 0.0,
) -> Elasticity:
    """A material whose Young's modulus and density vary smoothly over the object.

    Args:
        made: the object's volume mesh.
        material: its mean.
        sigma: relative, of both fields, which are independent and lognormal.
        length: m over which they vary.
        random: draws the fields.
        poisson_change: added to Poisson's ratio everywhere.
    """
    middles = made.nodes[made.cells].mean(axis=1)
    stiffer, heavier = (np.exp(smooth_field(middles, sigma, length, random)) for _ in range(2))
    poisson = np.full(len(middles), material.poisson + poisson_change)
    return Elasticity(material.young * stiffer, poisson, material.density * heavier)


def _extended(nominal: Tetrahedra, outer: IntArray, way: FloatArray) -> FloatArray:
    """``(n, 3)`` m: what the surface's nodes do, and within it each node the mean of its neighbours."""
    whole = np.zeros_like(nominal.nodes)
    whole[outer] = way
    inner = np.setdiff1d(np.arange(len(nominal.nodes)), outer)
    if len(inner) == 0:
        return whole
    joined = _graph(nominal.cells, len(nominal.nodes))
    balance = sp.diags_array(joined.sum(axis=1)) - joined
    within = sp.csc_array(balance[inner][:, inner])
    whole[inner] = splu(within).solve(-np.asarray(balance[inner][:, outer] @ way))
    return whole


def _eased(nominal: Tetrahedra, way: FloatArray) -> FloatArray:
    """``(n, 3)`` m: the same ways, but for cells that they would flatten: those are carried whole.

    A sliver is flat, or inside out, for a hundredth of a millimetre; curved edges then do the rest. Its
    nodes all go their mean way, so that it keeps its shape; where that flattens a cell beside it, the two
    are carried together.
    """
    eased, carried = way, np.zeros(len(nominal.cells), dtype=np.bool_)
    for _ in range(_EASINGS):
        left = signed_volumes(nominal.nodes + eased, nominal.cells)
        flattened = left < _LEAST_LEFT * nominal.volumes
        if not flattened.any():
            break
        carried |= flattened
        rigid = nominal.cells[carried]
        group = connected_components(_graph(rigid, len(nominal.nodes)))[1]
        count = np.bincount(group)
        mean = np.column_stack([np.bincount(group, column) / count for column in way.T])
        eased = mean[group]
    return eased


def _graph(cells: IntArray, count: int) -> Any:
    """``(count, count)`` sparse: 1 for each pair of nodes with a common edge."""
    corners = cells.shape[1]
    pairs = [(a, b) for a in range(corners) for b in range(corners) if a != b]
    rows = np.concatenate([cells[:, a] for a, _ in pairs])
    columns = np.concatenate([cells[:, b] for _, b in pairs])
    graph = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count)).tocsr()
    graph.data[:] = 1.0
    return graph


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
    """What is solved."""

    solid: Mesh  #: its surface, m.
    edge: float  #: m, of its elements.
    fill: Callable[[], Tetrahedra]  #: makes its volume mesh.


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


if TYPE_CHECKING:
    pass
