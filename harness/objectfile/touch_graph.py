"""The graph of an object's touch: a code of the surface around a place, seen from a pressed gel.

*The code.* Around each of many nodes of the surface, the heights over the tangent plane are a mean and a
linear basis times the node's code; beside them is how much of each pixel the surface covers, which says
where it ends to a part of a pixel. *The press in closed form.* Where the gel stands in the frame of the
node is a rigid motion; a pixel of the gel is a ray through those heights, and where it meets them is
found by looking up, moving along the ray to the height that was found, and looking up again. So tilt,
azimuth, yaw, depth and the way from the node to the contact cost the code nothing: it need not have
seen them. *The gel.* What reaches behind the gel's plane goes through the skirt of ``harness.sim.gel``,
to the operation.

Inputs: ``node`` int64 ``(n, 1)``, and ``node_from_gel`` float64 ``(n, 3, 4)``, the upper rows of a
rigid transform in metres. Output ``maps``: float32 ``(n, rows, columns)``, metres of indentation.
"""

from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper

from harness.arrays import AnyArray, BoolArray, ByteArray, FloatArray
from harness.errors import WrongUse
from harness.objectfile.graph import Nodes, Storage
from harness.objectfile.touch_skirt import hung
from harness.sensor import TactileSensor
from harness.sim.tactile_calibration import GelSkirt

LOOKUPS = 3
"""Along a ray. The error of a look-up shrinks by the surface's slope times the gel's lean, about a fifth."""

_LEAST_COSINE = 0.25
"""Between node and gel: what a rotation that is none may do to a division."""

_COVERED = 127.5
"""Of 255, from which a place counts as surface: the edge of a half-plane is then where it is."""

_COARSE = 4
"""Pixels a side to one ray of the first look-ups, which only say where the last one looks."""


@dataclass(frozen=True, eq=False)
class PatchCodes:
    """Heights around the nodes of a surface.

    Pixel (i, j) of a patch is the place x = (j + 0.5 - size / 2) pitch, y = (i + 0.5 - size / 2) pitch
    of the node's frame, whose z axis points into the object.

    Attributes:
        codes: ``(nodes, k)`` m.
        basis: ``(k, pixels)``, of the pixels inside; None where a code is the pixels themselves.
        mean: ``(pixels,)`` m, which is added.
        cover: ``(nodes, pixels)`` uint8, the share of a pixel that is surface in reach, times 255.
        inside: ``(size, size)``: the pixels that a code says something of.
        outside: m, the height of all others: out of any gel's reach.
        pitch: m.
    """

    codes: FloatArray
    basis: FloatArray | None
    mean: FloatArray
    cover: ByteArray
    inside: BoolArray
    outside: float
    pitch: float

    def heights(self, node: int) -> FloatArray:
        """``(size, size)`` m, as the graph takes them to be."""
        patch = np.full(self.inside.shape, self.outside)
        code = self.codes[node]
        patch[self.inside] = self.mean + (code if self.basis is None else code @ self.basis)
        return patch

    def covers(self, node: int) -> FloatArray:
        """``(size, size)`` of 0 to 255, as the graph takes them to be."""
        patch = np.zeros(self.inside.shape)
        patch[self.inside] = self.cover[node]
        return patch


def codes_graph(
    patches: PatchCodes,
    sensor: TactileSensor,
    skirt: GelSkirt,
    lookups: int = LOOKUPS,
    storage: Storage = "float16",
) -> ModelProto:
    """The graph of patches, a sensor and its gel.

    Args:
        patches: of the object.
        sensor: a flat gel; no press goes deeper than it is thick.
        skirt: of the gel, in its pixels.
        lookups: along each ray, 1 or more.
        storage: of codes and basis in the file; computed is in float32.

    Raises:
        WrongUse: arrays that do not fit together or are not finite, or a dome.
    """
    _check(patches, sensor, lookups)
    nodes = Nodes(storage)
    heights, covers = _patch(nodes, patches)
    size = len(patches.inside)
    half_width = 0.5 * size * patches.pitch
    moved = nodes.add("Transpose", nodes.add("Cast", "node_from_gel", to=TensorProto.FLOAT), perm=[0, 2, 1])
    scale = np.array([1.0 / half_width, 1.0 / half_width, 1.0], np.float32)
    motion = _Motion(nodes, nodes.add("Mul", moved, nodes.constant(scale)), sensor)
    coarse, half = coarseness(patches, sensor)
    along = None
    for _ in range(lookups - 1):
        along = motion.to_height(heights, along, coarse)
    near = None if along is None else motion.clipped(along)
    covered = motion.look_up(covers, None if near is None else motion.finer(near, coarse, half), half)
    along = motion.to_height(heights, None if near is None else motion.finer(near, coarse, 1), 1)
    reached = motion.where_covered(nodes.add("Neg", along), motion.finer(covered, half, 1))
    limits = [nodes.constant(np.array(value, np.float32)) for value in (0.0, sensor.gel_thickness)]
    deep = nodes.add("Clip", reached, *limits)
    nodes.add("Identity", hung(nodes, deep, sensor, skirt), name="maps")
    return nodes.model(
        "touch",
        [
            helper.make_tensor_value_info("node", TensorProto.INT64, ["n", 1]),
            helper.make_tensor_value_info("node_from_gel", TensorProto.DOUBLE, ["n", 3, 4]),
        ],
        [helper.make_tensor_value_info("maps", TensorProto.FLOAT, ["n", sensor.rows, sensor.columns])],
        "A node (n, 1) and the gel's pose in its frame (n, 3, 4), m, to indentation (n, rows, columns), m.",
    )


