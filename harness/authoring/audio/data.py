"""What a network of sound learns from: mode shapes with one meaning, split, and sampled between nodes."""

from dataclasses import dataclass, replace

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.sim.modal.modes import Modes

REPEATED = 1e-5
"""Relative: frequencies nearer than this count as one. Two of 10 kHz then beat slower than 0.1 Hz, so
that a mixture of them sounds the same; farther apart the mesh itself says which vectors they are."""

_FIELDS = 32
"""Fixed waves that shapes of equal frequency are told apart by."""

_CHUNK = 4096
"""Edges at a time: all of them with all modes would not fit into memory."""


@dataclass(frozen=True, eq=False)
class Split:
    """Nodes that are learned from, and nodes that are never shown."""

    trained: IntArray  #: ascending.
    held_out: IntArray  #: ascending.


@dataclass(frozen=True, eq=False)
class SoundSamples:
    """Places on a surface and the shapes there."""

    points: FloatArray  #: ``(k, 3)`` m.
    shapes: FloatArray  #: ``(k, m, 3)`` 1/sqrt(kg).


def split_nodes(count: int, share: float = 0.1, seed: int = 0) -> Split:
    """A random part of ``count`` nodes is held out.

    Raises:
        WrongUse: nothing would be left on one of the sides.
    """
    held = round(share * count) if 0.0 < share < 1.0 else 0
    if held < 1 or held >= count:
        raise WrongUse(f"a share of {share:g} of {count} nodes cannot be held out; say one between 0 and 1")
    order = np.random.default_rng([seed, 1]).permutation(count)
    return Split(np.sort(order[held:]), np.sort(order[:held]))


def clusters(frequencies: FloatArray, gap: float = REPEATED) -> list[IntArray]:
    """Which ascending frequencies count as one: each is within ``gap``, relative, of its neighbour."""
    apart = np.diff(frequencies) > gap * frequencies[1:]
    return np.split(np.arange(len(frequencies)), np.flatnonzero(apart) + 1)


def canonical(modes: Modes, gap: float = REPEATED) -> Modes:
    """The same vibration with signs and bases that do not depend on how nodes are numbered.

    Within a cluster of frequencies any rotation of the shapes solves the same equations. Here the
    basis is that of the singular vectors of the cluster's products with fixed fields over the
    surface, which are integrals and so the same however the surface is cut into triangles. A sign is
    that of the product with the fields' sum. All of a cluster get the root of the mean of its squares.
    """
    if len(modes.frequencies) == 0:
        return modes
    products = _products(modes)
    frequencies, shapes = modes.frequencies.copy(), modes.shapes.copy()
    for members in clusters(modes.frequencies, gap):
        basis = np.linalg.svd(products[:, members], full_matrices=False)[2].T
        signs = np.sign(products[:, members].sum(axis=0) @ basis)
        turn = basis * np.where(signs == 0.0, 1.0, signs)
        shapes[:, members] = np.einsum("nmd,mk->nkd", modes.shapes[:, members], turn)
        if len(members) > 1:
            frequencies[members] = np.sqrt((modes.frequencies[members] ** 2).mean())
    return replace(modes, frequencies=frequencies, shapes=shapes)


def _products(modes: Modes) -> FloatArray:
    """``(3 _FIELDS, m)``: integrals of each shape with waves along x, y and z.

    Waves in directions spread over a sphere, from longer than the object to a tenth of it, so that
    shapes that go round an object many times have products too; their weights are no simple
    fractions of each other, so that no symmetry of an object makes two singular values equal.
    """
    areas = node_areas(modes)
    middle = areas @ modes.points / areas.sum()
    place = modes.points - middle
    place = place / np.sqrt(areas @ (place**2).sum(axis=1) / areas.sum())
    number = np.arange(_FIELDS) + 0.5
    height, turn = 1.0 - 2.0 * number / _FIELDS, np.pi * (1.0 + np.sqrt(5.0)) * number
    across = np.sqrt(1.0 - height**2)
    directions = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    lengths = 0.5 * 20.0 ** (np.modf(number * np.sqrt(2.0))[0])
    fields = np.sin(place @ (directions * lengths[:, None]).T + number)
    weights = np.sqrt(np.arange(2.0, 2.0 + 3 * _FIELDS)).reshape(_FIELDS, 3)
    integrals = np.einsum("nf,n,nmd->fdm", fields, areas, modes.shapes, optimize=True)
    products: FloatArray = (integrals * weights[:, :, None]).reshape(-1, len(modes.frequencies))
    return products


def node_areas(modes: Modes) -> FloatArray:
    """``(n,)`` m^2: the third of its triangles' area that each node stands for."""
    corners = modes.points[modes.faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(crosses, axis=1) / 6.0
    return np.bincount(modes.faces.ravel(), np.repeat(areas, 3), len(modes.points)).astype(np.float64)


def wave_number(modes: Modes) -> float:
    """rad/m, of the shapes that vary fastest: the 95th percentile over modes and directions.

    It is the root of the mean square slope along the mesh's edges over that of the shape.
    """
    edges: AnyArray = np.concatenate([modes.faces[:, :2], modes.faces[:, 1:]])
    lengths = np.linalg.norm(np.diff(modes.points[edges], axis=1)[:, 0], axis=1)
    apart = lengths > 0.0
    edges, lengths = edges[apart], lengths[apart]
    slopes = np.zeros(modes.shapes.shape[1:])
    for first in range(0, len(edges), _CHUNK):
        part = slice(first, first + _CHUNK)
        steps = modes.shapes[edges[part, 1]] - modes.shapes[edges[part, 0]]
        slopes += ((steps / lengths[part, None, None]) ** 2).sum(axis=0) / len(edges)
    levels = (modes.shapes**2).mean(axis=0)
    moving = levels > 0.0
    return float(np.quantile(np.sqrt(slopes[moving] / levels[moving]), 0.95))
