"""Sounds of imported objects: gains of modes and their sum (2.0), or short-time spectra of voxels (1.0)."""

from typing import Any

import numpy as np
from scipy.signal import get_window, istft
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.objectfile.npy_file import npy_array
from harness.objectfile.published.entries import (
    PublishedGainsEntry,
    PublishedObject,
    PublishedSpectrumEntry,
)
from harness.objectfile.published.query import coordinate_bounds, query, require_trained

COMPAT_RATE = 44100.0
"""Samples per second of the published program."""

_COMPAT_SAMPLES = 3 * 44100
_COMPAT_RING = 2 * 44100
_COMPAT_LAG = 2
"""Samples of silence before the ring: the published convolution's own delay."""

NEAREST = 4
"""Voxels of 1.0 whose sounds are added."""


def mode_gains(of: PublishedObject, entry: PublishedGainsEntry, points: FloatArray) -> FloatArray:
    """Compute ``(n, modes, 3)`` gains for a unit force along x, y and z at ``(n, 3)`` points in metres.

    Raises:
        OutOfDomain: a point outside of the box that the network was trained in.
        DataRefused: a damaged network, or gains that are not finite.
    """
    require_trained(points, entry.low_m, entry.high_m, "strike", "m")
    return query(of.network(entry.network), {"points": points})["gains"]


def sum_modes(
    amplitudes: FloatArray, frequencies: FloatArray, dampings: FloatArray, samples: int, rate: float
) -> FloatArray:
    """Sum damped modes: ``sum_i a_i exp(-d_i t) sin(2 pi f_i t)``, from the time zero on.

    Args:
        amplitudes: ``(n, m)``.
        frequencies: ``(m,)`` Hz, of the damped modes; one above half of the rate folds.
        dampings: ``(m,)`` 1/s, zero or more.
        samples: samples of a sound, one or more.
        rate: samples per second.

    Returns:
        ``(n, samples)``.
    """
    times = np.arange(samples) / rate
    sounds = np.zeros((len(amplitudes), samples))
    for amplitude, frequency, damping in zip(amplitudes.T, frequencies, dampings, strict=True):
        mode = np.exp(-damping * times) * np.sin(2.0 * np.pi * frequency * times)
        sounds += amplitude[:, None] * mode
    return sounds


def compat_sounds(amplitudes: FloatArray, frequencies: FloatArray, dampings: FloatArray) -> FloatArray:
    """Compute ``(n, 132300)`` sounds as ``OF_render.py`` writes them, at ``COMPAT_RATE``.

    Two seconds of ringing cut off hard, after two samples of silence, in three seconds; modes above half of
    the rate fold; the loudest sample is 1 or -1. Arguments are those of ``sum_modes``.

    Raises:
        OutOfDomain: a silent sound, which has no loudest sample.
    """
    ring = sum_modes(amplitudes, frequencies, dampings, _COMPAT_RING, COMPAT_RATE)
    sounds = np.zeros((len(ring), _COMPAT_SAMPLES))
    sounds[:, _COMPAT_LAG : _COMPAT_LAG + _COMPAT_RING] = ring
    return peak_normalised(sounds)


def peak_normalised(sounds: FloatArray) -> FloatArray:
    """Divide each of ``(n, t)`` sounds by its loudest sample; ``OutOfDomain`` for a silent one."""
    peaks = np.abs(sounds).max(axis=1, keepdims=True)
    silent = np.flatnonzero(peaks[:, 0] == 0.0)
    if len(silent):
        raise OutOfDomain(f"sound {silent[0]} is silent and has no peak to be divided by; give another force")
    normalised: FloatArray = sounds / peaks
    return normalised


def spectrum_sounds(
    of: PublishedObject,
    entry: PublishedSpectrumEntry,
    points: FloatArray,
    forces: FloatArray,
    of_query: bool = False,
) -> FloatArray:
    """Compute ``(n, t)`` sounds of version 1.0, in the unit of the spectra.

    Args:
        of: imported object.
        entry: its sound.
        points: ``(n, 3)`` m, in the mesh's frame.
        forces: ``(n, 3)``, in units of the force that the spectra are for.
        of_query: whether to normalise by the bounds of each query's own voxels, as the published program.

    Raises:
        WrongUse: no bounds were given at the import.
        OutOfDomain: voxels outside of the bounds.
        DataRefused: a damaged file, or values that are not finite.
    """
    file = entry.voxels
    voxels = npy_array(of.read(file), file.file, "<f8", (None, 3), "voxels of float64 (m, 3)")
    if len(voxels) < NEAREST or not np.isfinite(voxels).all():
        raise DataRefused(f"{file.file} has {len(voxels)} voxels, fewer than {NEAREST}, or not finite ones")
    tree, network = cKDTree(voxels), of.network(entry.network)
    sounds = []
    for point, force in zip(points, forces, strict=True):
        place = (point + np.array(entry.translation)) * entry.scale * entry.grid
        near = voxels[tree.query(place, NEAREST)[1]]
        low, high = coordinate_bounds(
            entry.bounds,
            near,
            of_query=of_query,
            option="--audio-bounds",
            what="voxel",
            unit="voxels",
            slack=0.0,
        )
        if not high > low:
            raise OutOfDomain(
                f"bounds from {low:g} to {high:g} hold nothing; give the least and greatest coordinate"
            )
        sound: FloatArray = np.zeros(())
        for voxel in near:
            places = spectrum_queries(entry, (voxel - low) / (high - low))
            values = query(network, {"place": places})["spectrum"]
            bins = np.tensordot(values[:, 0] + 1j * values[:, 1], force, axes=1)
            sound = sound + inverse_spectrum(entry, bins)
        sounds.append(sound)
    return np.stack(sounds)


def spectrum_queries(entry: PublishedSpectrumEntry, place: FloatArray) -> FloatArray:
    """Build the queries of all bins of a spectrum at a normalised ``(3,)`` place, frequency by frequency."""
    frequencies, frames = entry.transform // 2 + 1, entry.frames
    queries = np.empty((frequencies, frames, 5))
    queries[..., :3] = place
    queries[..., 3] = np.linspace(0.0, 1.0, frequencies)[:, None]
    queries[..., 4] = np.linspace(0.0, 1.0, frames)
    return queries.reshape(-1, 5)


def inverse_spectrum(entry: PublishedSpectrumEntry, bins: FloatArray) -> FloatArray:
    """Compute the ``(t,)`` sound of complex bins, frequency by frequency, by overlapped Hann windows."""
    window, margin = get_window("hann", entry.window), (entry.transform - entry.window) // 2
    padded: Any = np.pad(window, (margin, entry.transform - entry.window - margin))
    # scipy's spectra are divided by the window's sum, the published ones are not.
    _, sound = istft(
        bins.reshape(-1, entry.frames) / padded.sum(),
        window=padded,
        nperseg=entry.transform,
        noverlap=entry.transform - entry.hop,
    )
    return np.asarray(sound[: entry.samples], np.float64)
