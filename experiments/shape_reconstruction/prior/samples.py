"""Training samples: silhouettes of random household shapes, and points all over each shape."""

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import binary_fill_holes

from experiments.shape_reconstruction.prior.network import NOMINAL_FRAME, SIDE, PointFrame, window_points
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.basics.worker_pool import worker_pool
from harness.sim.solid.household.families import FAMILIES, draw
from harness.sim.solid.surface_samples import random_points

SIZES = (0.08, 0.28)
"""Smallest and largest longest side of a shape, m; uniform in its logarithm."""

WHOLE = 4096
"""Points on each shape that the network's output is compared with."""

PLACE_SIGMA = 20.0e-3
"""Standard deviation per axis of the object's position about its nominal place, m."""

DISTANCE, ELEVATION = (0.9, 1.5), (0.3, 0.65)
"""Distance, m, and elevation, rad, of the camera from the nominal place; on the bench 1.16 m and 0.45 rad."""

AIM_SIGMA = 3.0e-3
"""Standard deviation per axis of the window's position, from the camera's errors, m."""


@dataclass(frozen=True)
class CompletionProfile:
    """Amounts of samples and of the fit."""

    shapes: int  #: number of shapes; a tenth of them is held out.
    sets: int  #: samples of each shape.
    steps: int  #: steps of the fit.
    batch: int = 12  #: samples in a step.
    compared: int = 1024  #: points of the network and of the shape that are compared in a step.


@dataclass(frozen=True, eq=False)
class CompletionSamples:
    """Samples of a completion network, all in its own frame."""

    inputs: dict[str, AnyArray]  #: by name, ``(n, ...)``: points in float32, windows in uint8.
    whole: AnyArray  #: ``(n, WHOLE, 3)`` float32, points all over the shape.
    reach: FloatArray  #: ``(n,)`` unit of the frame, m.
    shapes: IntArray  #: ``(n,)`` number of the shape.

    def of(self, rows: AnyArray) -> "CompletionSamples":
        """Select samples."""
        inputs = {name: value[rows] for name, value in self.inputs.items()}
        return CompletionSamples(inputs, self.whole[rows], self.reach[rows], self.shapes[rows])


SampleRow = tuple[dict[str, AnyArray], AnyArray, float]
"""Inputs by name, points all over the shape, and the unit of the frame in m."""


def look_samples(shapes: int, each: int, seed: int, processes: int) -> CompletionSamples:
    """Make so many silhouettes of each of so many shapes."""
    return gather_samples(partial(_looks_at, each, seed), shapes, processes)


def gather_samples(make: Callable[[int], list[SampleRow]], shapes: int, processes: int) -> CompletionSamples:
    """Make the samples of all shapes, in the order of the shapes for any number of processes.

    Args:
        make: returns the samples of one shape by its number; can be pickled.
        shapes: number of shapes.
        processes: number of processes that share the work.
    """
    with worker_pool(processes) if processes > 1 else nullcontext() as pool:
        numbers = range(shapes)
        made = list(map(make, numbers) if pool is None else pool.map(make, numbers, chunksize=8))
    rows = [row for found in made for row in found]
    inputs = {name: np.stack([row[0][name] for row in rows]) for name in rows[0][0]}
    whole, reach = np.stack([row[1] for row in rows]), np.array([row[2] for row in rows])
    return CompletionSamples(inputs, whole, reach, np.repeat(np.arange(shapes), [len(one) for one in made]))


def shape_of(number: int, seed: int) -> Mesh:
    """Draw a shape of a seed by its number; the families take turns."""
    random = np.random.default_rng((seed, number))
    names = list(FAMILIES)
    surface = draw(names[number % len(names)], random).surface
    size = float(np.exp(random.uniform(*np.log(SIZES))))
    return Mesh(size * surface.vertices, surface.faces)


def _looks_at(each: int, seed: int, number: int) -> list[SampleRow]:
    mesh, random = shape_of(number, seed), np.random.default_rng((seed, number, 3))
    rays, everywhere = RayMesh(mesh), random_points(mesh, WHOLE, random)[0]
    rows: list[SampleRow] = []
    for _ in range(each):
        turn, put = draw_pose(random)
        window = silhouette_window(rays, NOMINAL_FRAME, turn, put, random)
        whole = NOMINAL_FRAME.inward(everywhere @ turn.T + put).astype(np.float32)
        rows.append(({"window": window}, whole, NOMINAL_FRAME.reach))
    return rows


def draw_pose(random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Draw the ``(3, 3)`` yaw and the ``(3,)`` position, m, of an object on its support."""
    turn = rotation_about(np.array([0.0, 0.0, 1.0]), random.uniform(0.0, 2.0 * np.pi))
    return turn, np.append(PLACE_SIGMA * random.standard_normal(2), 0.0)


def silhouette_window(
    rays: RayMesh, frame: PointFrame, turn: FloatArray, put: FloatArray, random: np.random.Generator
) -> AnyArray:
    """Render a silhouette, ``(1, SIDE, SIDE)`` uint8 with its holes filled, by a camera above the x axis.

    Args:
        rays: the shape.
        frame: frame of the network's points.
        turn: ``(3, 3)`` yaw of the shape.
        put: ``(3,)`` position of the shape, m.
        random: draws the camera.
    """
    away, elevation = random.uniform(*DISTANCE), random.uniform(*ELEVATION)
    eye = away * np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    through = window_points(frame, eye) + AIM_SIGMA * random.standard_normal(3)
    directions = (through - eye) / np.linalg.norm(through - eye, axis=1, keepdims=True)
    # The shape is not moved: the camera is moved about it instead.
    starts = np.broadcast_to((eye - put) @ turn, directions.shape)
    hits = rays.first_hits(np.ascontiguousarray(starts), np.ascontiguousarray(directions @ turn))
    met = np.isfinite(hits.distance).reshape(SIDE, SIDE)
    return binary_fill_holes(met).astype(np.uint8)[None]
