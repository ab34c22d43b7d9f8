"""A graph of codes as machine code: the same numbers, read out of the graph, in loops made for them.

onnxruntime spends most of a map on look-ups that know nothing of each other. Who holds the graph to be one
of ``touch_graph.codes_graph`` need not believe it: the graph is built again from what was read, and only
one that is the same to the byte is computed here. Any other runs as it is.
"""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np
from onnx import ModelProto, numpy_helper

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused, WrongUse
from harness.bench.sensor import TactileSensor
from harness.objectfile.entries import NetworkEntry
from harness.objectfile.graph_check import checked_graph, require_declared
from harness.objectfile.touch.graph import LOOKUPS, PatchCodes, coarseness, codes_graph
from harness.objectfile.touch.kernels import press
from harness.objectfile.touch.rays import ray_places
from harness.sim.gel.gel import GelSkirt, half_kernel

_CODES, _COLUMNS, _MEAN, _COVER, _SCALE = "c1", "c2", "c4", "c7", "c9"
"""Names of constants, as ``codes_graph`` counts them."""


class CompiledCodes:
    """Codes, ready to be pressed.

    Args:
        patches: read from a graph; without a basis.
        sensor: a flat gel.
        skirt: of the gel.
        threads: that a batch may use.
    """

    def __init__(self, patches: PatchCodes, sensor: TactileSensor, skirt: GelSkirt, threads: int = 1) -> None:
        self.sensor, self.threads = sensor, threads
        # A ring of nothing about a patch: what lies farther out is as far from the gel as all outside is.
        inside, count = np.pad(patches.inside, 1).ravel(), len(patches.codes)
        self._outside = np.float32(patches.outside)
        self._heights = np.zeros((count, inside.size), np.float32)
        # As the graph: half precision's millimetres to float32's metres.
        millimetres = (patches.codes * 1e3).astype(np.float16)
        above = patches.mean.astype(np.float32) - self._outside
        self._heights[:, inside] = millimetres * np.float32(1e-3) + above
        self._covers = np.zeros(self._heights.shape, np.uint8)
        self._covers[:, inside] = patches.cover
        half = 0.5 * len(patches.inside) * patches.pitch
        self._scale = np.array([1.0 / half, 1.0 / half, 1.0], np.float32)
        self._grids = tuple((step, *ray_places(sensor, step)) for step in (*coarseness(patches, sensor), 1))
        widths = (*skirt.kernels, skirt.final)
        self._halves = tuple(half_kernel(width).astype(np.float32) for width in widths)
        self._core = np.float32(skirt.core)

    def __call__(self, inputs: Mapping[str, AnyArray]) -> dict[str, AnyArray]:
        """``maps``, float32, of ``node`` and ``node_from_gel``: as the graph.

        Raises:
            DataRefused: a node that the graph has no code of.
        """
        nodes = np.ascontiguousarray(inputs["node"].ravel())
        if len(nodes) and not 0 <= nodes.min() <= nodes.max() < len(self._heights):
            raise DataRefused(
                f"codes of nodes {nodes.min()} to {nodes.max()} were asked of {len(self._heights)} codes, "
                "counted from 0; they were not built together, build the object again"
            )
        motions = np.swapaxes(inputs["node_from_gel"].astype(np.float32), 1, 2) * self._scale
        motions[:, 3, 2] -= self._outside
        maps = np.empty((len(nodes), self.sensor.rows, self.sensor.columns), np.float32)
        parts = np.array_split(np.arange(len(nodes)), max(1, min(self.threads, len(nodes))))
        if len(parts) == 1:
            self._press(nodes, motions, maps)
            return {"maps": maps}
        done = [
            self._pool.submit(self._press, nodes[part], motions[part], maps[part[0] : part[-1] + 1])
            for part in parts
        ]
        for each in done:
            each.result()
        return {"maps": maps}

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self.threads, "codes")

    def _press(self, nodes: AnyArray, motions: AnyArray, maps: AnyArray) -> None:
        thickness, moved = np.float32(self.sensor.gel_thickness), np.ascontiguousarray(motions)
        grids, halves, core = self._grids, self._halves, self._core
        press(self._heights, self._covers, nodes, moved, grids, LOOKUPS, thickness, halves, core, maps)


def compiled_codes(
    data: bytes, entry: NetworkEntry, sensor: TactileSensor, skirt: GelSkirt, threads: int = 1
) -> CompiledCodes | None:
    """The codes of a graph; None if it is not what ``codes_graph`` makes of them.

    Args:
        data: of the graph's file.
        entry: what ``object.json`` says of it.
        sensor: that it was made for.
        skirt: of its gel.
        threads: that a batch may use.

    Raises:
        DataRefused: it is no graph, one that must not be run, or not the one described.
    """
    model = checked_graph(data, entry.file)
    require_declared(model, (*entry.inputs, *entry.outputs), entry.file)
    patches = _patches(model)
    if patches is None:
        return None
    try:
        again = codes_graph(patches, sensor, skirt)
    except WrongUse:
        return None
    if again.SerializeToString(deterministic=True) != data:
        return None
    return CompiledCodes(patches, sensor, skirt, threads)


def _patches(model: ModelProto) -> PatchCodes | None:
    """What the constants of a graph would be; None if they do not fit together, or are of a basis."""
    held = {tensor.name: numpy_helper.to_array(tensor) for tensor in model.graph.initializer}
    if any(name not in held for name in (_CODES, _COLUMNS, _MEAN, _COVER, _SCALE)):
        return None
    codes, columns, mean, cover = (held[name] for name in (_CODES, _COLUMNS, _MEAN, _COVER))
    size, pixels = int(np.sqrt(columns.size)), codes.shape[-1] - 1
    shapes = (codes.ndim, columns.size, mean.shape, cover.shape, held[_SCALE].shape)
    if shapes != (2, size**2, (size**2,), codes.shape, (3,)) or cover.dtype != np.uint8 or pixels < 1:
        return None
    inside = (columns < pixels).reshape(size, size)
    if np.count_nonzero(inside) != pixels or inside.all():
        return None
    flat = inside.ravel()
    return PatchCodes(
        codes[:, :-1].astype(np.float64) / 1e3,
        None,
        mean[flat].astype(np.float64),
        np.ascontiguousarray(cover[:, :-1]),
        inside,
        float(mean[~flat][0]),
        2.0 / (size * float(held[_SCALE][0])),
    )
