"""Networks of a mug's look that were never trained: solved for, a least-squares problem a cell.

Hidden layers are random; the layers that give density and colour are linear in what they take, so that they
have a closed form. The field is the mug's signed distance and a matt print of stripes under one lamp. It is
good enough to have an opaque surface where the mesh has one, and no measure of what training reaches.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network import (
    PER_CELL,
    NetworkSize,
    VisionGrid,
    VisionModel,
    VisionWeights,
    scatter_rows,
)
from tests.oracles.plain_networks import encoded, local_places

_RIDGE = 1e-3
_OPAQUE = 40.0
"""Optical thickness of a voxel that is wholly inside."""


@dataclass(frozen=True, eq=False)
class Field:
    """A surface as distances and colours."""

    points: FloatArray  #: ``(n, 3)`` m on the surface, dense.
    normals: FloatArray  #: ``(n, 3)`` unit.
    tree: cKDTree  #: of the points.

    @classmethod
    def of(cls, mesh: Mesh, count: int, random: np.random.Generator) -> "Field":
        faces = random.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
        shares = random.dirichlet(np.ones(3), count)
        points = np.einsum("nc,ncx->nx", shares, mesh.corners[faces])
        return cls(points, mesh.face_normals[faces], cKDTree(points))

    def at(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Signed distance (m, inside below zero), normal and albedo of the nearest place."""
        _, near = self.tree.query(points)
        distance = np.einsum("nx,nx->n", points - self.points[near], self.normals[near])
        return distance, self.normals[near], albedo(self.points[near])


def albedo(points: FloatArray) -> FloatArray:
    """``(n, 3)`` stripes, wide and narrow."""
    turn = np.arctan2(points[:, 1], points[:, 0])
    wave = 0.5 + 0.35 * np.sign(np.sin(6.0 * turn + 120.0 * points[:, 2]))
    return np.stack([wave, 0.75 - 0.5 * wave, 0.25 + 5.0 * np.clip(points[:, 2], 0.0, 0.12)], axis=1)


def lit(albedos: FloatArray, normals: FloatArray, lights: FloatArray) -> FloatArray:
    """``(n, 3)`` radiance of a matt surface under a lamp of irradiance pi, a little of it from everywhere."""
    cosines = np.maximum(np.einsum("nx,nx->n", normals, lights), 0.0)
    shone: FloatArray = albedos * (0.15 + 0.85 * cosines)[:, None]
    return shone


def fitted_look(
    mesh: Mesh, size: NetworkSize, cells: int = 16, samples: int = 400, seed: int = 0
) -> VisionModel:
    """The networks of a mesh, float16."""
    random = np.random.default_rng(seed)
    grid = surface_cells(mesh, cells)
    voxel = grid.cell / PER_CELL
    field = Field.of(mesh, 200_000, random)
    points = _beside(field, grid, samples, random)
    distance, normals, albedos = field.at(points.reshape(-1, 3))
    lights = _unit(random.standard_normal((len(distance), 3)))
    raw = np.clip(-distance / voxel, -1.0, 1.0).reshape(points.shape[:2])
    colours = np.clip(lit(albedos, normals, lights), 0.02, 0.98)
    logits = np.log(colours / (1.0 - colours)).reshape(*points.shape[:2], 3)
    weights = _drawn(size, len(grid), _OPAQUE / voxel, random)
    every = np.repeat(np.arange(len(grid)), samples)
    local = local_places(grid, points.reshape(-1, 3), every).reshape(points.shape)
    hidden, late = _hidden(weights, local, lights.reshape(points.shape))
    density, density_bias = _solved(hidden, raw[..., None])
    colour, colour_bias = _solved(late, logits)
    arrays = dict(weights.arrays()) | {
        "density": density, "density_bias": density_bias, "colour": colour, "colour_bias": colour_bias,
    }  # fmt: skip
    return VisionModel(grid, VisionWeights(size, weights.density_scale, **arrays).rounded())


def drawn_look(grid: VisionGrid, size: NetworkSize, scale: float, seed: int = 0) -> VisionModel:
    """Networks with random weights."""
    return VisionModel(grid, _drawn(size, len(grid), scale, np.random.default_rng(seed)).rounded())


def _beside(field: Field, grid: VisionGrid, samples: int, random: np.random.Generator) -> FloatArray:
    """``(networks, samples, 3)`` m of each cell: beside the surface that is nearest to it, within a voxel."""
    shares = random.random((len(grid), samples, 3))
    _, near = field.tree.query(grid.low + grid.cell * (grid.cells[:, None] + shares))
    offsets = grid.cell / PER_CELL * random.uniform(-1.0, 1.0, (*near.shape, 1))
    points: FloatArray = field.points[near] + offsets * field.normals[near]
    return points


def _drawn(size: NetworkSize, count: int, scale: float, random: np.random.Generator) -> VisionWeights:
    arrays: dict[str, AnyArray] = {}
    for name, shape in size.shapes.items():
        fan = shape[0] if len(shape) > 1 else 4
        arrays[name] = random.standard_normal((count, *shape)) * np.sqrt(2.0 / fan)
    # High octaves begin small, as in any network that is to be smooth.
    octave = np.concatenate([np.zeros(3), np.repeat(np.arange(size.octaves), 6)])
    arrays["first"] = 3.0 * arrays["first"] * (4.0**-octave)[:, None]
    rows = scatter_rows(size)
    for part in ("view", "extras"):
        arrays["scatter"][:, rows[part]] = 0.0
    turns = np.concatenate([np.zeros(3), np.repeat(np.arange(size.turns), 6)])
    arrays["scatter"][:, rows["light"]] *= 2.0 * (4.0**-turns)[:, None]
    arrays["feature"] = np.broadcast_to(np.eye(size.width), (count, size.width, size.width)).copy()
    return VisionWeights(size, scale, **arrays)


def _hidden(weights: VisionWeights, local: FloatArray, lights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What the layers before density and colour give, ``(networks, samples, width)`` each."""
    size, rows = weights.size, scatter_rows(weights.size)
    hidden = np.maximum(encoded(local, size.octaves) @ weights.first + weights.first_bias[:, None], 0.0)
    hidden = np.maximum(hidden @ weights.second + weights.second_bias[:, None], 0.0)
    late = (hidden + weights.feature_bias[:, None]) @ weights.scatter[:, rows["feature"]]
    late += encoded(lights, size.turns) @ weights.scatter[:, rows["light"]] + weights.scatter_bias[:, None]
    return hidden, np.maximum(late, 0.0)


def _solved(given: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weight and bias of the ridge regression of each network."""
    ones = np.ones((*given.shape[:2], 1))
    full = np.concatenate([given, ones], axis=2)
    normal = full.swapaxes(1, 2) @ full
    strength = _RIDGE * np.trace(normal, axis1=1, axis2=2) / normal.shape[1]
    normal += strength[:, None, None] * np.eye(normal.shape[1])
    solved = np.linalg.solve(normal, full.swapaxes(1, 2) @ wanted)
    return solved[:, :-1], solved[:, -1]


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit
