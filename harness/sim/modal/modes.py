"""The free vibration of one object: what a solver hands on and a sound is made of."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.materials import Material

_CANDIDATES = 12
"""Faces whose middle is nearest that are looked at for the nearest point; the surface of a
tetrahedral mesh has faces of like size, so that the nearest one is among them."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Free undamped vibration of one object."""

    frequencies: FloatArray  #: ``(m,)`` Hz, ascending; elastic modes only, all up to ``limit``.
    points: FloatArray  #: ``(n, 3)`` m, nodes of the surface in the object's frame.
    normals: FloatArray  #: ``(n, 3)`` outward, of unit length.
    faces: IntArray  #: ``(f, 3)`` triangles of those nodes, outward.
    shapes: FloatArray
    """``(n, m, 3)`` 1/sqrt(kg), mass-normalised displacement of each mode at the nodes. Its sign is
    arbitrary, and within a group of equal frequencies its basis."""
    limit: float  #: Hz, up to which every mode is listed.
    mass: float  #: kg.
    rigid: int  #: modes without a frequency that were left out: six for each body.
    nodes: int  #: of the finite-element mesh.
    elements: int  #: of the finite-element mesh.
    residual: float
    """the worst ``|K x - w^2 M x| / (w^2 |M x|)`` of a listed mode, in the norm of the inverse of the shifted
    stiffness."""
    seconds: Mapping[str, float]  #: by stage: ``"tetrahedra"``, ``"assembly"``, ``"solve"``.

    def at(self, points: FloatArray) -> FloatArray:
        """``(k, m, 3)`` 1/sqrt(kg): the shapes at the surface's nearest places to ``(k, 3)`` points in m.

        Linear between the three nodes of the nearest face.

        Raises:
            WrongUse: a point that is not three finite numbers.
        """
        nodes, shares = self.place(points)
        found: FloatArray = np.einsum("kc,kcmd->kmd", shares, self.shapes[nodes])
        return found

    def gains(self, points: FloatArray, directions: FloatArray) -> FloatArray:
        """``(k, m)`` 1/sqrt(kg): the shapes at ``(k, 3)`` points along ``(k, 3)`` unit directions.

        Raises:
            WrongUse: a point that is not finite, or a direction that is not of unit length.
        """
        lengths = np.linalg.norm(directions, axis=-1)
        if not np.allclose(lengths, 1.0, rtol=0.0, atol=1e-6):
            worst = float(lengths[np.argmax(np.abs(lengths - 1.0))])
            raise WrongUse(f"a direction of a force has length {worst:.6g}; divide it by its length")
        nodes, shares = self.place(points)
        found: FloatArray = np.einsum("kc,kcmd,kd->km", shares, self.shapes[nodes], directions, optimize=True)
        return found

    def place(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """The nodes of the faces nearest to ``(k, 3)`` points and the shares of each.

        Returns:
            ``(k, 3)`` nodes and ``(k, 3)`` shares, from 0 to 1, that add up to 1.

        Raises:
            WrongUse: a point that is not three finite numbers.
        """
        points = np.asarray(points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise WrongUse(
                f"points of shape {points.shape} must be (k, 3) finite numbers in metres to find a mode there"
            )
        count = min(_CANDIDATES, len(self.faces))
        near = np.asarray(self._middles.query(points, k=count)[1], dtype=np.int64).reshape(len(points), count)
        corners = self.points[self.faces[near]]
        shares = nearest_shares(points[:, None, :], corners)
        feet = np.einsum("kfc,kfcd->kfd", shares, corners)
        best = np.argmin(np.linalg.norm(feet - points[:, None, :], axis=-1), axis=1)
        chosen = np.arange(len(points))
        return self.faces[near[chosen, best]], shares[chosen, best]

    @cached_property
    def _middles(self) -> "cKDTree[None]":
        return cKDTree(self.points[self.faces].mean(axis=1))


def dampings(frequencies: FloatArray, material: Material) -> FloatArray:
    """``(m,)`` 1/s: the rate ``d`` at which each mode decays, as ``exp(-d t)``.

    Rayleigh damping: ``d = (alpha + beta (2 pi f)^2) / 2``.

    Args:
        frequencies: ``(m,)`` Hz, undamped.
        material: of the object.
    """
    rates: FloatArray = 0.5 * (material.alpha + material.beta * (2.0 * np.pi * frequencies) ** 2)
    return rates


def nearest_shares(points: FloatArray, corners: FloatArray) -> FloatArray:
    """``(..., 3)`` barycentric coordinates of the point of each triangle nearest to each point.

    The algorithm of ``nearest_on_triangle`` with the sums of ``einsum``, which round otherwise: gains are
    computed with these.

    Args:
        points: ``(..., 3)``.
        corners: ``(..., 3, 3)``; a triangle without area counts as its edges.
    """
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    wu, wv = _dot(w, u), _dot(w, v)
    area = uu * vv - uv * uv
    flat = area <= 1e-14 * uu * vv
    safe = np.where(flat, 1.0, area)
    beta, gamma = (vv * wu - uv * wv) / safe, (uu * wv - uv * wu) / safe
    inside = ~flat & (beta >= 0.0) & (gamma >= 0.0) & (beta + gamma <= 1.0)
    in_plane = np.stack([1.0 - beta - gamma, beta, gamma], axis=-1)
    on_edges = np.stack([_edge_shares(points, corners, first) for first in range(3)])
    gaps = np.linalg.norm(np.einsum("e...c,...cd->e...d", on_edges, corners) - points, axis=-1)
    edge = np.argmin(gaps, axis=0)
    on_edge = np.take_along_axis(on_edges, edge[None, ..., None], axis=0)[0]
    return np.where(inside[..., None], in_plane, on_edge)


def _edge_shares(points: FloatArray, corners: FloatArray, first: int) -> FloatArray:
    second = (first + 1) % 3
    start, along = corners[..., first, :], corners[..., second, :] - corners[..., first, :]
    squares = _dot(along, along)
    share = _dot(points - start, along) / np.where(squares > 0.0, squares, 1.0)
    share = np.minimum(np.maximum(share, 0.0), 1.0)
    shares = np.zeros((*np.broadcast_shapes(share.shape), 3))
    shares[..., first], shares[..., second] = 1.0 - share, share
    return shares


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    product: FloatArray = np.einsum("...i,...i->...", a, b)
    return product
