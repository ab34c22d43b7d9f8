"""The graph of an object's touch: a code of the surface around a place, seen from a pressed gel.

*The code.* Around each of many nodes of the surface, the heights over the tangent plane are a mean and the
node's code; beside them is how much of each pixel the surface covers, which says where it ends to a part of a
pixel. *The press in closed form.* Where the gel stands in the frame of the
node is a rigid motion; a pixel of the gel is a ray through those heights, and where it meets them is
found by looking up, moving along the ray to the height that was found, and looking up again. So tilt,
azimuth, yaw, depth and the way from the node to the contact cost the code nothing: it need not have
seen them. *The gel.* What reaches behind the gel's plane goes through the skirt of ``harness.sim.gel.gel``,
to the operation.

Inputs: ``node`` int64 ``(n, 1)``, and ``node_from_gel`` float64 ``(n, 3, 4)``, the upper rows of a
rigid transform in metres. Outputs: ``maps`` float32 ``(n, rows, columns)``, metres of indentation; and
``gaps`` float32, metres along the gel's z axis from its plane to the object, of every ``ray_pixels``-th
pixel each way, ``SEARCH_DEPTH`` where nothing is that near.
"""

from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper

from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.bench.sensor import TactileSensor
from harness.objectfile.graph import Nodes, Storage
from harness.objectfile.touch.patch_rays import PatchRays, shape_of
from harness.objectfile.touch_entries import ray_pixels
from harness.sim.gel.gel import GelSkirt, half_kernel
from harness.sim.gel.height_map import SEARCH_DEPTH

_LOOKUPS = 3
"""Along a ray. The error of a look-up shrinks by the surface's slope times the gel's lean, about a fifth."""

_BEYOND = 1
"""More of them for ``gaps``, which go on where the gel ends."""

MOST_TILT = float(np.radians(26.0))
"""rad between tool and surface that codes answer: a candidate that leans more than a press may is to be seen
to fit badly, and not to be missing."""


