"""Pictures of an imported look: cameras, and raw colour and density of one network (OSF) or one a cell.

A camera looks at the origin of the vision frame, z is up in the picture as far as the view allows. In the
camera x is right, y up and the view is along -z; a ray's direction has the length at which its depth along
the axis is 1.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.entries import PublishedCellsEntry, PublishedObject, PublishedVisionEntry
from harness.objectfile.published.query import query
from harness.objectfile.published.volume_render import render_rays, stretched_sigmoid
from harness.objectfile.runtime import Network
from harness.objectfile.vision.graph import sort_into_blocks
from harness.objectfile.vision_tensors import graph_input
from harness.picture.pinhole import unit_vector

COMPAT_DISTANCE = 2.5
"""Distance from the origin of every camera that the published networks were trained by."""

FOCAL = 355.5555419921875
"""Focal length in pixels of a 256 x 256 image."""

SIZE = 256

_OFF = 1e-3
"""Relative error of a distance or of the length of a direction; query files are rounded to a few digits."""

_BLOCKS = 256
"""Blocks in one run of cells: their weights are gathered for it, 20 MB of them."""

_RIM = 1e-3
"""Distance from the cube's faces within which nothing is taken to be."""


@dataclass(frozen=True, eq=False)
class PublishedView:
    """A camera and a light."""

    eye: FloatArray  #: ``(3,)``, in the vision frame.
    rotation: FloatArray  #: ``(3, 3)``: vision from camera.
    light: FloatArray  #: ``(3,)`` as the network takes it.

    def directions(self, size: int, offset: float) -> FloatArray:
        """Compute the ``(size * size, 3)`` directions of the rays, row by row.

        Args:
            size: pixels a side.
            offset: pixels from a pixel's upper left corner, right and down.
        """
        x, y = np.meshgrid(np.arange(size) + offset, np.arange(size) + offset)
        scale = SIZE / (FOCAL * size)
        in_camera = np.stack(
            [(x - 0.5 * size) * scale, (0.5 * size - y) * scale, np.full_like(x, -1.0)], axis=-1
        )
        directions: FloatArray = in_camera.reshape(-1, 3) @ self.rotation.T
        return directions


def views_of(rows: FloatArray, reach: float, compat: bool) -> list[PublishedView]:
    """Return the views of a query file.

    Args:
        rows: ``(n, 6)``: camera and light.
        reach: distance of the object from the origin; a camera must be outside of it.
        compat: whether the camera must be where the published program assumes it, and the light have the
            length that it was trained with; else any distance and length will do.

    Raises:
        OutOfDomain: naming the row.
    """
    views = []
    for number, (eye, light) in enumerate(zip(rows[:, :3], rows[:, 3:], strict=True)):
        distance, length = float(np.linalg.norm(eye)), float(np.linalg.norm(light))
        if compat and abs(distance - COMPAT_DISTANCE) > _OFF * COMPAT_DISTANCE:
            raise OutOfDomain(
                f"camera {number} is {distance:.6g} from the origin, and the published program takes every "
                f"one to be at {COMPAT_DISTANCE}: it would aim elsewhere; move it, or leave "
                "--objectfolder-compat out"
            )
        if not distance > reach:
            raise OutOfDomain(
                f"camera {number} is {distance:.6g} from the origin, within the object's {reach:g}; move it "
                "out"
            )
        towards = unit_vector(light, f"light {number}")
        if compat and abs(length - 1.0) > _OFF:
            raise OutOfDomain(
                f"light {number} has the length {length:.6g}, and the network was trained with 1; divide it "
                "by that"
            )
        # First about x by the polar angle, then about z by the azimuth.
        cosine = float(eye[2]) / (COMPAT_DISTANCE if compat else distance)
        polar, azimuth = math.acos(max(-1.0, min(1.0, cosine))), math.atan2(float(eye[0]), -float(eye[1]))
        c, s = math.cos(polar), math.sin(polar)
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        c, s = math.cos(azimuth), math.sin(azimuth)
        about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        views.append(PublishedView(eye, about_z @ about_x, light if compat else towards))
    return views


def osf_tensors(reach: float) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """Describe the inputs and outputs of one network whose points lie within ``reach`` of the origin."""
    within, unit = Domain(low=(-reach,) * 3, high=(reach,) * 3), Domain(low=(-1.0,) * 3, high=(1.0,) * 3)
    light = "as trained: unit, the light's direction"
    inputs = (
        graph_input("points", "float64", ("n", 3), "1", "where", within, "vision"),
        graph_input("views", "float32", ("n", 3), "1", "unit, from the camera", unit, "vision"),
        graph_input("light", "float32", ("n", 3), "1", light, unit, "vision"),
    )
    return inputs, raw_look_tensors(("n",))


def raw_look_tensors(rows: tuple[int | Literal["n"], ...]) -> tuple[Tensor, ...]:
    """Describe raw colour and density, whose shapes begin with ``rows``."""
    meanings = (
        ("colour_raw", 3, "red green blue before the sigmoid"),
        ("density_raw", 1, "density before it is cut off at zero"),
    )
    return tuple(
        Tensor(name=name, dtype="float32", shape=(*rows, size), unit="1", meaning=meaning)
        for name, size, meaning in meanings
    )


