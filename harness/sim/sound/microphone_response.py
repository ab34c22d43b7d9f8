"""What a measurement microphone makes of the pressure in front of it."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse


@dataclass(frozen=True)
class MicrophoneResponse:
    """A half-inch free-field capsule as IEC 61094-4 describes one: flat between its two ends.

    Attributes:
        vent: Hz, where the static-pressure vent has taken 3 dB.
        resonance: Hz, of the diaphragm.
        quality: of that resonance; 0.7 is the flattest.
        distance: m from the object's middle.
    """

    vent: float = 3.0
    resonance: float = 28e3
    quality: float = 0.7
    distance: float = 0.3

    def __post_init__(self) -> None:
        numbers = (self.vent, self.resonance, self.quality, self.distance)
        if not all(np.isfinite(number) and number > 0.0 for number in numbers):
            raise WrongUse(
                f"a microphone with a vent of {self.vent:g} Hz, a resonance of {self.resonance:g} Hz, "
                f"quality {self.quality:g} at {self.distance:g} m is none; all are above 0"
            )

    def at(self, frequencies: FloatArray) -> AnyArray:
        """``(f,)`` complex: pascals shown per pascal, at frequencies in Hz."""
        vented = 1j * frequencies / self.vent
        ratio = frequencies / self.resonance
        return vented / (1.0 + vented) / (1.0 - ratio**2 + 1j * ratio / self.quality)


def as_heard(pressure: FloatArray, rate: float, microphone: MicrophoneResponse) -> FloatArray:
    """``(k, t)`` Pa that the microphone shows of ``(k, t)`` Pa, which begin in silence."""
    samples = pressure.shape[1]
    if samples == 0:
        return pressure.copy()
    padded = 2 * samples
    spectrum = np.fft.rfft(pressure, padded, axis=1)
    frequencies = np.asarray(np.fft.rfftfreq(padded, 1.0 / rate), dtype=np.float64)
    heard: FloatArray = np.fft.irfft(spectrum * microphone.at(frequencies), padded, axis=1)
    return heard[:, :samples]
