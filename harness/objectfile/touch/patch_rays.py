"""The rays of a gel's pixels through the heights of a node, within the graph of codes."""

import numpy as np

from harness.basics.arrays import AnyArray
from harness.bench.sensor import TactileSensor
from harness.objectfile.graph import Nodes

_LEAST_COSINE = 0.25
"""Between node and gel: what a rotation that is none may do to a division."""

_COVERED = 127.5
"""Of 255, from which a place counts as surface: the edge of a half-plane is then where it is."""


class PatchRays:
    """The rays of a gel's pixels through the heights of a node."""

    def __init__(self, nodes: Nodes, motion: str, sensor: TactileSensor, outside: float) -> None:
        self._nodes, self._sensor = nodes, sensor
        self._names: dict[tuple[str, int], str] = {}
        columns, height = self._cut(motion, 2, 0, 2), self._cut(motion, 2, 2, 3)
        # Heights are counted from the height outside, and so are those of the gel's plane.
        over = np.array([[0.0], [0.0], [0.0], [outside]], np.float32)
        self._across, self._height = columns, nodes.add("Sub", height, nodes.constant(over))
        self._drift = self._cut(columns, 1, 2, 3)
        least = nodes.constant(np.array(_LEAST_COSINE, np.float32))
        self._rise = nodes.add("Max", self._cut(height, 1, 2, 3), least)
        limits = (-sensor.gel_thickness, sensor.gel_thickness)
        self._limits = [nodes.constant(np.array(value, np.float32)) for value in limits]

    def to_height(self, heights: str, near: str | None, coarse: int, fine: int) -> str:
        """``(n, rows, columns)`` m along the gel's z axis to the height under the rays, as ``look_up``."""
        nodes = self._nodes
        found = self.look_up(heights, near, coarse, fine)
        plane = nodes.add("MatMul", self._rows(fine), self._line(self._height, fine))
        return nodes.add("Div", nodes.add("Sub", found, plane), self._rise)

    def look_up(self, image: str, near: str | None, coarse: int, fine: int) -> str:
        """``(n, rows, columns)`` of an image of the node, of rays that are ``fine`` pixels apart.

        They are ``near`` metres along the gel's z, ``(n, rows, columns)`` of rays ``coarse`` pixels apart and
        linear between them; in the gel's plane if None.
        """
        nodes, sensor = self._nodes, self._sensor
        rows, columns = sensor.rows // fine, sensor.columns // fine
        grid = nodes.add("Reshape", self._places(near, coarse, fine), shape_of(nodes, -1, rows, columns, 2))
        found = nodes.add("GridSample", image, grid, mode="bilinear", padding_mode="zeros", align_corners=0)
        return nodes.add("Reshape", found, shape_of(nodes, -1, rows, columns))

    def _places(self, near: str | None, coarse: int, fine: int) -> str:
        """``(n, rows, 2 columns)``: where the rays are in the patch, x and y in turn.

        A place is a sum of what its row says, what its column says and the way along the ray, so that all are
        found by products with a few columns: one for each ray takes onnxruntime five times as long.
        """
        nodes, sensor = self._nodes, self._sensor
        line = self._line(self._across, fine)
        if near is None:
            return nodes.add("MatMul", self._rows(fine), line)
        rows, columns, step = sensor.rows // coarse, sensor.columns // coarse, coarse // fine
        shift = nodes.add("MatMul", nodes.add("Reshape", near, shape_of(nodes, 0, -1, 1)), self._drift)
        shift = nodes.add("Reshape", shift, shape_of(nodes, -1, rows, 2 * columns))
        if step == 1:
            return nodes.add("Add", nodes.add("MatMul", self._rows(fine), line), shift)
        wide = np.kron(between(columns * step, step).T, np.eye(2, dtype=np.float32))
        shift = nodes.add("MatMul", shift, nodes.constant(wide))
        tall = np.hstack([between(rows * step, step), row_terms(sensor, fine)])
        return nodes.add("MatMul", nodes.constant(tall), nodes.add("Concat", shift, line, axis=1))

    def clipped(self, along: str) -> str:
        """No farther from the gel's plane than the gel is thick; beyond is no touch, or too much."""
        return self._nodes.add("Clip", along, *self._limits)

    def where_covered(self, reached: str, covers: str) -> str:
        """``(n, rows, columns)`` m that the object reaches into the gel; 0 where there is no surface."""
        nodes = self._nodes
        return nodes.add("Where", self.covered(covers), reached, nodes.constant(np.array(0.0, np.float32)))

    def covered(self, covers: str) -> str:
        """Whether there is surface, ``(n, rows, columns)``."""
        return self._nodes.add("Greater", covers, self._nodes.constant(np.array(_COVERED, np.float32)))

    def finer(self, image: str, coarse: int) -> str:
        """``(n, rows, columns)`` of the pixels, linear between rays that are ``coarse`` pixels apart."""
        if coarse == 1:
            return image
        nodes, sensor = self._nodes, self._sensor
        tall = nodes.add("MatMul", nodes.constant(between(sensor.rows, coarse)), image)
        return nodes.add("MatMul", tall, nodes.constant(between(sensor.columns, coarse).T))

    def _line(self, motion: str, fine: int) -> str:
        """``(n, 2, columns k)`` of a motion to k numbers, ``(n, 4, k)``.

        What a place's column says of it, in which x and 1 count, and the step along y: a row's terms times
        these are the motion of all its places.
        """
        x = ray_places(self._sensor, fine)[0]
        terms = np.zeros((2, len(x), 4), np.float32)
        terms[0, :, 0], terms[0, :, 3], terms[1, :, 1] = x, 1.0, 1.0
        line = self._nodes.add("MatMul", self._kept(("columns", fine), terms.reshape(-1, 4)), motion)
        return self._nodes.add("Reshape", line, shape_of(self._nodes, 0, 2, -1))

    def _rows(self, fine: int) -> str:
        return self._kept(("rows", fine), row_terms(self._sensor, fine))

    def _kept(self, name: tuple[str, int], value: AnyArray) -> str:
        """The constant of that name, once in the file."""
        if name not in self._names:
            self._names[name] = self._nodes.constant(value)
        return self._names[name]

    def _cut(self, value: str, axis: int, first: int, last: int) -> str:
        ends = [self._nodes.constant(np.array([number])) for number in (first, last, axis)]
        return self._nodes.add("Slice", value, *ends)


