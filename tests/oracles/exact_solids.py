"""Ten-node meshes with every node, also those in the middle of edges, exactly where a shape has it."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import ConvexHull
from scipy.special import spherical_jn, spherical_yn

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.materials import Material
from harness.sim.solid.tetrahedra import QuadraticMesh, quadratic_mesh, tetrahedra
from tests.oracles.volume_meshes import grid_cells

Sides = tuple[float, float, float]


def mapped(nodes: FloatArray, cells: IntArray, onto: Callable[[FloatArray], FloatArray]) -> QuadraticMesh:
    """Cells of a plain region, with all their nodes moved onto a shape."""
    plain = tetrahedra(nodes, cells)
    straight = quadratic_mesh(plain.nodes, plain.cells)
    return QuadraticMesh(onto(straight.nodes), straight.cells, straight.faces)


def exact_box(sides: Sides, counts: tuple[int, int, int]) -> QuadraticMesh:
    """A box with a corner at the origin."""
    nodes, cells = grid_cells(counts)
    return mapped(nodes, cells, lambda unit: unit * np.array(sides))


_OUTWARD = 0.15
"""Of the radius, by which layers move out where modes bend most: least error of ten modes per unknown."""


def exact_ball(radius: float, count: int) -> QuadraticMesh:
    """A ball of twenty cones on the faces of an icosahedron, ``20 count^3`` cells.

    Each cone is flat at the middle and round outside, where equal steps along an edge are equal angles.
    """
    corners = _icosahedron()
    faces = ConvexHull(corners).simplices
    normals = corners[faces].mean(axis=1)
    normals /= (normals**2).sum(axis=1, keepdims=True)
    into_shares = np.linalg.inv(corners[faces])
    angle = np.arccos(corners[faces[0, 0]] @ corners[faces[0, 1]])

    def onto(inside: FloatArray) -> FloatArray:
        cones = inside @ normals.T
        cone, reach = cones.argmax(axis=1), cones.max(axis=1, keepdims=True)
        ends = corners[faces[cone]]
        shares = np.einsum("ni,nij->nj", inside, into_shares[cone]) / np.where(reach > 0.0, reach, 1.0)
        flat = np.einsum("nj,nji->ni", shares, ends)
        way = np.einsum("nj,nji->ni", np.sin(angle * shares), ends)
        length = np.linalg.norm(way, axis=1, keepdims=True)
        round_ = way / np.where(length > 0.0, length, 1.0)
        out = reach * (1.0 + _OUTWARD * (1.0 - reach))
        return np.asarray(radius * out * (flat + reach**2 * (round_ - flat)))

    nodes, cells = grid_cells((count, count, count))
    # The simplex of descending coordinates in a cube of such cells is itself made of whole cells.
    cells = cells[(np.diff(nodes[cells].mean(axis=1), axis=1) <= 0.0).all(axis=1)]
    shares = np.column_stack([nodes[:, :2] - nodes[:, 1:], nodes[:, 2]])
    placed = np.concatenate([(shares @ corners[face])[cells].reshape(-1, 3) for face in faces])
    unique, which = np.unique(np.round(placed, 9) + 0.0, axis=0, return_inverse=True)
    return mapped(unique, which.reshape(-1, 4), onto)


def _icosahedron() -> FloatArray:
    """``(12, 3)`` corners at distance 1."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    pairs = [(0.0, a, b * golden) for a in (1.0, -1.0) for b in (1.0, -1.0)]
    corners = np.array([np.roll(pair, turn) for pair in pairs for turn in range(3)])
    return np.asarray(corners / np.linalg.norm(corners[0]))


def octant_shell(inner: float, outer: float, count: int, layers: int) -> QuadraticMesh:
    """An eighth of a hollow sphere, ``count`` edges along a quarter circle."""
    triangles = [
        [(i, j), (i + 1, j), (i, j + 1)] for i in range(count) for j in range(count - i)
    ] + [
        [(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i in range(count) for j in range(count - i - 1)
    ]  # fmt: skip
    pairs = sorted({pair for triangle in triangles for pair in triangle})
    number = {pair: index for index, pair in enumerate(pairs)}
    flat = np.array([(i, j, count - i - j) for i, j in pairs]) / count
    nodes = np.concatenate([radius * flat for radius in np.linspace(inner, outer, layers + 1)])
    bottom = np.sort(np.array([[number[pair] for pair in triangle] for triangle in triangles]), axis=1)
    cells = []
    for layer in range(layers):
        a, b, c = (bottom + layer * len(flat)).T
        d, e, f = (bottom + (layer + 1) * len(flat)).T
        cells += [np.stack(cell, axis=1) for cell in ((a, b, c, f), (a, b, e, f), (a, d, e, f))]

    def onto(octahedral: FloatArray) -> FloatArray:
        length = np.linalg.norm(octahedral, axis=1, keepdims=True)
        return np.asarray(octahedral * octahedral.sum(axis=1, keepdims=True) / length)

    return mapped(nodes, np.concatenate(cells), onto)


def on_planes(mesh: QuadraticMesh, symmetry: tuple[int, int, int]) -> BoolArray:
    """``(n, 3)``: what is held on the planes x, y, z = 0 of a part that stands for the whole.

    Where the motion is its own mirror image the plane keeps its normal displacement at zero, where
    it is the opposite the tangential ones.
    """
    held = np.zeros(mesh.nodes.shape, dtype=np.bool_)
    for axis in range(3):
        there = mesh.nodes[:, axis] == 0.0
        normal = np.arange(3) == axis
        held |= there[:, None] & (normal if symmetry[axis] == 1 else ~normal)
    return held


def radial_frequencies(inner: float, outer: float, material: Material, highest: float) -> list[float]:
    """Hz of the breathing modes of a free hollow sphere, up to ``highest``.

    ``u(r) = A j1(k r) + B y1(k r)`` without radial stress at both radii.
    """
    lame = material.young * material.poisson / ((1.0 + material.poisson) * (1.0 - 2.0 * material.poisson))
    twice = material.young / (1.0 + material.poisson)
    speed = np.sqrt((lame + twice) / material.density)

    def determinant(frequency: FloatArray) -> FloatArray:
        k = 2.0 * np.pi * frequency / speed
        rows = [
            [
                (lame + twice) * k * of(1, k * r, derivative=True) + 2.0 * lame * of(1, k * r) / r
                for of in (spherical_jn, spherical_yn)
            ]
            for r in (inner, outer)
        ]
        return np.asarray(rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0])

    grid = np.linspace(highest * 1e-3, highest, 4000)
    signs = np.sign(determinant(grid))
    found = []
    for at in np.flatnonzero(signs[1:] != signs[:-1]):
        low, high = grid[at], grid[at + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            same = np.sign(determinant(np.array(middle))) == signs[at]
            low, high = (middle, high) if same else (low, middle)
        found.append(0.5 * (low + high))
    return found
