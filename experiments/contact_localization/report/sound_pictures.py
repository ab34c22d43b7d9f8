"""What sound contributed, as arrays for the report to draw."""

from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from harness.basics.arrays import FloatArray, read_only
from harness.basics.materials import Material
from harness.bench.acquisition import Strike
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_radiation import radiation
from harness.sim.sound.modal_sound import ring
from harness.strikes.spectra import Analysis

_FRAME = 0.02
_HOP = 0.004
_LASTING = 0.4
_HIGHEST = 12_000.0
_QUIETEST = -90.0
_DISTANCE = 0.3


@dataclass(frozen=True, eq=False)
class Spectrogram:
    """Levels of a sound over time and frequency.

    Attributes:
        times: ``(n,)`` s from the strike, the middle of each frame.
        frequencies: ``(f,)`` Hz.
        levels: ``(f, n)`` dB against the loudest, down to -90.
        loudest: Pa, rms of the loudest line.
    """

    times: FloatArray
    frequencies: FloatArray
    levels: FloatArray
    loudest: float


@dataclass(frozen=True, eq=False)
class SoundPair:
    """One strike as it was heard beside what the model says at the estimated place."""

    recorded: Spectrogram
    simulated: Spectrogram


def spectrogram(sound: FloatArray, rate: float) -> Spectrogram:
    """Of ``(t,)`` Pa from the strike on: Hann frames of 20 ms every 4 ms, up to 12 kHz and 0.4 s."""
    size, hop = round(_FRAME * rate), round(_HOP * rate)
    padded = np.zeros(max(size, round(_LASTING * rate)))
    piece = sound[: len(padded)]
    padded[: len(piece)] = piece
    starts = np.arange(0, len(padded) - size + 1, hop)
    window = np.hanning(size)
    frames = padded[starts[:, None] + np.arange(size)] * window
    frequencies = rfftfreq(size, 1.0 / rate)
    shown = frequencies <= min(_HIGHEST, 0.5 * rate)
    strengths = np.abs(rfft(frames, axis=1)[:, shown]).T * np.sqrt(2.0) / window.sum()
    loudest = float(strengths.max())
    relative = strengths / loudest if loudest > 0.0 else np.zeros_like(strengths)
    levels = 20.0 * np.log10(np.maximum(relative, 10.0 ** (_QUIETEST / 20.0)))
    times = np.asarray((starts + 0.5 * size) / rate, dtype=np.float64)
    return Spectrogram(read_only(times), read_only(frequencies[shown]), read_only(levels), loudest)


def sound_pair(
    strike: Strike,
    modes: Modes,
    material: Material,
    point: FloatArray,
    direction: FloatArray,
    factor: float,
) -> SoundPair:
    """A strike as recorded, and as its own force would sound at a place of the model.

    Neither room nor microphone is in the simulated one, and its level at 0.3 m is an upper bound.

    Args:
        strike: the recorded one.
        modes: of the object.
        material: for the damping.
        point: ``(3,)`` metres, in the object's frame.
        direction: ``(3,)`` unit, of the blow.
        factor: real frequency over the model's, as the estimate found it.
    """
    frequencies = factor * modes.frequencies
    amplitudes = modes.gains(point[None], direction[None]) * radiation(modes, _DISTANCE)
    # What the cell says after the blow is its own noise, which would ring the modes for ever.
    force = strike.force[strike.onset :].copy()
    force[round(Analysis().pulse * strike.rate) :] = 0.0
    rung = ring(frequencies, dampings(frequencies, material), amplitudes, force[None], strike.rate)[0]
    recorded = spectrogram(strike.pressure[strike.onset :], strike.rate)
    return SoundPair(recorded, spectrogram(rung, strike.rate))
