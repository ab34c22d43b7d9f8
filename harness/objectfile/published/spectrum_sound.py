"""Sound of an imported ObjectFile of version 1.0: short-time spectra of voxels, and the sound they make.

The network learnt in coordinates of voxels that were brought to 0 .. 1 by one least and one greatest number
for x, y and z alike. The files hold neither; the published program takes them from the query itself, so that
a place sounds otherwise in other company. Here they are given, or the query's are asked for by name.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import get_window, istft
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.entries import Bounds, PublishedSpectrumEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network

NEAREST = 4
"""Voxels whose sounds are added."""

_AT_ONCE = 16384
"""Values of spectra in one run of the network."""


@dataclass(frozen=True, eq=False)
class PublishedSpectra:
    """The network of an imported sound of version 1.0.

    Attributes:
        entry: what is said of it.
        voxels: ``(m, 3)``, in voxels.
        network: normalised place, frequency and time to the spectrum.
    """

    entry: PublishedSpectrumEntry
    voxels: FloatArray
    network: Network

    def near(self, point: FloatArray) -> FloatArray:
        """``(4, 3)``: the voxels nearest to a ``(3,)`` point in metres, in the mesh's frame."""
        entry = self.entry
        place = (point + np.array(entry.translation)) * entry.scale * entry.grid
        _, which = cKDTree(self.voxels).query(place, NEAREST)
        return self.voxels[which]

    def bounds_of(self, voxels: FloatArray, of_query: bool) -> Bounds:
        """What is 0 and 1 to the network.

        Args:
            voxels: ``(4, 3)`` of the query.
            of_query: whether to take the query's own, as the published program does.

        Raises:
            WrongUse: nobody gave any.
            OutOfDomain: a voxel beyond those that were given.
        """
        if of_query:
            return float(voxels.min()), float(voxels.max())
        if self.entry.bounds is None:
            raise WrongUse(
                "the sound was imported without the bounds of its voxels, which ObjectFolder 1.0 does not "
                "publish: "
                "import the file again with --audio-bounds LOW HIGH, or say --objectfolder-compat to take "
                "the query's "
                "own, as its program does"
            )
        low, high = self.entry.bounds
        if voxels.min() < low or voxels.max() > high:
            raise OutOfDomain(
                f"the nearest voxels lie from {voxels.min():g} to {voxels.max():g}, and the bounds of the "
                "import "
                f"are {low:g} to {high:g}; strike elsewhere, or import the file with the bounds it was "
                "trained in"
            )
        return low, high

    def sound(self, point: FloatArray, force: FloatArray, of_query: bool = False) -> FloatArray:
        """``(t,)``: what a strike sounds like, in the unit of the spectra.

        Args:
            point: ``(3,)`` m, in the mesh's frame.
            force: ``(3,)``, in units of the force that the spectra are for.
            of_query: as ``bounds_of``.

        Raises:
            WrongUse: as ``bounds_of``.
            OutOfDomain: as ``bounds_of``; or a force of zero.
        """
        if not force.any():
            raise OutOfDomain("a force of zero makes no sound; give another")
        voxels = self.near(point)
        low, high = self.bounds_of(voxels, of_query)
        if not high > low:
            raise OutOfDomain(
                f"bounds from {low:g} to {high:g} hold nothing; give the least and greatest coordinate"
            )
        spectra = (self.spectrum((voxel - low) / (high - low)) for voxel in voxels)
        added: FloatArray = sum(
            (self.heard(np.tensordot(each, force, axes=1)) for each in spectra), np.zeros(())
        )
        return added

    def spectrum(self, place: FloatArray) -> FloatArray:
        """``(frequencies, frames, 3)`` complex: of one normalised ``(3,)`` place, for each unit force.

        Raises:
            DataRefused: values that are not finite.
        """
        entry = self.entry
        frequencies, frames = entry.transform // 2 + 1, entry.frames
        at = np.empty((frequencies, frames, 5))
        at[..., :3] = place
        at[..., 3], at[..., 4] = np.linspace(0.0, 1.0, frequencies)[:, None], np.linspace(0.0, 1.0, frames)
        rows = at.reshape(-1, 5)
        runs = [
            self.network({"place": rows[k : k + _AT_ONCE]})["spectrum"] for k in range(0, len(rows), _AT_ONCE)
        ]
        values = np.concatenate(runs).astype(np.float64)
        if not np.isfinite(values).all():
            raise DataRefused(f"{self.network.name} gives values that are not finite; import the file again")
        found: FloatArray = (values[:, 0] + 1j * values[:, 1]).reshape(frequencies, frames, 3)
        return found

    def heard(self, spectrum: FloatArray) -> FloatArray:
        """``(t,)``: the sound of a ``(frequencies, frames)`` spectrum, by overlapped Hann windows."""
        entry = self.entry
        window, margin = get_window("hann", entry.window), (entry.transform - entry.window) // 2
        padded: Any = np.pad(window, (margin, entry.transform - entry.window - margin))
        # scipy's spectra are divided by the window's sum, the published ones are not.
        _, sound = istft(
            spectrum / padded.sum(),
            window=padded,
            nperseg=entry.transform,
            noverlap=entry.transform - entry.hop,
        )
        return np.asarray(sound[: entry.samples], np.float64)


def open_spectra(of: PublishedObject, entry: PublishedSpectrumEntry) -> PublishedSpectra:
    """The sound of an imported object of version 1.0.

    Raises:
        DataRefused: a file of it is not the one described.
    """
    voxels = npy_array(of.read(entry.voxels), entry.voxels.file, "<f8", (None, 3), "voxels of float64 (m, 3)")
    if len(voxels) < NEAREST or not np.isfinite(voxels).all():
        raise DataRefused(
            f"{entry.voxels.file} has {len(voxels)} voxels, fewer than {NEAREST}, or not finite ones"
        )
    return PublishedSpectra(entry, voxels, open_network(of.read(entry.network), entry.network))
