"""Places that presses would meet on a shape of the families: what the network learns from."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import random_points

DENSE = 12_000
"""Places on a shape among which patches are looked for."""

SITES = 400
"""Places that presses are tried at."""

PATCH = 7.0e-3
"""M from the middle of a patch to its border."""

SUNK = 1.0e-3
"""M below the middle of a patch that its border may lie: as deep as a press is."""

POINTS = 40
"""Of a patch, at most."""

HOUSING = (0.017, 0.015)
"""M, half the sides of the sensor's face, which must find room before a site."""

_GEL = 4.0e-3
_ROOM = 0.12
_FACING = 0.8
_SHARED, _OF_EACH, _OF_POINT = 0.5e-3, 0.35e-3, 0.15e-3
"""M, deviations along the normals: of a run, of a press, of a point."""

_FROM_ONE_SIDE = 0.5
"""Share of the sets whose presses come from one side alone, as an arm may be able to."""


@dataclass(frozen=True, eq=False)
class TouchedShape:
    """A shape at its true size, standing on z = 0."""

    mesh: Mesh  #: m.
    seed: int  #: of the places on it.

    @cached_property
    def dense(self) -> tuple[FloatArray, FloatArray]:
        """``(DENSE, 3)`` m places and their normals."""
        places, faces = random_points(self.mesh, DENSE, np.random.default_rng((self.seed, 1)))
        return places, self.mesh.face_normals[faces]

    @cached_property
    def sites(self) -> IntArray:
        """Those of the first ``SITES`` places of ``dense`` before which the sensor finds room."""
        return np.nonzero(self._roomy(*(rows[:SITES] for rows in self.dense)))[0]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.dense[0])

    def _roomy(self, places: FloatArray, normals: FloatArray) -> BoolArray:
        """Whether the corners and the middle of the sensor's face see nothing, and stay above the support."""
        x, y = HOUSING
        corners = np.array([(0.0, 0.0), (x, y), (-x, y), (x, -y), (-x, -y)])
        across = np.stack([frame_facing(normal, 0.0)[:, :2] for normal in normals])
        starts = (places + _GEL * normals)[:, None] + np.einsum("nij,kj->nki", across, corners)
        ways = np.broadcast_to(normals[:, None], starts.shape)
        hits = RayMesh(self.mesh).first_hits(starts.reshape(-1, 3), np.ascontiguousarray(ways).reshape(-1, 3))
        free = (hits.distance.reshape(len(places), -1) > _ROOM).all(axis=1)
        return np.asarray(free & (starts[:, :, 2] > 0.0).all(axis=1) & (normals[:, 2] > -0.5))

    def touched(self, presses: int, random: np.random.Generator) -> FloatArray:
        """``(n, 3)`` m: places that so many presses meet, with errors; none where no sensor finds room."""
        sites = self._chosen(presses, random)
        shared = _SHARED * random.normal()
        patches = [self._patch(int(site), shared, random) for site in sites]
        return np.concatenate(patches) if patches else np.zeros((0, 3))

    def _chosen(self, presses: int, random: np.random.Generator) -> IntArray:
        sites = self.sites
        if random.random() < _FROM_ONE_SIDE:
            bearing = random.uniform(0.0, 2.0 * np.pi)
            towards = np.array([np.cos(bearing), np.sin(bearing), 0.0])
            sites = sites[self.dense[1][sites] @ towards > -0.2]
        if len(sites) == 0:
            return sites
        return np.asarray(random.choice(sites, presses))

    def _patch(self, site: int, shared: float, random: np.random.Generator) -> FloatArray:
        places, normals = self.dense
        near = np.array(self._tree.query_ball_point(places[site], PATCH))
        sunk = (places[site] - places[near]) @ normals[site]
        near = near[(np.abs(sunk) < SUNK) & (normals[near] @ normals[site] > _FACING)]
        near = random.permutation(near)[:POINTS]
        off = shared + _OF_EACH * random.normal() + _OF_POINT * random.normal(size=(len(near), 1))
        return np.asarray(places[near] + off * normals[near])