@dataclass(frozen=True, eq=False)
class PatchCodes:
    """Heights around the nodes of a surface.

    Pixel (i, j) of a patch is the place x = (j + 0.5 - size / 2) pitch, y = (i + 0.5 - size / 2) pitch
    of the node's frame, whose z axis points into the object.
    """

    codes: FloatArray  #: ``(nodes, pixels)`` m, of the pixels inside.
    mean: FloatArray  #: ``(pixels,)`` m, which is added.
    cover: ByteArray  #: ``(nodes, pixels)`` uint8, the share of a pixel that is surface in reach, times 255.
    inside: BoolArray  #: ``(size, size)``: the pixels that a code says something of.
    outside: float  #: m, the height of all others: out of any gel's reach.
    pitch: float  #: m.

    def heights(self, node: int) -> FloatArray:
        """``(size, size)`` m, as the graph takes them to be."""
        patch = np.full(self.inside.shape, self.outside)
        patch[self.inside] = self.mean + self.codes[node]
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
    lookups: int = _LOOKUPS,
    storage: Storage = "float16",
) -> ModelProto:
    """The graph of patches, a sensor and its gel.

    Args:
        patches: of the object.
        sensor: a flat gel; no press goes deeper than it is thick.
        skirt: of the gel, in its pixels.
        lookups: along each ray, 1 or more.
        storage: of codes in the file; computed is in float32.

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
    motion = PatchRays(nodes, nodes.add("Mul", moved, nodes.constant(scale)), sensor, patches.outside)
    # Pixels a side to one ray of the first look-ups, and of those of covers. A cover is linear between a
    # patch's pixels: half the rays see all of it where they are closer.
    coarse = ray_pixels(sensor.rows, sensor.columns)
    half = 2 if coarse > 1 and 2.0 * sensor.pitch <= patches.pitch else 1
    near: str | None = None
    for _ in range(lookups - 1):
        near = motion.clipped(motion.to_height(heights, near, coarse, coarse))
    covered = motion.finer(motion.look_up(covers, near, coarse, half), half)
    along = motion.to_height(heights, near, coarse, 1)
    reached = motion.where_covered(nodes.add("Neg", along), covered)
    limits = [nodes.constant(np.array(value, np.float32)) for value in (0.0, sensor.gel_thickness)]
    deep = nodes.add("Clip", reached, *limits)
    nodes.add("Identity", add_border(nodes, deep, sensor, skirt), name="maps")
    # The output ``gaps`` is of the coarse rays, which are followed beyond the gel's reach.
    for _ in range(_BEYOND):
        near = motion.to_height(heights, near, coarse, coarse)
    assert near is not None
    far = nodes.constant(np.array(SEARCH_DEPTH, np.float32))
    found = motion.covered(motion.look_up(covers, near, coarse, coarse))
    nodes.add("Min", nodes.add("Where", found, near, far), far, name="gaps")
    return nodes.model(
        "touch",
        [
            helper.make_tensor_value_info("node", TensorProto.INT64, ["n", 1]),
            helper.make_tensor_value_info("node_from_gel", TensorProto.DOUBLE, ["n", 3, 4]),
        ],
        [
            helper.make_tensor_value_info("maps", TensorProto.FLOAT, ["n", sensor.rows, sensor.columns]),
            helper.make_tensor_value_info(
                "gaps", TensorProto.FLOAT, ["n", sensor.rows // coarse, sensor.columns // coarse]
            ),
        ],
        "A node (n, 1) and the gel's pose in its frame (n, 3, 4), m, to indentation (n, rows, columns), m, "
        "and to the gap between gel and object, m, of coarser rays.",
    )


def _patch(nodes: Nodes, patches: PatchCodes) -> tuple[str, str]:
    """``(n, 1, size, size)``: heights of the asked nodes over that of all that lies outside, and covers."""
    size = len(patches.inside)
    asked = nodes.add("Reshape", "node", shape_of(nodes, -1))
    # In half precision what is below 60 um would be lost, were it metres.
    millimetres = np.hstack([patches.codes * 1e3, np.zeros((len(patches.codes), 1))])
    code = nodes.add("Gather", nodes.weight(millimetres, "the codes"), asked, axis=0)
    # All pixels outside read one column behind the others: no code, and the height of outside.
    pixels = len(patches.mean)
    columns = np.full(patches.inside.shape, pixels)
    columns[patches.inside] = np.arange(pixels)
    index = nodes.constant(columns.ravel().astype(np.int64))
    flat = _columns(nodes, code, index)
    mean = np.append(patches.mean, patches.outside)[columns.ravel()].astype(np.float32)
    metres = nodes.add("Mul", flat, nodes.constant(np.array(1e-3, np.float32)))
    above = nodes.add("Sub", nodes.constant(mean), nodes.constant(np.array(patches.outside, np.float32)))
    heights = nodes.add("Reshape", nodes.add("Add", metres, above), shape_of(nodes, -1, 1, size, size))
    none = np.zeros((len(patches.cover), 1), np.uint8)
    cover = nodes.add("Gather", nodes.constant(np.hstack([patches.cover, none])), asked, axis=0)
    spread = nodes.add("Cast", _columns(nodes, cover, index), to=TensorProto.FLOAT)
    return heights, nodes.add("Reshape", spread, shape_of(nodes, -1, 1, size, size))


def _columns(nodes: Nodes, rows: str, index: str) -> str:
    """``(n, m)`` columns of ``(n, k)``, taken as rows of the transpose, which is thrice as fast."""
    taken = nodes.add("Gather", nodes.add("Transpose", rows, perm=[1, 0]), index, axis=0)
    return nodes.add("Transpose", taken, perm=[1, 0])


def _check(patches: PatchCodes, sensor: TactileSensor, lookups: int) -> None:
    if sensor.gel_radius is not None:
        raise WrongUse(f"{sensor.name} has a dome; codes are seen through a flat gel only")
    if lookups < 1:
        raise WrongUse(f"{lookups} look-ups find nothing; say 1 or more")
    count, size = len(patches.codes), len(patches.inside)
    pixels = int(np.count_nonzero(patches.inside))
    shapes = (patches.codes.shape, patches.mean.shape, patches.inside.shape)
    if count < 1 or shapes != ((count, pixels), (pixels,), (size, size)):
        raise WrongUse(f"codes, mean and mask of shapes {shapes} do not fit")
    if patches.cover.shape != (count, pixels) or patches.cover.dtype != np.uint8:
        raise WrongUse(
            f"covers {patches.cover.dtype} {patches.cover.shape} are to be uint8 {(count, pixels)}"
        )
    if not (np.isfinite(patches.mean).all() and patches.pitch > 0.0):
        raise WrongUse("a mean of heights that is not finite, or a pitch that is not positive")


def add_border(nodes: Nodes, deep: str, sensor: TactileSensor, skirt: GelSkirt) -> str:
    """Add the contact border (``harness.sim.gel.gel.deform``) to ``(n, rows, columns)`` m of penetration.

    Each blur is a product with a banded matrix.
    """
    deepest = nodes.add("ReduceMax", deep, axes=[1, 2], keepdims=1)
    core = nodes.add("Mul", deepest, nodes.constant(np.array(skirt.core, np.float32)))
    kept = nodes.add("Greater", deep, core)
    widths = sorted({*skirt.kernels, skirt.final} - {1})
    blurs = {}
    for width in widths:
        down, along = blur_matrix(sensor.rows, width), blur_matrix(sensor.columns, width)
        blurs[width] = nodes.constant(down), nodes.constant(along.T)

    def blurred(image: str, width: int) -> str:
        down, along = blurs[width]
        return nodes.add("MatMul", nodes.add("MatMul", down, image), along)

    surface = deep
    for width in skirt.kernels:
        surface = nodes.add("Where", kept, deep, blurred(surface, width) if width > 1 else surface)
    return blurred(surface, skirt.final) if skirt.final > 1 else surface


def blur_matrix(size: int, width: int) -> AnyArray:
    """``(size, size)`` float32: one direction of ``gel_kernels.blur``, which mirrors at the border."""
    half = half_kernel(width)
    matrix = np.zeros((size, size))
    for k in range(1 - len(half), len(half)):
        at = np.abs(np.arange(size) + k) % max(2 * (size - 1), 1)
        mirrored = np.where(at < size, at, 2 * (size - 1) - at)
        np.add.at(matrix, (np.arange(size), mirrored), half[abs(k)])
    return matrix.astype(np.float32)
