"""Ways of the gel towards shapes of the families: what touch is learnt from."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.scale_estimation.touch.fit import POINTS, SHARE
from experiments.scale_estimation.unseen.contact_set import GelWay
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing
from harness.basics.mesh import Mesh
from harness.sim.solid.household.families import HouseholdSolid

PLACE = 20.0e-3
"""M, deviation per axis of where the object was put."""

SUPPORT = 1.0e-3
DEPTH = 0.8e-3
"""M, deviation of where the gel is and of how deep it reads, of all ways alike."""

GEL = 5.0e-3
"""M from its middle to where its rim may touch first."""

BEYOND = 0.02
"""M that a way aimed at the object may go on where it meets nothing."""

PRESSED = (0.5e-3, 1.5e-3)
"""M of indentation."""

_IMPRINT = np.linspace(-7.0e-3, 7.0e-3, 9)

SLANTS = (0.0, 0.0, 0.45, 0.9, 1.3)
"""Rad from straight down, of ways into the unknown."""

NORMAL = float(np.radians(8.0))
TILT = float(np.radians(15.0))
FEWEST, MOST = 3, 14
_SAMPLES = 600


@dataclass(frozen=True, eq=False)
class TouchableShape:
    """A shape one long that rays may meet."""

    mesh: Mesh

    @classmethod
    def of(cls, shape: HouseholdSolid) -> "TouchableShape":
        """Its surface."""
        return cls(shape.surface)

    @cached_property
    def rays(self) -> RayMesh:
        """For rays in its own frame."""
        return RayMesh(self.mesh)

    @cached_property
    def samples(self) -> tuple[FloatArray, FloatArray]:
        """``(n, 3)`` places and normals all over it, those that look down left out."""
        random = np.random.default_rng(0)
        areas = self.mesh.face_areas
        faces = random.choice(len(areas), _SAMPLES, p=areas / areas.sum())
        shares = random.dirichlet([1.0, 1.0, 1.0], _SAMPLES)
        corners = self.mesh.vertices[self.mesh.faces[faces]]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = sides / np.linalg.norm(sides, axis=1, keepdims=True)
        upward = normals[:, 2] > -0.1
        return np.einsum("nc,ncd->nd", shares, corners)[upward], normals[upward]


@dataclass(frozen=True, eq=False)
class _Standing:
    """A shape of a size at a place."""

    shape: TouchableShape
    size: float
    yaw: float
    place: FloatArray

    def placed(self, points: FloatArray) -> FloatArray:
        """``(n, 3)`` m from the nominal place, of points of the shape."""
        return self.size * points @ self._turn.T + self.place

    def directed(self, directions: FloatArray) -> FloatArray:
        """``(n, 3)`` of the shape's directions."""
        return directions @ self._turn.T

    def met(self, starts: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``(n,)`` m to where each line meets the object, and ``(n, 3)`` normals there."""
        local = (starts - self.place) @ self._turn / self.size
        ways = np.broadcast_to(direction @ self._turn, local.shape)
        hits = self.shape.rays.first_hits(local, ways)
        corners = self.shape.mesh.vertices[self.shape.mesh.faces[hits.face]]
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals = sides / np.linalg.norm(sides, axis=1, keepdims=True)
        return hits.distance * self.size, self.directed(normals)

    @cached_property
    def _turn(self) -> FloatArray:
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def contact_sample(shape: TouchableShape, size: float, random: np.random.Generator) -> list[GelWay]:
    """The ways of one exploration: into the unknown, or spread over the object, or some of each."""
    standing = _Standing(
        shape, size, float(random.uniform(0.0, 2.0 * np.pi)),
        np.append(PLACE * random.standard_normal(2), SUPPORT * random.standard_normal()),
    )  # fmt: skip
    blind = float(random.choice([0.0, 0.15, 0.5, 1.0], p=[0.35, 0.25, 0.15, 0.25]))
    off = DEPTH * random.standard_normal()
    ways: list[GelWay] = []
    count = int(random.integers(FEWEST, MOST + 1))
    for _ in range(count):
        if random.random() < blind:
            # Into the unknown: where a way towards the middle would end, and its direction.
            slant, bearing = random.choice(SLANTS), random.uniform(0.0, 2.0 * np.pi)
            level = np.sin(slant) * np.array([np.cos(bearing), np.sin(bearing)])
            down = -np.append(level, np.cos(slant))
            height = size * shape.mesh.vertices[:, 2].max() * random.uniform(0.3, 1.0)
            aside = PLACE * random.standard_normal(2)
            end = max(6.0e-3 + 0.015 * np.sin(slant), random.uniform(0.0, 0.8) * height)
            line = np.append(aside, end), down
        else:
            line = _aimed(standing, random)
        ways.append(_made(standing, *line, off, random))
    return ways


def imprint_sample(shape: TouchableShape, size: float, random: np.random.Generator) -> list[FloatArray]:
    """``(n, 3)`` m each: the places that the gel met in ``FEWEST`` to ``MOST`` presses all over an object."""
    standing = _Standing(shape, size, 0.0, np.zeros(3))
    found: list[FloatArray] = []
    for _ in range(int(random.integers(FEWEST, MOST + 1))):
        end, direction = _aimed(standing, random)
        across = frame_facing(direction, 0.0)[:, :2]
        grid = np.stack(np.meshgrid(_IMPRINT, _IMPRINT), axis=-1).reshape(-1, 2) @ across.T
        length = 2.0 * standing.size + 0.1
        distances, _ = standing.met(end - length * direction + grid, direction)
        deep = float(random.uniform(*PRESSED))
        kept = distances < distances.min() + SHARE * deep
        if np.isfinite(distances.min()) and kept.sum() >= POINTS:
            places = grid[kept] + distances[kept, None] * direction
            places = places + 0.03e-3 * random.standard_normal((len(places), 1)) * direction
            found.append(places[random.choice(len(places), POINTS, replace=False)])
    return found


def _aimed(standing: _Standing, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A little beyond a place of the object, along about its normal; ends of the object more often."""
    points, normals = standing.shape.samples
    drawn = random.integers(len(points), size=1 if random.random() < 0.7 else 6)
    k = int(drawn[np.argmax(np.linalg.norm(points[drawn], axis=1))])
    tilted = normals[k] + np.tan(random.uniform(0.0, TILT)) * random.standard_normal(3)
    inward = -standing.directed(tilted[None] / np.linalg.norm(tilted))[0]
    believed = standing.placed(points[k : k + 1])[0] + 5.0e-3 * random.standard_normal(3)
    return believed + BEYOND * inward, inward


def _made(
    standing: _Standing, end: FloatArray, direction: FloatArray, off: float, random: np.random.Generator
) -> GelWay:
    """What the gel meets on its way to an end."""
    across = frame_facing(direction, 0.0)[:, :2]
    rim = GEL * np.array([(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]) @ across.T
    length = 2.0 * standing.size + 0.1
    distances, normals = standing.met(end - length * direction + rim, direction)
    first = int(distances.argmin())
    # The support stops a way too, and is not the object.
    if not distances[first] < length:
        return GelWay(end, direction, None)
    met = end + (distances[first] - length) * direction + rim[first]
    normal = normals[first] + NORMAL * random.standard_normal(3)
    normal = normal / np.linalg.norm(normal)
    normal = -normal if normal @ direction > 0.0 else normal
    return GelWay(met + off * direction + 0.5e-3 * random.standard_normal(3), direction, normal)
