"""Pictures without noise: exact visibility, matt surfaces, light straight from its source.

Every pixel is the mean over places in it that lie as a lattice does and share no column and no row, so that
an edge is caught as finely along the pixels as across them (``harness.sim.light.direct_image``). What they
leave unknown is told by their quarters, every fourth place. Error in places so spread goes with their number
to the power of 3/4: of all together it is that of a quarter over the root of eight.
"""

import functools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import gcd
from types import MappingProxyType

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from harness.sim.light.lambert import Places, cosines, places_seen, radiance

MOST_SAMPLES = 64
"""A side of a pixel: four thousand places, and less error than a grey level of 12 bits."""

QUARTERS = 4
Place = tuple[float, float]


@dataclass(frozen=True, eq=False)
class VisibleSurface:
    """What a camera sees of an object, before any light."""

    camera: Pinhole  #: that looks.
    samples: int  #: a side of a pixel.
    pixel: IntArray  #: ``(n,)`` index, row by row, of each sample that meets the object.
    quarter: IntArray  #: ``(n,)`` which quarter of its pixel's samples it is of, 0 to 3.
    depth: FloatArray  #: ``(n,)`` m, z in the camera's frame.
    places: Places  #: ``(n)`` of the surface.


@dataclass(frozen=True, eq=False)
class DirectImage:
    """A picture with what is known of it."""

    image: LinearImage  #: linear light, coverage and depth.
    normal: FloatArray
    """``(rows, columns, 3)`` unit, object's frame, mean over what is covered; zero elsewhere."""
    noise: float | None
    """linear light, root mean square over pixels and channels: what more samples would change; None for one
    sample a pixel, which tells nothing of it."""
    alpha_noise: float | None  #: the same of coverage.
    samples: int  #: a side of a pixel.
    seconds: Mapping[str, float]  #: by what was done.


class LitObject:
    """An object prepared once for any number of pictures; read-only and safe to share by threads."""

    appearance: Appearance  #: of its surface.
    rays: RayMesh  #: through its faces.

    def __init__(self, appearance: Appearance) -> None:
        """Sort the faces; errors as of ``RayMesh``."""
        self.appearance = appearance
        self.rays = RayMesh(appearance.mesh)

    def seen(self, camera: Pinhole, samples: int) -> VisibleSurface:
        """Follow the camera's rays.

        Args:
            camera: anywhere, inside the object too.
            samples: a side of a pixel, 1 to 64.

        Raises:
            OutOfDomain: fewer or more samples.
        """
        parts = [self._seen_at(camera, *each) for each in pixel_places(samples)]
        pixel, quarter, face, weights, away, depth = (
            np.concatenate(column) for column in zip(*parts, strict=True)
        )
        places = places_seen(self.appearance, face, weights, away)
        return VisibleSurface(camera, samples, pixel, quarter, depth, places)

    def _seen_at(
        self, camera: Pinhole, offset: tuple[float, float], quarter: int
    ) -> tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
        directions = camera.directions(offset).reshape(-1, 3)
        hits = self.rays.first_hits(camera.eye, directions)
        met = np.flatnonzero(hits.face >= 0)
        away = directions[met]
        depth = hits.distance[met] * (away @ camera.forward)
        return met, np.full(len(met), quarter), hits.face[met], hits.weights[met], away, depth

    def falling(self, seen: VisibleSurface, lights: Sequence[DirectionalLight]) -> FloatArray:
        """``(n, lights)`` irradiance of each sample by each light, with nothing in its way."""
        size = self.appearance.mesh.diagonal
        columns = [irradiance(seen.places, light, size) for light in lights]
        return np.stack(columns, axis=1) if columns else np.zeros((len(seen.places), 0))

    def shadowed(
        self, seen: VisibleSurface, lights: Sequence[DirectionalLight], falling: FloatArray
    ) -> FloatArray:
        """``falling`` without the light that something is in the way of."""
        free = [
            sees_light(self.rays, seen.places, light, falling[:, k] > 0.0) for k, light in enumerate(lights)
        ]
        return falling * np.stack(free, axis=1) if free else falling

    def render(
        self,
        camera: Pinhole,
        lights: Sequence[DirectionalLight],
        samples: int = 4,
        shadow: bool = True,
    ) -> DirectImage:
        """One picture.

        Args:
            camera: anywhere.
            lights: from far away; without any the object is black.
            samples: a side of a pixel, 1 to 64.
            shadow: whether the object is in its own light's way.

        Raises:
            OutOfDomain: fewer or more samples.
        """
        clock = _Clock()
        seen = self.seen(camera, samples)
        clock.lap("hits")
        falling = self.falling(seen, lights)
        clock.lap("light")
        if shadow:
            falling = self.shadowed(seen, lights, falling)
            clock.lap("shadow")
        return gathered(seen, falling, clock)


class _Clock:
    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = time.perf_counter()

    def lap(self, done: str) -> None:
        now = time.perf_counter()
        self.seconds[done], self._since = now - self._since, now


