"""The vibration of the true object: its wall is not the drawing's, nor its material the same all over."""

from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.sim.modal.solve import Elasticity
from harness.sim.solid.surface_measure import wall_thickness
from harness.sim.solid.tetrahedra import Tetrahedra, signed_volumes, tetrahedra

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
    wall = _smoothed(surface, outer, wall_thickness(surface, surface.vertices[outer], normals))
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


def _smoothed(surface: Mesh, outer: IntArray, wall: FloatArray) -> FloatArray:
    """``(n,)`` m: the wall at the surface's nodes, without what is only a rim's height."""
    held = np.minimum(wall, _THICKEST * float(np.median(wall)))
    joined = _graph(surface.faces, len(surface.vertices))[outer][:, outer]
    neighbours = joined.sum(axis=1)
    for _ in range(_ROUNDS):
        held = 0.5 * held + 0.5 * (joined @ held) / neighbours
    return held


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
