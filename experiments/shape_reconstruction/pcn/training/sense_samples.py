"""What networks of one sense or both learn from: touches, silhouettes, and the whole of drawn shapes.

The touches are those that ours learns from; the silhouette is what a camera like the bench's sees.
"""

from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.ndimage import binary_fill_holes

from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS
from experiments.shape_reconstruction.pcn.point_frame import PointFrame, taken
from experiments.shape_reconstruction.pcn.training.samples import FEWEST, PRESSES, shape_of
from experiments.shape_reconstruction.pcn.training.touched_shape import TouchedShape
from experiments.shape_reconstruction.pcn.window import SIDE, UNTOUCHED, window_points
from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import rotation_about
from harness.basics.worker_pool import worker_pool
from harness.sim.solid.surface_samples import random_points

WHOLE = 4096
"""Points all over each shape that an answer is compared with."""

PUT = 20.0e-3
"""M, deviation per axis of where an object stands from where a scene puts it."""

AWAY, ELEVATION = (0.9, 1.5), (0.3, 0.65)
"""M and rad, of the camera from where a scene puts the object; the bench's is 1.16 m and 0.45 rad away."""

AIMED = 3.0e-3
"""M, deviation per axis of the window from where it should be: the camera's own errors."""

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class SenseSamples:
    """What the network of one sense learns from; all in its own frame."""

    inputs: dict[str, AnyArray]  #: by name, ``(n, ...)``, points in float32, windows in uint8.
    whole: AnyArray  #: ``(n, WHOLE, 3)`` float32.
    reach: FloatArray  #: ``(n,)`` m for one of the frame's units.
    shapes: IntArray  #: ``(n,)`` number of the shape that each is of.

    def of(self, rows: AnyArray) -> "SenseSamples":
        """Some of them."""
        inputs = {name: value[rows] for name, value in self.inputs.items()}
        return SenseSamples(inputs, self.whole[rows], self.reach[rows], self.shapes[rows])


SampleRow = tuple[dict[str, AnyArray], AnyArray, float]
"""Inputs, the whole, and the reach of the frame."""


def sense_samples(sense: str, shapes: int, each: int, seed: int, processes: int) -> SenseSamples:
    """So many samples of each of so many shapes; fewer of a shape that no sensor finds room about."""
    make = partial(_of_shape, sense, each, seed)
    with worker_pool(processes) if processes > 1 else nullcontext() as pool:
        made = _all_made(make, shapes, pool)
    rows = [row for found in made for row in found]
    inputs = {name: np.stack([row[0][name] for row in rows]) for name, _ in INPUTS[sense]}
    numbers = np.repeat(np.arange(shapes), [len(found) for found in made])
    return SenseSamples(
        inputs, np.stack([row[1] for row in rows]), np.array([row[2] for row in rows]), numbers
    )


def _all_made(make: "partial[list[SampleRow]]", shapes: int, pool: Executor | None) -> list[list[SampleRow]]:
    return (
        [make(n) for n in range(shapes)] if pool is None else list(pool.map(make, range(shapes), chunksize=8))
    )


def _of_shape(sense: str, each: int, seed: int, number: int) -> list[SampleRow]:
    shape, random = shape_of(number, seed), np.random.default_rng((seed, number, 3))
    rays, everywhere = RayMesh(shape.mesh), random_points(shape.mesh, WHOLE, random)[0]
    made = [_sample(sense, shape, rays, everywhere, random) for _ in range(each)]
    return [row for row in made if row is not None]


def _sample(
    sense: str, shape: TouchedShape, rays: RayMesh, everywhere: FloatArray, random: np.random.Generator
) -> SampleRow | None:
    """One set of touches and one look; None where the sensor finds too little room."""
    turn = rotation_about(_UP, random.uniform(0.0, 2.0 * np.pi))
    put = np.append(PUT * random.standard_normal(2), 0.0)
    frame, inputs = UNTOUCHED, {}
    if sense != "picture":
        points = shape.touched(int(random.integers(PRESSES[0], PRESSES[1] + 1)), random)
        if len(points) < FEWEST:
            return None
        points = points @ turn.T + put
        frame = PointFrame.of(points)
        inputs["touched"] = frame.inward(taken(points, int(random.integers(1 << 31)))).astype(np.float32)
    if sense != "touch":
        inputs["window"] = _silhouette(rays, frame, turn, put, random)
    return inputs, frame.inward(everywhere @ turn.T + put).astype(np.float32), frame.reach


def _silhouette(
    rays: RayMesh, frame: PointFrame, turn: FloatArray, put: FloatArray, random: np.random.Generator
) -> AnyArray:
    """``(1, SIDE, SIDE)`` uint8: the shape as a camera over the x axis sees it, its holes filled."""
    away, elevation = random.uniform(*AWAY), random.uniform(*ELEVATION)
    eye = away * np.array([np.cos(elevation), 0.0, np.sin(elevation)])
    through = window_points(frame, eye) + AIMED * random.standard_normal(3)
    ways = (through - eye) / np.linalg.norm(through - eye, axis=1, keepdims=True)
    # The shape is where it was drawn: the camera is turned and put about it instead.
    starts = np.broadcast_to((eye - put) @ turn, ways.shape)
    hits = rays.first_hits(np.ascontiguousarray(starts), np.ascontiguousarray(ways @ turn))
    met = np.isfinite(hits.distance).reshape(SIDE, SIDE)
    return binary_fill_holes(met).astype(np.uint8)[None]
