"""Pictures of an imported look: raw colour and density from one network (OSF), or one a cell (KiloOSF)."""

from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.camera import PublishedView
from harness.objectfile.published.entries import PublishedCellsEntry, PublishedVisionEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.published.query import query
from harness.objectfile.published.volume_render import render_rays, stretched_sigmoid
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network
from harness.objectfile.vision_tensors import graph_input

_BLOCKS = 256
"""Blocks in one run of cells: their weights are gathered for it, 20 MB of them."""

_RIM = 1e-3
"""Within the cube's faces, in which nothing is taken to be."""


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


@dataclass(frozen=True, eq=False)
class OsfNetwork:
    """One network for all points."""

    network: Network

    def raw(self, points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        """Compute raw red, green, blue and density.

        Args:
            points: ``(n, 3)`` in the vision frame.
            views: ``(n, 3)`` unit directions from the camera.
            light: ``(3,)`` unit direction.

        Returns:
            ``(n, 4)``; zeros where nothing can be, as in the published program.
        """
        lights = np.broadcast_to(light, points.shape)
        return _joined(query(self.network, {"points": points, "views": views, "light": lights}))


@dataclass(frozen=True, eq=False)
class CellNetworks:
    """One network for each cell (KiloOSF)."""

    entry: PublishedCellsEntry  #: description of the cells.
    network: Network  #: all cells' networks in one graph, queried in blocks.
    networks: IntArray  #: ``(cells,)`` number of each cell's network, -1 for none.
    occupied: BoolArray | None  #: ``(voxels,)``; None if all of the cube counts as occupied.

    def raw(self, points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        """Compute raw red, green, blue and density, as ``OsfNetwork.raw``."""
        result = np.zeros((len(points), 4))
        which = self.network_at(points)
        inside = np.flatnonzero(which >= 0)
        order = inside[np.argsort(which[inside], kind="stable")]
        rows, samples = blocks(which[order], self.entry.block)
        if not len(rows):
            return result
        chosen = order[
            samples
        ]  # the places behind a block's samples repeat another, whose answer is left out
        inputs = {
            "network": rows[:, None],
            "points": points[chosen],
            "views": views[chosen],
            "light": np.broadcast_to(light, (len(rows), 3)),
        }
        used = samples >= 0
        result[chosen[used]] = _joined(query(self.network, inputs, _BLOCKS))[used]
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


def blocks(networks: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Divide sorted samples into blocks of one network each.

    Args:
        networks: ``(n,)`` ascending, of each sample.
        size: samples of a block.

    Returns:
        ``(b,)`` the network of each block, and ``(b, size)`` its samples, -1 behind the last one.
    """
    names, first, counts = np.unique(networks, return_index=True, return_counts=True)
    needed = -(-counts // size)
    rank = np.arange(len(networks)) - np.repeat(first, counts)
    start = np.cumsum(needed) - needed
    samples = np.full((int(needed.sum()), size), -1)
    samples[np.repeat(start, counts) + rank // size, rank % size] = np.arange(len(networks))
    return np.repeat(names, needed).astype(np.int64), samples


@dataclass(frozen=True, eq=False)
class PublishedPicture:
    """A picture, before it is rounded."""

    colour: FloatArray  #: ``(size, size, 3)``, of which 0 is black and 1 white; it may lie beyond.
    cover: FloatArray  #: ``(size, size)`` share of each pixel that is covered.

    def rounded(self) -> ByteArray:
        """``(size, size, 3)`` to the nearest of 256 greys."""
        return np.rint(255.0 * np.clip(self.colour, 0.0, 1.0)).astype(np.uint8)

    def truncated(self) -> ByteArray:
        """The same as the published programs write it: to the grey below."""
        return (255.0 * np.clip(self.colour, 0.0, 1.0)).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class PublishedLook:
    """The networks of an imported look."""

    entry: PublishedVisionEntry  #: description of the look, with how rays are sampled.
    coarse: OsfNetwork | CellNetworks  #: the only network, or that of the first samples.
    fine: OsfNetwork | None = None  #: network of all samples; None if there are no further ones.

    def picture(self, view: PublishedView, size: int, offset: float) -> PublishedPicture:
        """Render a view.

        Args:
            view: camera and light.
            size: pixels a side.
            offset: pixels from the corner of a pixel to its ray: 0 as published, 0.5 for its centre.
        """
        entry = self.entry

        def shown(
            network: OsfNetwork | CellNetworks, points: FloatArray, views: FloatArray
        ) -> tuple[FloatArray, FloatArray]:
            raw = network.raw(points, views, view.light)
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
        return PublishedPicture(colour.reshape(size, size, 3), cover.reshape(size, size))


def open_look(of: PublishedObject, entry: PublishedVisionEntry) -> PublishedLook:
    """Open the look of an imported object.

    Raises:
        DataRefused: a file of it is not the one described.
    """
    network = open_network(of.read(entry.network), entry.network)
    if entry.cells is not None:
        return PublishedLook(entry, _open_cells(of, entry.cells, network))
    fine = None if entry.fine is None else OsfNetwork(open_network(of.read(entry.fine), entry.fine))
    return PublishedLook(entry, OsfNetwork(network), fine)


def _open_cells(of: PublishedObject, cells: PublishedCellsEntry, network: Network) -> CellNetworks:
    count = int(np.prod(cells.cells))
    file = cells.networks
    networks = npy_array(of.read(file), file.file, "<i4", (count,), f"the networks of {count} cells")
    most = (network.inputs[0].domain.high or (0.0,))[0]
    if networks.min() < -1 or networks.max() > most:
        raise DataRefused(
            f"{file.file} names networks to {networks.max()} where there are {most + 1:g}; import it again"
        )
    occupied = None
    if cells.occupancy is not None and cells.voxels is not None:
        data, voxels = of.read(cells.occupancy), int(np.prod(cells.voxels))
        if len(data) != -(-voxels // 8):
            raise DataRefused(
                f"{cells.occupancy.file} has {len(data)} bytes for {voxels} voxels; import it again"
            )
        occupied = np.unpackbits(np.frombuffer(data, np.uint8), count=voxels).astype(np.bool_)
    return CellNetworks(cells, network, networks.astype(np.int64), occupied)


def _flat_index(fraction: FloatArray, sizes: tuple[int, int, int]) -> IntArray:
    """Index, x slowest, of the box that contains each of ``(n, 3)`` fractions of the cube."""
    most = np.array(sizes)
    i, j, k = np.clip((fraction * most).astype(np.int64), 0, most - 1).T
    index: IntArray = (i * sizes[1] + j) * sizes[2] + k
    return index


def _joined(outputs: dict[str, FloatArray]) -> FloatArray:
    return np.concatenate([outputs["colour_raw"], outputs["density_raw"]], axis=-1)
