"""The pixels of a sensor as it was made: their pitch, and that they need not be square."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import map_coordinates

from harness.basics.arrays import ByteArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.basics.geometry import translation
from harness.basics.mesh import Mesh
from harness.bench.gap import GelGap
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import R15_SKIRT, GelSkirt, deform, half_kernel, over_range
from harness.sim.gel.height_map import RasterMesh, height_maps, rest_surface
from harness.sim.optics.known_gel import require_own
from harness.sim.optics.lit_calibration import named_calibration
from harness.sim.optics.optics import Optics

_FAR = 0.5e-3
"""Metres of gap that count as none: the jump from an object's outline to nothing must not ring."""


@dataclass(frozen=True)
class PictureGrid:
    """Where the pixels of one camera look."""

    sensor: TactileSensor  #: its pitch is that along the rows: from one column to the next.
    aspect: float = 1.0  #: pitch from one row to the next over that from one column to the next.

    @classmethod
    def drawn(cls, nominal: TactileSensor, pitch: float, aspect: float) -> "PictureGrid":
        """A make's sensor whose column pitch is ``pitch`` times the stated one."""
        return cls(replace(nominal, pitch=nominal.pitch * pitch), aspect)

    @property
    def mean_pitch(self) -> float:
        """Metres a pixel, of a square one of the same area."""
        return float(self.sensor.pitch * np.sqrt(self.aspect))

    def gaps(self, raster: RasterMesh, gel_from_object: FloatArray) -> FloatArray:
        """``(rows, columns)`` metres, as ``height_maps`` has it; of other than square pixels, by splines.

        Args:
            raster: the object.
            gel_from_object: ``(4, 4)`` rigid.
        """
        if self.aspect == 1.0:
            return np.asarray(height_maps(raster, gel_from_object[None], self.sensor)[0])
        # As many rows more above as below: at an aspect of one the rows are those of the sensor.
        more = int(np.ceil(0.5 * self.sensor.rows * max(self.aspect - 1.0, 0.0))) + 3
        tall = replace(self.sensor, rows=self.sensor.rows + 2 * more)
        square = np.minimum(height_maps(raster, gel_from_object[None], tall)[0], _FAR)
        rows = (np.arange(self.sensor.rows) + 0.5 - self.sensor.rows / 2) * self.aspect
        at = np.meshgrid(rows + tall.rows / 2 - 0.5, np.arange(self.sensor.columns), indexing="ij")
        gap = np.asarray(map_coordinates(square, at, order=3, mode="nearest"), dtype=np.float64)
        return np.where(gap < 0.5 * _FAR, gap, np.inf)


_NARROWEST = 5
_WIDEST = 301


