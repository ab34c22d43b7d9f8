"""Sound of an imported ObjectFile of version 2.0: gains of modes, and the modes' sum."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import DataRefused, OutOfDomain
from harness.objectfile.published.entries import PublishedGainsEntry
from harness.objectfile.published.folder import PublishedObject
from harness.objectfile.published.queries import require_in_box
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network

COMPAT_RATE = 44100.0
"""Samples per second of the published program."""

_COMPAT_SAMPLES = 3 * 44100
_COMPAT_RING = 2 * 44100
_COMPAT_LAG = 2
"""Samples of silence before the ring: the published convolution's own delay."""


@dataclass(frozen=True, eq=False)
class PublishedGains:
    """The network of an imported sound, and its modes.

    Attributes:
        entry: what is said of it.
        network: points to gains.
    """

    entry: PublishedGainsEntry
    network: Network

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
        gains = self.network({"points": np.ascontiguousarray(points)})["gains"].astype(np.float64)
        if not np.isfinite(gains).all():
            raise DataRefused(f"{self.network.name} gives gains that are not finite; import the file again")
        return gains

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
