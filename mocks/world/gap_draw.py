"""One run's reality gap, drawn from its distributions and the run's seed.

Every number is keyed by what it belongs to: the run, the step or the sample. The order in
which numbers are asked for, and how often, changes nothing, so a rerun reads the same values
whatever its timing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only, row_keys
from harness.basics.geometry import rotation_about, rotation_from_vector, transform
from harness.basics.mesh import Mesh
from harness.bench.gap import Gap

_WAVES = 128


@dataclass(frozen=True, eq=False)
class ShapeDeviation:
    """The deviation of a manufactured object from its CAD model.

    Each coordinate's deviation is a stationary Gaussian field with a squared-exponential
    covariance, sampled as random plane waves (Rahimi and Recht, Random Features for
    Large-Scale Kernel Machines, 2007), so that it does not depend on any tessellation.
    """

    scale: float  #: true size over nominal size.
    centre: FloatArray  #: ``(3,)`` metres, the point that scaling leaves in place.
    wave_vectors: FloatArray  #: ``(3, waves, 3)`` rad per metre, a set for each coordinate.
    phases: FloatArray  #: ``(3, waves)`` rad.
    amplitude: float  #: metres, of each wave.

    @classmethod
    def draw(
        cls, scale: float, centre: FloatArray, sigma: float, length: float, random: np.random.Generator
    ) -> "ShapeDeviation":
        """A deviation of ``sigma`` metres a coordinate, smooth over ``length`` metres."""
        waves = random.standard_normal((3, _WAVES, 3)) / length
        phases = random.uniform(0.0, 2.0 * np.pi, (3, _WAVES))
        return cls(scale, centre, waves, phases, sigma * np.sqrt(2.0 / _WAVES))

    def applied(self, points: FloatArray) -> FloatArray:
        """Where ``(n, 3)`` points of the nominal object are on the true one, in the object's frame."""
        moved = self.centre + self.scale * (points - self.centre)
        if self.amplitude == 0.0:
            return moved
        for axis in range(3):
            arguments = points @ self.wave_vectors[axis].T + self.phases[axis]
            moved[:, axis] += self.amplitude * np.cos(arguments).sum(axis=1)
        return moved


# What a stream of numbers is for; each stays what it is when another is added.
_OBJECT, _SENSOR, _GEL, _SHAPE, _SHADING, _ARM, _TILT, _OFFSET, _PIXELS, _CAMERA = range(10)
_SCENE_CAMERA, _SCENE_NOISE, _SIZE = range(10, 13)

_VERTICAL = np.array([0.0, 0.0, 1.0])
_SHADING_SHARE = 0.15
"""Of the picture's width: the length over which shading varies."""


@dataclass(frozen=True, eq=False)
class RunDraw:
    """What differs from nominal for a whole run."""

    position: FloatArray  #: ``(3,)`` metres, of the object in base.
    yaw: float  #: rad, of the object about the vertical.
    tilt: FloatArray  #: ``(2,)`` rad, of the object about base x and y.
    sensor_tilt: FloatArray  #: ``(2,)`` rad, of the gel about its x and y.
    image_yaw: float  #: rad, of the gel about its z.
    gel_centre: FloatArray  #: ``(3,)`` metres, of the gel in its nominal frame.
    pitch: float  #: length of gel that a pixel shows from column to column, over its nominal length.
    aspect: float  #: a pixel's height over its width.
    height_gain: float  #: true indentation over what the calibration's gel would show.
    scale: float  #: true size of the object over its nominal size.

    @property
    def object_rotation(self) -> FloatArray:
        """``(3, 3)``, of the object in base."""
        tilted: FloatArray = rotation_from_vector(np.array([*self.tilt, 0.0]))
        return tilted @ rotation_about(_VERTICAL, self.yaw)

    @property
    def gel_from_true_gel(self) -> FloatArray:
        """``(4, 4)``: where the gel really is, in its nominal frame."""
        tilted: FloatArray = rotation_from_vector(np.array([*self.sensor_tilt, 0.0]))
        return transform(tilted @ rotation_about(_VERTICAL, self.image_yaw), self.gel_centre)


@dataclass(frozen=True, eq=False)
class ContactDraw:
    """What differs for one contact."""

    arm_error: FloatArray  #: ``(3,)`` metres in base, of the flange against what is reported.
    along_tool: float  #: metres, in addition, along the tool.
    gel_rotation: FloatArray  #: ``(3, 3)``, of the gel in its own frame.
    height_offset: float  #: metres of indentation.


