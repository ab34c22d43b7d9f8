"""What an imported look says of places: raw colour and density, by one network or by one for each cell."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.errors import DataRefused
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.entries import PublishedCellsEntry, PublishedVisionEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network

Field = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""``(n, 3)`` points and ``(n, 3)`` unit views in the vision frame, and a ``(3,)`` light, to ``(n, 4)``: raw
red, green, blue and density. Where nothing can be, all four are zero, as in the published program."""

_AT_ONCE = 16384
"""Points in one run of a network."""

_BLOCKS = 256
"""Blocks in one run of cells: their weights are gathered for it, 20 MB of them."""

_RIM = 1e-3
"""Within the cube's faces, in which nothing is taken to be."""


@dataclass(frozen=True, eq=False)
class OneNetwork:
    """A look of one network for all places (OSF)."""

    network: Network

    def __call__(self, points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        """As ``Field``."""
        found = np.empty((len(points), 4))
        lit = np.broadcast_to(light.astype(np.float32), points.shape)
        for first in range(0, len(points), _AT_ONCE):
            at = slice(first, first + _AT_ONCE)
            inputs = {"points": points[at], "views": views[at].astype(np.float32), "light": lit[at]}
            found[at] = _joined(
                self.network, {name: np.ascontiguousarray(rows) for name, rows in inputs.items()}
            )
        return found


@dataclass(frozen=True, eq=False)
class CellNetworks:
    """A look of one network for each cell (KiloOSF).

    Attributes:
        entry: what is said of the cells.
        network: of all cells, in blocks.
        networks: ``(cells,)`` the network of each, -1 for none.
        occupied: ``(voxels,)``; None where everything is taken for occupied.
    """

    entry: PublishedCellsEntry
    network: Network
    networks: IntArray
    occupied: BoolArray | None

    def __call__(self, points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        """As ``Field``."""
        found = np.zeros((len(points), 4))
        which = self.network_at(points)
        inside = np.flatnonzero(which >= 0)
        order = inside[np.argsort(which[inside], kind="stable")]
        rows, samples = blocks(which[order], self.entry.block)
        for first in range(0, len(rows), _BLOCKS):
            at = slice(first, first + _BLOCKS)
            chosen = order[samples[at]]  # behind a block's samples stands any other, whose answer is left out
            inputs: dict[str, AnyArray] = {
                "network": rows[at][:, None],
                "points": points[chosen],
                "views": views[chosen].astype(np.float32),
                "light": np.tile(light.astype(np.float32), (len(chosen), 1)),
            }
            used = samples[at] >= 0
            found[chosen[used]] = _joined(self.network, inputs)[used]
        return found

    def network_at(self, points: FloatArray) -> IntArray:
        """``(n,)``: which network answers at each point; -1 where nothing is."""
        low, high = np.array(self.entry.low), np.array(self.entry.high)
        inside = ((points > low + _RIM) & (points < high - _RIM)).all(axis=1)
        which = np.full(len(points), -1)
        share = (points[inside] - low) / (high - low)
        found = self.networks[_flat(share, self.entry.cells)]
        if self.occupied is not None and self.entry.voxels is not None:
            found = np.where(self.occupied[_flat(share, self.entry.voxels)], found, -1)
        which[inside] = found
        return which


def blocks(networks: IntArray, size: int) -> tuple[IntArray, IntArray]:
    """Sorted samples in blocks of one network each.

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


def open_fields(of: PublishedObject, entry: PublishedVisionEntry) -> tuple[Field, Field | None]:
    """The fields of an imported look: the only or coarse one, and the fine one.

    Raises:
        DataRefused: a file of it is not the one described.
    """
    network = open_network(of.read(entry.network), entry.network)
    if entry.cells is not None:
        return _cells(of, entry.cells, network), None
    fine = None if entry.fine is None else OneNetwork(open_network(of.read(entry.fine), entry.fine))
    return OneNetwork(network), fine


def _cells(of: PublishedObject, cells: PublishedCellsEntry, network: Network) -> CellNetworks:
    count = int(np.prod(cells.cells))
    file = cells.networks
    networks = npy_array(of.read(file), file.file, "<i4", (count,), f"the networks of {count} cells")
    most = (network.inputs[0].domain.high or (0.0,))[0]
    if networks.min() < -1 or networks.max() > most:
        raise DataRefused(
            f"{file.file} names networks to {networks.max()} where there are {most + 1:g}; import it again"
        )
    return CellNetworks(cells, network, networks.astype(np.int64), _occupied(of, cells))


def _occupied(of: PublishedObject, cells: PublishedCellsEntry) -> BoolArray | None:
    if cells.occupancy is None or cells.voxels is None:
        return None
    data, count = of.read(cells.occupancy), int(np.prod(cells.voxels))
    if len(data) != -(-count // 8):
        raise DataRefused(f"{cells.occupancy.file} has {len(data)} bytes for {count} voxels; import it again")
    return np.unpackbits(np.frombuffer(data, np.uint8), count=count).astype(np.bool_)


def _flat(share: FloatArray, sizes: tuple[int, int, int]) -> IntArray:
    """Index, x slowest, of the box that a place at ``(n, 3)`` shares of the cube lies in."""
    most = np.array(sizes)
    i, j, k = np.clip((share * most).astype(np.int64), 0, most - 1).T
    found: IntArray = (i * sizes[1] + j) * sizes[2] + k
    return found


def _joined(network: Network, inputs: dict[str, AnyArray]) -> FloatArray:
    outputs = network(inputs)
    joined = np.concatenate([outputs["colour_raw"], outputs["density_raw"]], axis=-1).astype(np.float64)
    if not np.isfinite(joined).all():
        raise DataRefused(f"{network.name} gives numbers that are not finite; import the file again")
    return joined