class WorldGel:
    """From how deep the object reaches into the gel to the picture, at the exact level.

    Args:
        sensor: make and geometry.
        gap: how this gel differs from its model.
        calibration: whose colours it has, a shipped name or a path.
        steeper: the pitch that colours are stated for over this gel's own: a slope in pixels.
    """

    def __init__(self, sensor: TactileSensor, gap: GelGap, calibration: str, steeper: float = 1.0) -> None:
        self._sensor = sensor
        self.calibration = named_calibration(calibration)  #: whose colours this gel has.
        require_own(self.calibration, sensor)
        self._steeper = steeper
        # Return Taxim's pyramid of blurs, each half as wide as the one before: ``blur`` m in all.
        wanted = gap.skirt / sensor.pitch
        pyramids: list[tuple[float, tuple[int, ...]]] = []
        for widest in range(_NARROWEST, _WIDEST + 1, 2):
            kernels = [widest]
            while kernels[-1] // 2 | 1 >= _NARROWEST:
                kernels.append(kernels[-1] // 2 | 1)
            # Variances of blurs in a row add up.
            halves = [half_kernel(kernel) for kernel in (*kernels, R15_SKIRT.final)]
            variance = sum(2.0 * np.sum(half * np.arange(len(half)) ** 2) for half in halves)
            pyramids.append((abs(float(np.sqrt(variance)) - wanted), tuple(kernels)))
        self._skirt = GelSkirt(min(pyramids)[1], R15_SKIRT.final, R15_SKIRT.core)
        self._optics = Optics(self.calibration, "exact", -rest_surface(sensor))
        self.background: ByteArray = self.calibration.background
        """``(rows, columns, 3)``, the picture of the untouched gel."""

    def picture(self, penetration: FloatArray, gain: float, noise: FloatArray) -> ByteArray:
        """``(rows, columns, 3)`` uint8, RGB.

        Args:
            penetration: ``(rows, columns)`` metres, 0 or more.
            gain: shown indentation over the true one.
            noise: ``(rows, columns)`` metres, added where the gel is touched.
        """
        touched = penetration > 0.0
        shown = np.where(touched, np.maximum(gain * penetration + noise, 0.0), 0.0)
        held, _ = over_range(shown[None], self._sensor)
        deformed = deform(held, self._skirt)
        if self._steeper != 1.0:
            deformed = self._steeper * deformed
        image: ByteArray = self._optics.render(deformed).images[0]
        return image


BED_MODULUS = 1.5e7
"""N/m^3: a soft gel, 37 kPa over 2.5 mm of thickness; 2 mm over the whole window take 9 N."""

CELL = 8.0e-3
"""Metres, edge of the boxes into which faces are sorted."""

_LARGEST_GRID = 2_000_000


class GelContact:
    """A rectangle of gel against one mesh.

    Args:
        mesh: of the object, in its frame.
        window: metres (x, y) of the gel's surface.
        spacing: metres between the springs.
        reach: metres behind the gel's surface within which a surface of the object is felt.
    """

    def __init__(self, mesh: Mesh, window: tuple[float, float], spacing: float, reach: float) -> None:
        self._corners = mesh.corners
        # Faces by the boxes of edge ``CELL`` that their bounds touch, as starts and members.
        self._origin = mesh.bounds[0] - CELL / 2
        self._shape = np.ceil((mesh.bounds[1] + CELL / 2 - self._origin) / CELL).astype(np.int64)
        if int(np.prod(self._shape)) > _LARGEST_GRID:
            raise ValueError(
                f"an object of {mesh.diagonal:.2f} m is larger than any that the gel could touch"
            )
        a, b, c = (self._corners[:, corner] for corner in range(3))
        low = np.floor((np.minimum(np.minimum(a, b), c) - self._origin) / CELL).astype(np.int64)
        high = np.floor((np.maximum(np.maximum(a, b), c) - self._origin) / CELL).astype(np.int64)
        self._starts, self._members = _fill(low, high, self._shape)
        self._counts = (round(window[0] / spacing), round(window[1] / spacing))
        self._pitch = (window[0] / self._counts[0], window[1] / self._counts[1])
        self._reach = reach
        self._half = np.array([window[0] / 2, window[1] / 2])
        self._centre = mesh.bounds.mean(axis=0)
        gel_radius = float(np.hypot(*self._half)) + reach
        self._radius = mesh.diagonal / 2 + gel_radius

    def indentation(self, object_from_gel: FloatArray) -> FloatArray:
        """``(y, x)`` metres, how far each spring is pressed in; zero where it is not touched."""
        columns, rows = self._counts
        depth = np.zeros((rows, columns))
        if float(np.linalg.norm(object_from_gel[:3, 3] - self._centre)) < self._radius:
            low, high = self._box(object_from_gel)
            _rasterize(
                self._corners,
                self._starts,
                self._members,
                self._shape,
                low,
                high,
                np.ascontiguousarray(object_from_gel),
                self._pitch[0],
                self._pitch[1],
                self._reach,
                depth,
            )
        return depth

    def wrench(self, object_from_gel: FloatArray) -> FloatArray:
        """``(6,)`` N and N m that the object exerts on the gel, at the gel's origin, in gel."""
        pressure = BED_MODULUS * self.indentation(object_from_gel)
        area = self._pitch[0] * self._pitch[1]
        columns, rows = self._counts
        x = (np.arange(columns) + 0.5 - columns / 2) * self._pitch[0]
        y = (np.arange(rows) + 0.5 - rows / 2) * self._pitch[1]
        push = float(pressure.sum()) * area
        about_x = -float(pressure.sum(axis=1) @ y) * area
        about_y = float(pressure.sum(axis=0) @ x) * area
        return np.array([0.0, 0.0, -push, about_x, about_y, 0.0])

    def _box(self, object_from_gel: FloatArray) -> tuple[IntArray, IntArray]:
        """First and last box, in each direction, that the pressed part of the gel may share."""
        centre = object_from_gel[:3, :3] @ np.array([0.0, 0.0, -self._reach / 2]) + object_from_gel[:3, 3]
        half = np.abs(object_from_gel[:3, :3]) @ np.array([*self._half, self._reach / 2])
        low = np.floor((centre - half - self._origin) / CELL).astype(np.int64)
        high = np.floor((centre + half - self._origin) / CELL).astype(np.int64)
        return np.maximum(low, 0), np.minimum(high, self._shape - 1)


@compiled
def _fill(low: IntArray, high: IntArray, shape: IntArray) -> tuple[IntArray, IntArray]:
    boxes = shape[0] * shape[1] * shape[2]
    starts = np.zeros(boxes + 1, dtype=np.int64)
    for face in range(len(low)):
        for i in range(low[face, 0], high[face, 0] + 1):
            for j in range(low[face, 1], high[face, 1] + 1):
                for k in range(low[face, 2], high[face, 2] + 1):
                    starts[(i * shape[1] + j) * shape[2] + k + 1] += 1
    for box in range(boxes):
        starts[box + 1] += starts[box]
    members = np.empty(starts[boxes], dtype=np.int64)
    filled = starts[:-1].copy()
    for face in range(len(low)):
        for i in range(low[face, 0], high[face, 0] + 1):
            for j in range(low[face, 1], high[face, 1] + 1):
                for k in range(low[face, 2], high[face, 2] + 1):
                    box = (i * shape[1] + j) * shape[2] + k
                    members[filled[box]] = face
                    filled[box] += 1
    return starts, members


@compiled
def _rasterize(
    corners: FloatArray,
    starts: IntArray,
    members: IntArray,
    shape: IntArray,
    low: IntArray,
    high: IntArray,
    object_from_gel: FloatArray,
    pitch_x: float,
    pitch_y: float,
    reach: float,
    depth: FloatArray,
) -> None:
    """Deepest surface behind each spring's rest position, into ``depth``."""
    rotation, offset = object_from_gel[:3, :3], object_from_gel[:3, 3]
    rows, columns = depth.shape
    x, y, z = np.empty(3), np.empty(3), np.empty(3)
    for i in range(low[0], high[0] + 1):
        for j in range(low[1], high[1] + 1):
            for k in range(low[2], high[2] + 1):
                box = (i * shape[1] + j) * shape[2] + k
                for slot in range(starts[box], starts[box + 1]):
                    face = members[slot]
                    for corner in range(3):
                        dx = corners[face, corner, 0] - offset[0]
                        dy = corners[face, corner, 1] - offset[1]
                        dz = corners[face, corner, 2] - offset[2]
                        z[corner] = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
                        # In units of the grid, with spring (0, 0) at the origin.
                        x[corner] = (
                            rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
                        ) / pitch_x + (columns - 1) / 2
                        y[corner] = (
                            rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
                        ) / pitch_y + (rows - 1) / 2
                    if min(z[0], z[1], z[2]) >= 0.0 or max(z[0], z[1], z[2]) < -reach:
                        continue
                    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
                    if area >= 0.0:  # seen from behind, or edge on: the front is met first
                        continue
                    first = max(0, int(np.ceil(min(x[0], x[1], x[2]))))
                    last = min(columns - 1, int(np.floor(max(x[0], x[1], x[2]))))
                    top = max(0, int(np.ceil(min(y[0], y[1], y[2]))))
                    bottom = min(rows - 1, int(np.floor(max(y[0], y[1], y[2]))))
                    for row in range(top, bottom + 1):
                        for column in range(first, last + 1):
                            u = ((x[1] - column) * (y[2] - row) - (x[2] - column) * (y[1] - row)) / area
                            v = ((x[2] - column) * (y[0] - row) - (x[0] - column) * (y[2] - row)) / area
                            w = 1.0 - u - v
                            if u >= -1e-9 and v >= -1e-9 and w >= -1e-9:
                                pressed = -(u * z[0] + v * z[1] + w * z[2])
                                if pressed <= reach and pressed > depth[row, column]:
                                    depth[row, column] = pressed


STIFFNESS = 1.0e4
"""N/m of the stand of foam, the sensor's mount and the arm in a row; chosen, not measured."""

SPACING = 1.0e-3
"""Metres between the places of the face that are looked at: less than the edge of a cup is thick."""

REACH = 10.0e-3
"""Metres behind the face within which a surface is felt."""


class HousingContact:
    """The flat face of a sensor's housing, a gel's thickness behind the gel's own, against one mesh.

    Its sides are not looked at: on a straight way along the gel's axis nothing meets them first.
    """

    def __init__(self, mesh: Mesh, sensor: TactileSensor) -> None:
        self._face = GelContact(mesh, sensor.housing, SPACING, REACH)
        self._gel_from_face = translation(np.array([0.0, 0.0, -sensor.gel_thickness]))
        self._sides = sensor.housing

    def wrench(self, object_from_gel: FloatArray) -> FloatArray:
        """``(6,)`` N and N m that the object exerts on the face, at the gel's origin, in gel."""
        depth = self._face.indentation(object_from_gel @ self._gel_from_face)
        push = STIFFNESS * float(depth.max())
        if push == 0.0:
            return np.zeros(6)
        weights = depth / depth.sum()
        y, x = (
            side * ((np.arange(count) + 0.5) / count - 0.5)
            for side, count in zip(self._sides[::-1], depth.shape, strict=True)
        )
        at_x, at_y = float(weights.sum(axis=0) @ x), float(weights.sum(axis=1) @ y)
        return np.array([0.0, 0.0, -push, -at_y * push, at_x * push, 0.0])