class GapDraw:
    """The random differences of one run between world and model."""

    def __init__(self, gap: Gap, seed: int) -> None:
        self.gap = gap
        self._seed = seed
        self._contacts: dict[int, ContactDraw] = {}

    @cached_property
    def run(self) -> RunDraw:
        """The draws that hold for the whole run."""
        thing, sensor = self.gap.object, self.gap.sensor
        height = thing.position if thing.height is None else thing.height
        spread = np.array([thing.position, thing.position, height])
        of_object, of_sensor, of_gel = self.random(_OBJECT), self.random(_SENSOR), self.random(_GEL)
        of_camera = self.random(_CAMERA)
        return RunDraw(
            position=read_only(spread * of_object.standard_normal(3)),
            yaw=thing.yaw * of_object.standard_normal(),
            tilt=read_only(thing.tilt * of_object.standard_normal(2)),
            sensor_tilt=read_only(sensor.tilt * of_sensor.standard_normal(2)),
            image_yaw=sensor.image_yaw * of_sensor.standard_normal(),
            gel_centre=read_only(sensor.gel_centre * of_sensor.standard_normal(3)),
            pitch=1.0 + sensor.pitch * of_camera.standard_normal(),
            aspect=1.0 + sensor.aspect * of_camera.standard_normal(),
            height_gain=1.0 + self.gap.gel.height_gain * of_gel.standard_normal(),
            scale=1.0 + self.gap.shape.scale * self.random(_SHAPE, 0).standard_normal(),
        )

    def contact(self, step: int) -> ContactDraw:
        """The draws of one contact."""
        if step not in self._contacts:
            arm, sensor = self.random(_ARM, step), self.gap.sensor
            tilt = sensor.tilt_per_contact * self.random(_TILT, step).standard_normal(2)
            self._contacts[step] = ContactDraw(
                arm_error=read_only(self.gap.arm.translation * arm.standard_normal(3)),
                along_tool=self.gap.arm.along_tool * arm.standard_normal(),
                gel_rotation=read_only(rotation_from_vector(np.array([*tilt, 0.0]))),
                height_offset=self.gap.gel.height_offset * self.random(_OFFSET, step).standard_normal(),
            )
        return self._contacts[step]

    def camera(self, base_from_camera: FloatArray, focal_length: float) -> tuple[FloatArray, float]:
        """Where the scene camera really is, ``(4, 4)``, and its focal length in pixels."""
        gap, random = self.gap.camera, self.random(_SCENE_CAMERA)
        moved = base_from_camera.copy()
        moved[:3, 3] += gap.position * random.standard_normal(3)
        moved[:3, :3] = moved[:3, :3] @ rotation_from_vector(gap.rotation * random.standard_normal(3))
        return read_only(moved), focal_length * (1.0 + gap.focal_length * float(random.standard_normal()))

    def camera_noise(self, rows: int, columns: int, step: int, sample: int) -> FloatArray:
        """``(rows, columns, 3)`` grey levels that the scene camera adds to one picture."""
        noise = self.random(_SCENE_NOISE, step, sample).standard_normal((rows, columns, 3))
        return read_only(self.gap.camera.noise * noise)

    def hidden_size(self, low: float, high: float) -> float:
        """M, the longest side of an object whose size nobody is told: even in its logarithm."""
        return float(np.exp(self.random(_SIZE).uniform(np.log(low), np.log(high))))

    def deviation(self, centre: FloatArray) -> ShapeDeviation:
        """How the object's shape differs; scaling leaves ``centre``, ``(3,)`` metres, in place."""
        shape, random = self.gap.shape, self.random(_SHAPE, 1)
        return ShapeDeviation.draw(self.run.scale, centre, shape.deviation, shape.deviation_length, random)

    def shading(self, rows: int, columns: int) -> FloatArray:
        """``(rows, columns)`` metres of indentation, smooth, the same in every picture of a run."""
        rough = self.random(_SHADING).standard_normal((rows, columns))
        smooth = gaussian_filter(rough, _SHADING_SHARE * columns, mode="wrap")
        return read_only(self.gap.gel.shading * (smooth - smooth.mean()) / smooth.std())

    def pixel_noise(self, rows: int, columns: int, step: int, sample: int) -> FloatArray:
        """``(rows, columns)`` metres of indentation, independent from pixel to pixel and sample to sample."""
        noise = self.random(_PIXELS, step, sample).standard_normal((rows, columns))
        return read_only(self.gap.gel.pixel_noise * noise)

    def summary(self) -> Mapping[str, Any]:
        """The run's draws in SI, for the report."""
        run = self.run
        return {
            "gap": self.gap.title,
            "object_position_m": run.position.tolist(),
            "object_yaw_rad": run.yaw,
            "object_tilt_rad": run.tilt.tolist(),
            "object_scale": run.scale,
            "shape_deviation_m": self.gap.shape.deviation,
            "sensor_tilt_rad": run.sensor_tilt.tolist(),
            "image_yaw_rad": run.image_yaw,
            "gel_centre_m": run.gel_centre.tolist(),
            "pitch_over_nominal": run.pitch,
            "aspect": run.aspect,
            "height_gain": run.height_gain,
            "gel_skirt_m": self.gap.gel.skirt,
        }

    def random(self, purpose: int, *key: int) -> np.random.Generator:
        """The stream of numbers of one purpose (sound's own are in ``mocks.world.sound``).

        Args:
            purpose: what the numbers are for.
            key: what they belong to; steps and samples count from -1.
        """
        spawn_key = (purpose, *(number + 1 for number in key))
        return np.random.Generator(np.random.Philox(np.random.SeedSequence(self._seed, spawn_key=spawn_key)))