RawField = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""Function from ``(n, 3)`` points in the vision frame, ``(n, 3)`` unit view directions from the camera and
the ``(3,)`` unit light direction to ``(n, 4)`` raw red, green, blue and density; zeros in empty space."""


def osf_field(network: Network) -> RawField:
    """Return the radiance field of a single network for all points."""

    def raw(points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        lights = np.broadcast_to(light, points.shape)
        return _joined(query(network, {"points": points, "views": views, "light": lights}))

    return raw


@dataclass(frozen=True, eq=False)
class CellNetworks:
    """One network for each cell (KiloOSF)."""

    entry: PublishedCellsEntry  #: description of the cells.
    network: Network  #: all cells' networks in one graph, queried in blocks.
    networks: IntArray  #: ``(cells,)`` number of each cell's network, -1 for none.
    occupied: BoolArray | None  #: ``(voxels,)``; None if all of the cube counts as occupied.

    @classmethod
    def open(cls, of: PublishedObject, cells: PublishedCellsEntry, network: Network) -> "CellNetworks":
        """Read the network of each cell and the occupancy; ``DataRefused`` for damaged files."""
        count, file = math.prod(cells.cells), cells.networks
        networks = npy_array(of.read(file), file.file, "<i4", (count,), f"the networks of {count} cells")
        last = (network.inputs[0].domain.high or (0.0,))[0]
        if networks.min() < -1 or networks.max() > last:
            raise DataRefused(
                f"{file.file} names network {networks.max()} of {last + 1:g} from 0 on; import it again"
            )
        occupied = None
        if cells.occupancy is not None and cells.voxels is not None:
            data, voxels = of.read(cells.occupancy), math.prod(cells.voxels)
            if len(data) != -(-voxels // 8):
                raise DataRefused(
                    f"{cells.occupancy.file} has {len(data)} bytes for {voxels} voxels; import it again"
                )
            occupied = np.unpackbits(np.frombuffer(data, np.uint8), count=voxels).astype(np.bool_)
        return cls(cells, network, networks.astype(np.int64), occupied)

    def raw(self, points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        """Compute raw colour and density; see ``RawField``."""
        result, networks = np.zeros((len(points), 4)), int(self.networks.max()) + 1
        chosen, rows = sort_into_blocks(self.network_at(points), networks, self.entry.block)
        inputs = {
            "network": rows[:, None],
            "points": points[chosen],
            "views": views[chosen],
            "light": np.broadcast_to(light, (len(rows), 3)),
        }
        result[chosen] = _joined(query(self.network, inputs, _BLOCKS))
        return result

    def network_at(self, points: FloatArray) -> IntArray:
        """Look up the network of each point; ``(n,)``, -1 where nothing is."""
        low, high = np.array(self.entry.low), np.array(self.entry.high)
        inside = ((points > low + _RIM) & (points < high - _RIM)).all(axis=1)
        which = np.full(len(points), -1)
        fraction = (points[inside] - low) / (high - low)
        numbers = self.networks[_flat_index(fraction, self.entry.cells)]
        if self.occupied is not None and self.entry.voxels is not None:
            numbers = np.where(self.occupied[_flat_index(fraction, self.entry.voxels)], numbers, -1)
        which[inside] = numbers
        return which


def _flat_index(fraction: FloatArray, sizes: tuple[int, int, int]) -> IntArray:
    """Return the index, x slowest, of the box that contains each of ``(n, 3)`` fractions of the cube."""
    most = np.array(sizes)
    i, j, k = np.clip((fraction * most).astype(np.int64), 0, most - 1).T
    index: IntArray = (i * sizes[1] + j) * sizes[2] + k
    return index


def _joined(outputs: dict[str, FloatArray]) -> FloatArray:
    return np.concatenate([outputs["colour_raw"], outputs["density_raw"]], axis=-1)


@dataclass(frozen=True, eq=False)
class PublishedLook:
    """The networks of an imported look."""

    entry: PublishedVisionEntry  #: description of the look, with how rays are sampled.
    coarse: RawField  #: the only network, or that of the first samples.
    fine: RawField | None = None  #: network of all samples; None if there are no further ones.

    @classmethod
    def open(cls, of: PublishedObject, entry: PublishedVisionEntry) -> "PublishedLook":
        """Open the networks; ``DataRefused`` if a file is not the one described."""
        network = of.network(entry.network)
        if entry.cells is not None:
            return cls(entry, CellNetworks.open(of, entry.cells, network).raw)
        fine = None if entry.fine is None else osf_field(of.network(entry.fine))
        return cls(entry, osf_field(network), fine)

    def picture(self, view: PublishedView, size: int, offset: float) -> FloatArray:
        """Render ``(size, size, 3)`` colours, of which 0 is black and 1 white; some may be outside of that.

        Args:
            view: camera and light.
            size: pixels a side.
            offset: pixels from the corner of a pixel to its ray: 0 as published, 0.5 for its centre.
        """
        entry = self.entry

        def shown(
            raw_field: RawField, points: FloatArray, views: FloatArray
        ) -> tuple[FloatArray, FloatArray]:
            raw = raw_field(points, views, view.light)
            if entry.colour == "clipped":
                return raw[:, 3], 1.2 * (np.clip(raw[:, :3], 0.0, 1.0) - 0.5) + 0.5
            return raw[:, 3], stretched_sigmoid(raw[:, :3])

        colour, cover = render_rays(
            partial(shown, self.coarse),
            view.eye,
            view.directions(size, offset),
            np.linspace(entry.near, entry.far, entry.samples),
            None if self.fine is None else partial(shown, self.fine),
            entry.importance,
        )
        if entry.white:
            colour = colour + (1.0 - cover)[:, None]
        return colour.reshape(size, size, 3)
