"""Sounds of imported ObjectFiles: gains of modes and their sum (2.0), or short-time spectra of voxels (1.0).

The network of 1.0 learnt in coordinates of voxels that were brought to 0 .. 1 by one least and one greatest
number for x, y and z alike. The files hold neither; the published program takes them from the query itself,
so that the answer for one point depends on the other points of the query. Here they are given at the import,
or the query's own are requested by name.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import get_window, istft
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain, WrongUse
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.entries import Bounds, PublishedGainsEntry, PublishedSpectrumEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.published.query import query, require_in_box
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network

COMPAT_RATE = 44100.0
"""Samples per second of the published program."""

_COMPAT_SAMPLES = 3 * 44100
_COMPAT_RING = 2 * 44100
_COMPAT_LAG = 2
"""Samples of silence before the ring: the published convolution's own delay."""

NEAREST = 4
"""Voxels of 1.0 whose sounds are added."""


@dataclass(frozen=True, eq=False)
class PublishedGains:
    """The network of an imported sound, and its modes."""

    entry: PublishedGainsEntry  #: what is said of it.
    network: Network  #: points to gains.

    @property
    def frequencies(self) -> FloatArray:
        """``(m,)`` Hz, as published."""
        return np.array(self.entry.frequencies_hz)

    @property
    def dampings(self) -> FloatArray:
        """``(m,)`` 1/s, zero or more: the published program ignores their sign."""
        return np.asarray(np.abs(np.array(self.entry.dampings_per_s)))

    def at(self, points: FloatArray) -> FloatArray:
        """``(n, m, 3)``: gains for a unit force along x, y and z at ``(n, 3)`` points in metres.

        Raises:
            OutOfDomain: a point outside of the box that the network was trained in.
            DataRefused: gains that are not finite.
        """
        require_in_box(points, np.array(self.entry.low_m), np.array(self.entry.high_m), "strike")
        return query(self.network, {"points": points})["gains"]

    def amplitudes(self, points: FloatArray, forces: FloatArray) -> FloatArray:
        """``(n, m)``: what each mode starts from under ``(n, 3)`` forces, a row for each point.

        Raises:
            OutOfDomain: as ``at``; or a force of zero, which makes no sound.
        """
        silent = np.flatnonzero(~forces.any(axis=1))
        if len(silent):
            raise OutOfDomain(
                f"force {silent[0]} is zero, which makes no sound; give another or leave the row out"
            )
        found: FloatArray = np.einsum("nmd,nd->nm", self.at(points), forces)
        return found

    def audible(self, rate: float) -> BoolArray:
        """``(m,)``: the modes below half of the rate."""
        return np.asarray(np.abs(self.frequencies) < 0.5 * rate)


def open_gains(of: PublishedObject, entry: PublishedGainsEntry) -> PublishedGains:
    """The sound of an imported object; ``DataRefused`` where its file is not the one described."""
    return PublishedGains(entry, open_network(of.read(entry.network), entry.network))


def rung(
    amplitudes: FloatArray, frequencies: FloatArray, dampings: FloatArray, samples: int, rate: float
) -> FloatArray:
    """``(n, samples)``: ``sum_i a_i exp(-d_i t) sin(2 pi f_i t)``, from the time zero on.

    Args:
        amplitudes: ``(n, m)``.
        frequencies: ``(m,)`` Hz, of the damped modes; one above half of the rate folds.
        dampings: ``(m,)`` 1/s, zero or more.
        samples: one or more.
        rate: per second.
    """
    times = np.arange(samples) / rate
    sounds = np.zeros((len(amplitudes), samples))
    for amplitude, frequency, damping in zip(amplitudes.T, frequencies, dampings, strict=True):
        mode = np.exp(-damping * times) * np.sin(2.0 * np.pi * frequency * times)
        sounds += amplitude[:, None] * mode
    return sounds


def compat_sounds(amplitudes: FloatArray, frequencies: FloatArray, dampings: FloatArray) -> FloatArray:
    """``(n, 132300)``: sounds as ``OF_render.py`` writes them, at ``COMPAT_RATE``.

    Two seconds of ringing cut off hard, after two samples of silence, in three seconds; modes above half of
    the rate fold; the loudest sample is 1 or -1. Arguments as of ``rung``.

    Raises:
        OutOfDomain: a silent sound, which has no loudest sample.
    """
    ring = rung(amplitudes, frequencies, dampings, _COMPAT_RING, COMPAT_RATE)
    sounds = np.zeros((len(ring), _COMPAT_SAMPLES))
    sounds[:, _COMPAT_LAG : _COMPAT_LAG + _COMPAT_RING] = ring
    return read_only(peak_normalised(sounds))


def peak_normalised(sounds: FloatArray) -> FloatArray:
    """``(n, t)`` sounds, each divided by its loudest sample.

    Raises:
        OutOfDomain: a silent one, which has none.
    """
    peaks = np.abs(sounds).max(axis=1, keepdims=True)
    silent = np.flatnonzero(peaks[:, 0] == 0.0)
    if len(silent):
        raise OutOfDomain(f"sound {silent[0]} is silent and has no peak to be divided by; give another force")
    normalised: FloatArray = sounds / peaks
    return normalised


@dataclass(frozen=True, eq=False)
class PublishedSpectra:
    """The network of an imported sound of version 1.0."""

    entry: PublishedSpectrumEntry  #: what is said of it.
    voxels: FloatArray  #: ``(m, 3)``, in voxels.
    network: Network  #: normalised place, frequency and time to the spectrum.

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
        values = query(self.network, {"place": at.reshape(-1, 5)})["spectrum"]
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