def split_long_edges(mesh: Mesh, longest: float) -> Mesh:
    """The same surface with no edge longer than ``longest`` metres.

    Every long edge is cut at its middle for both its faces, so that no crack opens when the
    vertices are moved afterwards.
    """
    vertices, faces = mesh.vertices, mesh.faces
    while True:
        edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
        # Adding the three coordinates is several times faster than a norm along an axis of three.
        x, y, z = np.moveaxis((vertices[edges[..., 0]] - vertices[edges[..., 1]]) ** 2, -1, 0)
        lengths = np.sqrt(x + y + z)
        long = lengths > longest
        if not long.any():
            return Mesh(vertices, faces)
        vertices, middles = _cut(vertices, edges, long)
        # Faces cut along their long edges: into one, two, three or four.
        count = long.sum(axis=1)
        # Turn each face so that its first edge is a long one, and a single short one comes last.
        first = np.where(count == 2, (np.argmin(long, axis=1) + 1) % 3, np.argmax(long, axis=1))
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces, order, axis=1).T
        ab, bc, ca = np.take_along_axis(middles, order, axis=1).T
        one, two, three = count == 1, count == 2, count == 3
        pieces = [
            faces[count == 0],
            _stacked(one, (a, ab, c), (ab, b, c)),
            _stacked(two, (a, ab, c), (ab, b, bc), (ab, bc, c)),
            _stacked(three, (a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca)),
        ]
        faces = np.concatenate(pieces)


def _cut(vertices: FloatArray, edges: IntArray, long: BoolArray) -> tuple[FloatArray, IntArray]:
    """Vertices with the middles of long edges appended; ``(faces, 3)`` index of each edge's middle."""
    ends = np.sort(edges[long], axis=-1)
    _, first, which = np.unique(row_keys(ends), return_index=True, return_inverse=True)
    middles = np.full(long.shape, -1, dtype=np.int64)
    middles[long] = len(vertices) + which.ravel()
    added = vertices[ends[first]].mean(axis=1)
    return np.concatenate([vertices, added]), middles


def _stacked(chosen: BoolArray, *triangles: tuple[IntArray, IntArray, IntArray]) -> IntArray:
    return np.concatenate([np.stack(corners, axis=1)[chosen] for corners in triangles])


def nearest_face(mesh: Mesh, point: FloatArray) -> tuple[int, FloatArray]:
    """The face nearest to a ``(3,)`` point, and the point of that face that is nearest.

    By arithmetic of its own: truth is not computed by the kernel that estimates are.
    """
    corners, normals = mesh.corners, mesh.face_normals
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    height = np.einsum("ij,ij->i", point - a, normals)
    foot = point - height[:, None] * normals
    turns = [np.cross(q - p, foot - p) for p, q in ((a, b), (b, c), (c, a))]
    inside = np.all([np.einsum("ij,ij->i", turn, normals) >= 0.0 for turn in turns], axis=0)
    inside &= mesh.face_areas > 0.0
    candidates = np.stack([foot, *(_on_segment(p, q, point) for p, q in ((a, b), (b, c), (c, a)))])
    distances = np.linalg.norm(candidates - point, axis=2)
    distances[0, ~inside] = np.inf
    kind, face = np.unravel_index(int(np.argmin(distances)), distances.shape)
    return int(face), candidates[kind, face]


def _on_segment(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    along = end - start
    squares = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", point - start, along) / np.where(squares > 0.0, squares, 1.0)
    nearest: FloatArray = start + np.minimum(np.maximum(share, 0.0), 1.0)[:, None] * along
    return nearest