def gathered(seen: VisibleSurface, falling: FloatArray, clock: _Clock | None = None) -> DirectImage:
    """The picture of what falls on the samples, ``(n, lights)``."""
    clock = clock or _Clock()
    light = radiance(seen.places, falling.sum(axis=1))
    quarters = _summed(seen, np.column_stack([light, np.ones(len(light))]))
    every = seen.samples**2
    total = quarters.sum(axis=0)
    colour, covered = total[..., :3], total[..., 3]
    hit = np.where(covered > 0.0, covered, 1.0)
    depth = _summed(seen, seen.depth[:, None]).sum(axis=0)[..., 0] / hit
    image = LinearImage(
        read_only(colour / every),
        read_only(covered / every),
        read_only(np.where(covered > 0.0, depth, np.inf)),
    )
    total = _summed(seen, seen.places.normals).sum(axis=0)
    length = np.linalg.norm(total, axis=-1, keepdims=True)
    normal = read_only(np.asarray(total / np.where(length > 0.0, length, 1.0)))
    noise, alpha_noise = (
        _left_unknown(quarters[..., each], seen.samples) for each in (slice(3), slice(3, 4))
    )
    clock.lap("gather")
    return DirectImage(image, normal, noise, alpha_noise, seen.samples, MappingProxyType(dict(clock.seconds)))


def _summed(seen: VisibleSurface, values: FloatArray) -> FloatArray:
    camera = seen.camera
    at = seen.quarter * camera.pixels + seen.pixel
    sums = [np.bincount(at, values[:, k], QUARTERS * camera.pixels) for k in range(values.shape[1])]
    return np.asarray(np.stack(sums, axis=-1).reshape(QUARTERS, camera.height, camera.width, -1), np.float64)


def _left_unknown(quarters: FloatArray, samples: int) -> float | None:
    """Error of the quarters' mean, root mean square over the picture; None where a quarter is empty."""
    if samples == 1:
        return None
    means = quarters / np.array(quarter_counts(samples))[:, None, None, None]
    return float(np.sqrt(np.mean(np.var(means, axis=0, ddof=1)) / 8.0))


def pixel_places(samples: int) -> list[tuple[Place, int]]:
    """(x, y) of ``samples**2`` places in a pixel, and which quarter each is of, 0 to 3.

    A lattice of one generator (Korobov), of all such the one whose two nearest places are farthest apart.
    Each of ``samples**2`` columns and rows has one place in its middle. For edges of any slope the error
    goes with the number of places to the power of -0.77 (measured: docs/explanation/vision.md).

    Args:
        samples: a side of a pixel, 1 to 64.

    Raises:
        OutOfDomain: fewer or more.
    """
    count = _counted(samples)
    rows = _rows(count)
    return [(((k + 0.5) / count, (row + 0.5) / count), k % QUARTERS) for k, row in enumerate(rows)]


def quarter_counts(samples: int) -> tuple[int, ...]:
    """How many places each quarter has; errors as of ``pixel_places``."""
    count = _counted(samples)
    return tuple(len(range(quarter, count, QUARTERS)) for quarter in range(QUARTERS))


def _counted(samples: int) -> int:
    if not 1 <= samples <= MOST_SAMPLES:
        raise OutOfDomain(f"{samples} samples a side of a pixel were asked for; give 1 to {MOST_SAMPLES}")
    return samples**2


@functools.cache
def _rows(count: int) -> tuple[int, ...]:
    """The row of each column's place."""
    if count == 4:
        # A lattice of four has all of them in one line: four queens have not.
        return 2, 0, 3, 1
    steps = [step for step in range(1, max(count, 2)) if gcd(step, count) == 1]
    best = max(steps, key=lambda step: _nearest(count, step))
    return tuple(column * best % count for column in range(count))


def _nearest(count: int, step: int) -> int:
    """Square of the shortest way between two places of a lattice (Gauss's reduction), in rows."""
    short, long = (1, step), (0, count)
    while True:
        if short[0] ** 2 + short[1] ** 2 > long[0] ** 2 + long[1] ** 2:
            short, long = long, short
        size = short[0] ** 2 + short[1] ** 2
        times = round((short[0] * long[0] + short[1] * long[1]) / size)
        if times == 0:
            return size
        long = (long[0] - times * short[0], long[1] - times * short[1])


def irradiance(places: Places, light: DirectionalLight, size: float) -> FloatArray:
    """Compute the ``(n,)`` unoccluded irradiance of each point.

    Args:
        places: of the surface.
        light: from far away.
        size: m, of the object.
    """
    return light.irradiance * cosines(places, light.direction[None], size)


def sees_light(rays: RayMesh, places: Places, light: DirectionalLight, asked: BoolArray) -> BoolArray:
    """Test each point for an unoccluded path to the light.

    Args:
        rays: of the same surface.
        places: of the surface.
        light: from far away.
        asked: ``(n,)`` the places that it matters for; False is answered for the others.
    """
    free = np.zeros(len(places), np.bool_)
    free[asked] = rays.free(places.lifted[asked], light.direction, places.faces[asked])
    return free