def shape_of(nodes: Nodes, *sizes: int) -> str:
    """A constant that a value is reshaped by: 0 keeps a size, and one -1 is what is left."""
    return nodes.constant(np.array(sizes, np.int64))


def ray_places(sensor: TactileSensor, coarse: int) -> tuple[AnyArray, AnyArray]:
    """Float32 x and y, m, of rays that are ``coarse`` pixels apart."""
    rows, columns, pitch = sensor.rows // coarse, sensor.columns // coarse, sensor.pitch * coarse
    x = (np.arange(columns) + 0.5 - columns / 2) * pitch
    y = (np.arange(rows) + 0.5 - rows / 2) * pitch
    return x.astype(np.float32), y.astype(np.float32)


def row_terms(sensor: TactileSensor, fine: int) -> AnyArray:
    """``(rows, 2)`` float32: one, and y in m."""
    y = ray_places(sensor, fine)[1]
    return np.stack([np.ones_like(y), y], axis=1)


def between(size: int, coarse: int) -> AnyArray:
    """``(size, size / coarse)`` float32: linear between coarse pixels, constant beyond the outer ones."""
    count = size // coarse
    at = np.clip((np.arange(size) + 0.5) / coarse - 0.5, 0.0, count - 1.0)
    first = np.minimum(at.astype(np.int64), max(count - 2, 0))
    matrix = np.zeros((size, count), np.float32)
    matrix[np.arange(size), first] = 1.0 - (at - first)
    np.add.at(matrix, (np.arange(size), np.minimum(first + 1, count - 1)), at - first)
    return matrix