def _patch(nodes: Nodes, patches: PatchCodes) -> tuple[str, str]:
    """``(n, 1, size, size)``: heights of the asked nodes, and covers."""
    size = len(patches.inside)
    asked = nodes.add("Reshape", "node", _shape(nodes, -1))
    # In half precision what is below 60 um would be lost, were it metres.
    millimetres = patches.codes * 1e3
    if patches.basis is None:
        millimetres = np.hstack([millimetres, np.zeros((len(millimetres), 1))])
    code = nodes.add("Gather", nodes.weight(millimetres, "the codes"), asked, axis=0)
    # All pixels outside read one column behind the others: no code, and the height of outside.
    pixels = len(patches.mean)
    columns = np.full(patches.inside.shape, pixels)
    columns[patches.inside] = np.arange(pixels)
    index = nodes.constant(columns.ravel().astype(np.int64))
    if patches.basis is None:
        flat = nodes.add("Gather", code, index, axis=1)
    else:
        held = nodes.weight(np.hstack([patches.basis, np.zeros((len(patches.basis), 1))]), "the basis")
        flat = nodes.add("MatMul", code, nodes.add("Gather", held, index, axis=1))
    mean = np.append(patches.mean, patches.outside)[columns.ravel()].astype(np.float32)
    metres = nodes.add("Mul", flat, nodes.constant(np.array(1e-3, np.float32)))
    heights = nodes.add(
        "Reshape", nodes.add("Add", metres, nodes.constant(mean)), _shape(nodes, -1, 1, size, size)
    )
    none = np.zeros((len(patches.cover), 1), np.uint8)
    cover = nodes.add("Gather", nodes.constant(np.hstack([patches.cover, none])), asked, axis=0)
    spread = nodes.add("Cast", nodes.add("Gather", cover, index, axis=1), to=TensorProto.FLOAT)
    return heights, nodes.add("Reshape", spread, _shape(nodes, -1, 1, size, size))


def coarseness(patches: PatchCodes, sensor: TactileSensor) -> tuple[int, int]:
    """Pixels a side to one ray of the first look-ups, and of those of covers."""
    coarse = _COARSE if sensor.rows % _COARSE == 0 and sensor.columns % _COARSE == 0 else 1
    # A cover is linear between a patch's pixels: half the rays see all of it where they are closer.
    return coarse, 2 if coarse > 1 and 2.0 * sensor.pitch <= patches.pitch else 1


def ray_places(sensor: TactileSensor, coarse: int) -> tuple[AnyArray, AnyArray]:
    """Float32 x and y, m, of rays that are ``coarse`` pixels apart."""
    rows, columns, pitch = sensor.rows // coarse, sensor.columns // coarse, sensor.pitch * coarse
    x = (np.arange(columns) + 0.5 - columns / 2) * pitch
    y = (np.arange(rows) + 0.5 - rows / 2) * pitch
    return x.astype(np.float32), y.astype(np.float32)


