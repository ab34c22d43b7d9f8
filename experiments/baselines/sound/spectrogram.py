"""ObjectFolder 1.0's sound: a network that predicts the short-time spectrum of a strike, bin by bin.

In the published form: 16 kHz, two seconds, Hann windows of 400 samples padded to 512 every 160 samples; five
inputs, the place, the frequency and the time, each 0 to 1, and real and imaginary part for unit forces along
x, y and z. What lies above 8 kHz and behind two seconds cannot be in it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import ShortTimeFFT, get_window, resample_poly

from experiments.baselines.sound.bench import StrikeBench
from harness.authoring.audio.metrics import DURATION, RATE
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.runtime import Network
from harness.objectfile.vision_tensors import graph_input
from harness.sim.sound.modal_sound import audible
from harness.sim.sound.synthesis import synthesize

SPECTRUM_RATE = 16e3
SECONDS = 2.0
_WINDOW, _HOP, _POINTS = 400, 160, 512
_UP, _DOWN = 441, 160
"""From 16 kHz to 44.1 kHz."""

_AT_ONCE = 16384
INPUTS = 5
OUTPUTS = 6
"""Real parts for x, y, z, then imaginary parts."""

SPECTRUM_FILE = "audio_spectrum.onnx"


@dataclass(frozen=True, eq=False)
class SpectrumBasis:
    """Short-time spectra of single modes: that of a strike is their sum, each times its gain.

    Attributes:
        spectra: ``(m, f, t)`` complex64, of each mode below 8 kHz with a gain of 1.
        modes: ``(m,)`` which modes of the object these are.
    """

    spectra: AnyArray
    modes: AnyArray

    @classmethod
    def of(cls, bench: StrikeBench) -> "SpectrumBasis":
        """Of the reference's modes."""
        below = np.flatnonzero(audible(bench.modes.frequencies, SPECTRUM_RATE))
        frequencies, rates = bench.modes.frequencies[below], bench.rates[below]
        gains = np.eye(len(below))
        sounds = synthesize(frequencies, rates, gains, SECONDS, SPECTRUM_RATE, "double").sound
        return cls(np.stack([transform().stft(each) for each in sounds]).astype(np.complex64), below)

    @property
    def bins(self) -> tuple[int, int]:
        """Frequencies and frames."""
        return self.spectra.shape[1], self.spectra.shape[2]

    @cached_property
    def places(self) -> FloatArray:
        """``(f t, 2)``: frequency and time of each bin, 0 to 1."""
        rows, columns = (np.linspace(0.0, 1.0, size) for size in self.bins)
        return np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)

    def spectrum(self, gains: AnyArray) -> AnyArray:
        """``(f, t)`` complex: of ``(m,)`` gains of the modes that are in it."""
        return np.tensordot(gains, self.spectra, axes=1)


def transform() -> ShortTimeFFT:
    """The short-time transform of version 1.0."""
    return ShortTimeFFT(get_window("hann", _WINDOW), _HOP, SPECTRUM_RATE, mfft=_POINTS)


def sound_of_spectrum(spectrum: AnyArray) -> FloatArray:
    """``(t,)``: the sound of an ``(f, t)`` spectrum at 44.1 kHz, with silence behind its end."""
    sound = transform().istft(spectrum, k1=round(SECONDS * SPECTRUM_RATE))
    faster = np.asarray(resample_poly(np.asarray(sound, np.float64), _UP, _DOWN))
    return np.pad(faster, (0, round(DURATION * RATE) - len(faster)))


@dataclass(frozen=True, eq=False)
class SpectrumNetwork:
    """The trained network, ready to be queried.

    Attributes:
        network: five numbers of a bin to six.
        low: ``(3,)`` m, of the box in which places are 0 to 1.
        high: ``(3,)`` m.
        basis: gives the bins.
    """

    network: Network
    low: FloatArray
    high: FloatArray
    basis: SpectrumBasis

    def sound(self, point: FloatArray, normal: FloatArray) -> FloatArray:
        """``(t,)``: what a unit impulse along ``(3,)`` a normal at ``(3,)`` a place sounds like."""
        rows = np.empty((len(self.basis.places), INPUTS))
        rows[:, :3], rows[:, 3:] = (point - self.low) / (self.high - self.low), self.basis.places
        runs = [
            self.network({"place": rows[k : k + _AT_ONCE]})["spectrum"] for k in range(0, len(rows), _AT_ONCE)
        ]
        values = np.concatenate(runs).astype(np.float64)
        along = values[:, :3] @ normal + 1j * (values[:, 3:] @ normal)
        return sound_of_spectrum(along.reshape(self.basis.bins))


def spectrum_pair() -> tuple[Input, Tensor]:
    """What the network takes and gives."""
    box = Domain(low=(0.0,) * INPUTS, high=(1.0,) * INPUTS)
    place = graph_input("place", "float64", ("n", INPUTS), "1", "x y z, frequency, time: 0 to 1", box)
    spectrum = Tensor(
        name="spectrum",
        dtype="float32",
        shape=("n", OUTPUTS),
        unit="s/sqrt(kg)",
        meaning="real parts for unit forces along x, y, z, then imaginary ones",
    )
    return place, spectrum
