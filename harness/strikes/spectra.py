"""Spectra of a run's strikes: what was heard over what was struck, and the noise of both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import next_fast_len, rfft, rfftfreq

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused
from harness.bench.acquisition import Strike

ComplexArray = npt.NDArray[np.complex128]

_RATE_TOLERANCE = 1.0e-3
_LEAST_NOISE_SAMPLES = 64


@dataclass(frozen=True)
class Analysis:
    """How strikes are read."""

    decay: float = 20.0
    """1/s of the exponential window, against late reverberation. It is put on the force too: an exponential
    passes through a convolution, so that it changes no transfer function but by adding to the damping of
    every mode."""
    duration: float = 0.3  #: s of each strike that are read.
    before: float = 1.0e-3  #: s before the trigger at which reading begins.
    pulse: float = 4.0e-3
    """s of force that are read; what the cell shows later is its own noise (ISO 7626-5)."""
    force_floor: float = 0.05
    """share of its greatest spectral value below which a force excites nothing: 26 dB against the 20 of ISO
    7626-5, because what is too noisy is found out by itself."""
    lowest: float = 150.0  #: Hz; below it are the room and the object rocking on its stand.
    prominence: tuple[float, float] = (6.0, 4.0)
    """dB that a peak stands above its surroundings, and a broad one."""
    range: float = 45.0
    """dB below the highest at which peaks are no longer looked at: what is left there is skirts."""
    above_noise: float = 10.0  #: dB that it stands above what was heard before the strikes.
    above_floor: tuple[float, float] = (9.0, 6.0)
    """dB that it stands above the median about it: between resonances a room's echoes make peaks out of what
    all modes together answer, seldom 10 dB above their median. And a broad one."""
    broad: float = 60.0  #: Hz between the edges of a peak that is too broad for an echo's.
    floor_reach: float = 250.0  #: Hz to each side over which that median is taken, at least.
    edge: float = 0.25  #: share of a peak's power down to which its band reaches.
    residual: float = 0.12  #: share of a band's energy that may differ from one waveform.
    skirt: float = 6.0
    """dB that a peak must stand above the skirts of stronger ones, on which a room's echoes make peaks of
    their own."""
    shared_skirt: float = 14.0  #: the same for a peak whose shares are those of the stronger ones.
    shared: float = 0.1  #: share of a peak's energy beyond which its shares are its own.
    most: int = 40  #: peaks kept at most, strongest first.


@dataclass(frozen=True, eq=False)
class Spectra:
    """Of the strikes that count: rows are strikes, columns frequencies."""

    frequencies: FloatArray  #: ``(F,)`` Hz.
    transfer: ComplexArray  #: ``(K, F)`` Pa/N, pressure over force; 0 where the force has nothing.
    excited: BoolArray  #: ``(K, F)`` whether the force has something.
    noise: FloatArray  #: ``(K, F)`` Pa/N expected of what was heard before the strikes.


def spectra_of(strikes: Sequence[Strike], settings: Analysis) -> Spectra:
    """The spectra of strikes that count.

    Raises:
        DataRefused: their rates differ.
    """
    rates = np.array([strike.rate for strike in strikes])
    rate = float(np.median(rates))
    if np.max(np.abs(rates / rate - 1.0)) > _RATE_TOLERANCE:
        raise DataRefused(
            f"the strikes were sampled at {rates.min():g} to {rates.max():g} Hz; "
            "strikes of one run must share one rate, to one part in a thousand"
        )
    samples = round(settings.duration * rate)
    size = int(next_fast_len(2 * samples, real=True))
    frequencies = rfftfreq(size, 1.0 / rate)
    window = np.exp(-settings.decay * np.arange(samples) / rate)
    force, pressure, noise = [], [], []
    for strike in strikes:
        start = max(0, strike.onset - round(settings.before * rate))
        pulse = round((settings.before + settings.pulse) * rate)
        force.append(rfft(_windowed(strike.force, start, window, pulse), size))
        pressure.append(rfft(_windowed(strike.pressure, start, window, samples), size))
        before = strike.pressure[:start]
        noise.append(
            0.0 if len(before) < _LEAST_NOISE_SAMPLES else float(before.std() * np.sqrt(np.sum(window**2)))
        )
    forces = np.array(force)
    strength = np.abs(forces)
    excited = strength >= settings.force_floor * strength.max(axis=1, keepdims=True)
    excited &= (strength > 0.0) & (frequencies >= settings.lowest)
    safe = np.where(excited, forces, 1.0)
    transfer = np.where(excited, np.array(pressure) / safe, 0.0)
    return Spectra(frequencies, transfer, excited, np.array(noise)[:, None] / np.abs(safe))


def _windowed(signal: FloatArray, start: int, window: FloatArray, length: int) -> FloatArray:
    rest = signal[:start].mean() if start >= _LEAST_NOISE_SAMPLES else 0.0
    piece = signal[start : start + min(length, len(window))] - rest
    return np.asarray(piece * window[: len(piece)])