class _Motion:
    """The rays of a gel's pixels through the heights of a node."""

    def __init__(self, nodes: Nodes, motion: str, sensor: TactileSensor) -> None:
        self._nodes, self._sensor = nodes, sensor
        self._rays: dict[int, str] = {}
        columns, height = self._cut(motion, 2, 0, 2), self._cut(motion, 2, 2, 3)
        self._across, self._height = columns, height
        self._drift = self._cut(columns, 1, 2, 3)
        least = nodes.constant(np.array(_LEAST_COSINE, np.float32))
        self._rise = nodes.add("Max", self._cut(height, 1, 2, 3), least)
        limits = (-sensor.gel_thickness, sensor.gel_thickness)
        self._limits = [nodes.constant(np.array(value, np.float32)) for value in limits]

    def to_height(self, heights: str, along: str | None, coarse: int) -> str:
        """``(n, rays, 1)`` m along the gel's z axis to the height under where ``along`` is."""
        nodes = self._nodes
        found = self.look_up(heights, None if along is None else self.clipped(along), coarse)
        plane = nodes.add("MatMul", self._spread(coarse), self._height)
        return nodes.add("Div", nodes.add("Sub", found, plane), self._rise)

    def look_up(self, image: str, near: str | None, coarse: int) -> str:
        """``(n, rays, 1)`` of an image of the node, where rays are ``near`` metres along the gel's z."""
        nodes, sensor = self._nodes, self._sensor
        where = nodes.add("MatMul", self._spread(coarse), self._across)
        if near is not None:
            where = nodes.add("Add", where, nodes.add("MatMul", near, self._drift))
        rows, columns = sensor.rows // coarse, sensor.columns // coarse
        grid = nodes.add("Reshape", where, _shape(nodes, -1, rows, columns, 2))
        found = nodes.add("GridSample", image, grid, mode="bilinear", padding_mode="border", align_corners=0)
        return nodes.add("Reshape", found, _shape(nodes, -1, rows * columns, 1))

    def clipped(self, along: str) -> str:
        """No farther from the gel's plane than the gel is thick; beyond is no touch, or too much."""
        return self._nodes.add("Clip", along, *self._limits)

    def where_covered(self, reached: str, covers: str) -> str:
        """``(n, rows, columns)`` m that the object reaches into the gel; 0 where there is no surface."""
        nodes, sensor = self._nodes, self._sensor
        # As images: comparing rays, whose last axis is 1 long, costs onnxruntime ten times as much.
        images = [
            nodes.add("Reshape", value, _shape(nodes, -1, sensor.rows, sensor.columns))
            for value in (reached, covers)
        ]
        covered = nodes.add("Greater", images[1], nodes.constant(np.array(_COVERED, np.float32)))
        return nodes.add("Where", covered, images[0], nodes.constant(np.array(0.0, np.float32)))

    def finer(self, value: str, coarse: int, fine: int) -> str:
        """``(n, rays, 1)`` of rays ``fine`` pixels apart, linear between those ``coarse`` pixels apart."""
        if coarse == fine:
            return value
        nodes, rows, columns = self._nodes, self._sensor.rows // fine, self._sensor.columns // fine
        step = coarse // fine
        image = nodes.add("Reshape", value, _shape(nodes, -1, rows // step, columns // step))
        tall = nodes.add("MatMul", nodes.constant(_between(rows, step)), image)
        wide = nodes.add("MatMul", tall, nodes.constant(_between(columns, step).T))
        return nodes.add("Reshape", wide, _shape(nodes, -1, rows * columns, 1))

    def _spread(self, coarse: int) -> str:
        """The rays' places, kept once in the file."""
        if coarse not in self._rays:
            self._rays[coarse] = self._nodes.constant(_rays(self._sensor, coarse))
        return self._rays[coarse]

    def _cut(self, value: str, axis: int, first: int, last: int) -> str:
        ends = [self._nodes.constant(np.array([number])) for number in (first, last, axis)]
        return self._nodes.add("Slice", value, *ends)


def _rays(sensor: TactileSensor, coarse: int) -> AnyArray:
    """``(rays, 4)`` float32: places of the gel's plane, homogeneous."""
    x, y = ray_places(sensor, coarse)
    places = np.zeros((len(y), len(x), 4), np.float32)
    places[:, :, 0], places[:, :, 1], places[:, :, 3] = x, y[:, None], 1.0
    return places.reshape(-1, 4)


def _between(size: int, coarse: int) -> AnyArray:
    """``(size, size / coarse)`` float32: linear between coarse pixels, constant beyond the outer ones."""
    count = size // coarse
    at = np.clip((np.arange(size) + 0.5) / coarse - 0.5, 0.0, count - 1.0)
    first = np.minimum(at.astype(np.int64), max(count - 2, 0))
    matrix = np.zeros((size, count), np.float32)
    matrix[np.arange(size), first] = 1.0 - (at - first)
    np.add.at(matrix, (np.arange(size), np.minimum(first + 1, count - 1)), at - first)
    return matrix


def _shape(nodes: Nodes, *sizes: int) -> str:
    return nodes.constant(np.array(sizes, np.int64))


def _check(patches: PatchCodes, sensor: TactileSensor, lookups: int) -> None:
    if sensor.gel_radius is not None:
        raise WrongUse(f"{sensor.name} has a dome; codes are seen through a flat gel only")
    if lookups < 1:
        raise WrongUse(f"{lookups} look-ups find nothing; say 1 or more")
    (count, width), size = patches.codes.shape, len(patches.inside)
    pixels = int(np.count_nonzero(patches.inside))
    basis = (pixels, pixels) if patches.basis is None else patches.basis.shape
    shapes = (basis, patches.mean.shape, patches.inside.shape)
    if count < 1 or shapes != ((width, pixels), (pixels,), (size, size)):
        raise WrongUse(f"codes {patches.codes.shape} with basis, mean and mask of shapes {shapes} do not fit")
    if patches.cover.shape != (count, pixels) or patches.cover.dtype != np.uint8:
        raise WrongUse(
            f"covers {patches.cover.dtype} {patches.cover.shape} are to be uint8 {(count, pixels)}"
        )
    if not (np.isfinite(patches.mean).all() and patches.pitch > 0.0):
        raise WrongUse("a mean of heights that is not finite, or a pitch that is not positive")
