"""Training samples of the paper's completion networks: presses, silhouettes, and points of each shape."""

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from scipy.spatial import cKDTree

from experiments.paper.shape_network import frame_of, take_points
from experiments.shape_reconstruction.prior.samples import (
    WHOLE,
    CompletionSamples,
    SampleRow,
    draw_pose,
    gather_samples,
    look_samples,
    shape_of,
    silhouette_window,
)
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import random_points

PRESSES = (4, 40)
"""Fewest and most presses of a sample."""

FEWEST = 60
"""Fewest touched points of a sample; fewer give no frame."""

DENSE = 12_000
"""Surface points among which patches are searched."""

SITES = 400
"""Surface points at which presses are tried."""

PATCH = 7.0e-3
"""Radius of a patch, m."""

SUNK = 1.0e-3
"""Greatest depth of a patch's border below its centre, m: the depth of a press."""

POINTS = 40
"""Most points of a patch."""

HOUSING = (0.017, 0.015)
"""Half the sides of the sensor's face, which must be free in front of a site, m."""

_GEL = 4.0e-3
_ROOM = 0.12
_FACING = 0.8
_SHARED, _OF_EACH, _OF_POINT = 0.5e-3, 0.35e-3, 0.15e-3
"""Standard deviations along the normals of a run, of a press and of a point, m."""

_FROM_ONE_SIDE = 0.5
"""Fraction of the samples whose presses come from one side alone, as an arm may be able to."""


@dataclass(frozen=True, eq=False)
class TouchedShape:
    """A shape resting on z = 0, and the presses on it."""

    mesh: Mesh  #: its surface, m.
    seed: int  #: seed of the surface points.

    @cached_property
    def dense(self) -> tuple[FloatArray, FloatArray]:
        """Surface points, ``(DENSE, 3)`` in m, and their normals."""
        places, faces = random_points(self.mesh, DENSE, np.random.default_rng((self.seed, 1)))
        return places, self.mesh.face_normals[faces]

    @cached_property
    def sites(self) -> IntArray:
        """Those of the first ``SITES`` points of ``dense`` that the sensor has room in front of."""
        return np.nonzero(self._has_room(*(rows[:SITES] for rows in self.dense)))[0]

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.dense[0])

    def _has_room(self, places: FloatArray, normals: FloatArray) -> BoolArray:
        """Mark points at which the sensor's face is free of the shape and above the support."""
        x, y = HOUSING
        corners = np.array([(0.0, 0.0), (x, y), (-x, y), (x, -y), (-x, -y)])
        across = np.stack([frame_facing(normal, 0.0)[:, :2] for normal in normals])
        starts = (places + _GEL * normals)[:, None] + np.einsum("nij,kj->nki", across, corners)
        rays = np.broadcast_to(normals[:, None], starts.shape)
        hits = RayMesh(self.mesh).first_hits(starts.reshape(-1, 3), np.ascontiguousarray(rays).reshape(-1, 3))
        free = (hits.distance.reshape(len(places), -1) > _ROOM).all(axis=1)
        return np.asarray(free & (starts[:, :, 2] > 0.0).all(axis=1) & (normals[:, 2] > -0.5))

    def touched(self, presses: int, random: np.random.Generator) -> FloatArray:
        """Draw ``(n, 3)`` points of so many presses, with errors, m; none where the sensor has no room."""
        sites = self.sites
        if random.random() < _FROM_ONE_SIDE:
            bearing = random.uniform(0.0, 2.0 * np.pi)
            towards = np.array([np.cos(bearing), np.sin(bearing), 0.0])
            sites = sites[self.dense[1][sites] @ towards > -0.2]
        sites = sites if len(sites) == 0 else np.asarray(random.choice(sites, presses))
        shared = _SHARED * random.normal()
        patches = [self._patch(int(site), shared, random) for site in sites]
        return np.concatenate(patches) if patches else np.zeros((0, 3))

    def _patch(self, site: int, shared: float, random: np.random.Generator) -> FloatArray:
        places, normals = self.dense
        near = np.array(self._tree.query_ball_point(places[site], PATCH))
        sunk = (places[site] - places[near]) @ normals[site]
        near = near[(np.abs(sunk) < SUNK) & (normals[near] @ normals[site] > _FACING)]
        near = random.permutation(near)[:POINTS]
        off = shared + _OF_EACH * random.normal() + _OF_POINT * random.normal(size=(len(near), 1))
        return np.asarray(places[near] + off * normals[near])


def sense_samples(sense: str, shapes: int, each: int, seed: int, processes: int) -> CompletionSamples:
    """Make so many samples of each of so many shapes; fewer of a shape that the sensor has no room at."""
    if sense == "picture":
        return look_samples(shapes, each, seed, processes)
    return gather_samples(partial(_presses_on, sense, each, seed), shapes, processes)


def _presses_on(sense: str, each: int, seed: int, number: int) -> list[SampleRow]:
    shape, random = TouchedShape(shape_of(number, seed), number), np.random.default_rng((seed, number, 3))
    rays, everywhere = RayMesh(shape.mesh), random_points(shape.mesh, WHOLE, random)[0]
    rows: list[SampleRow] = []
    for _ in range(each):
        turn, put = draw_pose(random)
        points = shape.touched(int(random.integers(PRESSES[0], PRESSES[1] + 1)), random)
        if len(points) < FEWEST:
            continue
        points = points @ turn.T + put
        frame = frame_of(points)
        taken = take_points(points, int(random.integers(1 << 31)))
        inputs = {"touched": frame.inward(taken).astype(np.float32)}
        if sense == "both":
            inputs["window"] = silhouette_window(rays, frame, turn, put, random)
        rows.append((inputs, frame.inward(everywhere @ turn.T + put).astype(np.float32), frame.reach))
    return rows
