"""The way of a sound to its recording: a room with a diffuse tail, and a measurement microphone."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse

_DECAY = 3.0 * np.log(10.0)
"""Of the amplitude's logarithm over one reverberation time: 60 dB."""


@dataclass(frozen=True)
class MicrophoneResponse:
    """A half-inch free-field capsule as IEC 61094-4 describes one: flat between its two ends."""

    vent: float = 3.0  #: Hz, where the static-pressure vent has taken 3 dB.
    resonance: float = 28e3  #: Hz, of the diaphragm.
    quality: float = 0.7  #: of that resonance; 0.7 is the flattest.
    distance: float = 0.3  #: m from the object's middle.

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


@dataclass(frozen=True)
class RoomField:
    """What a room adds to a sound; ``room_response`` says what the numbers mean."""

    t60: float  #: s.
    direct_to_reverberant_db: float  #: dB.
    seed: int  #: of the tail.
    length: float = 0.5  #: s of response.

    def response(self, rate: float) -> FloatArray:
        """``(t,)`` at a rate in samples per second."""
        return room_response(rate, self.t60, self.direct_to_reverberant_db, self.seed, self.length)


def room_response(
    rate: float, t60: float, direct_to_reverberant_db: float, seed: int, length: float
) -> FloatArray:
    """``(t,)``: what a microphone in a room receives of a unit impulse; sample 0 is the direct sound.

    Gaussian noise under an exponential (Polack, La transmission de l'energie sonore dans les
    salles, 1988): right for the late sound of any room, without the first echoes of one.

    Args:
        rate: samples per second.
        t60: s for the tail to fall by 60 dB; zero for the open.
        direct_to_reverberant_db: energy of the direct sound over that of the tail.
        seed: of the tail.
        length: s of response.

    Raises:
        WrongUse: a rate or length that is not above zero, or a time below zero.
    """
    if not (np.isfinite(rate) and rate > 0.0 and np.isfinite(length) and length > 0.0):
        raise WrongUse(f"a room's response of {length:g} s at {rate:g} samples per second is none")
    if not (np.isfinite(t60) and t60 >= 0.0 and np.isfinite(direct_to_reverberant_db)):
        raise WrongUse(
            f"a reverberation time of {t60:g} s at {direct_to_reverberant_db:g} dB is none; say a time of 0 "
            "or more and a finite level"
        )
    response = np.zeros(max(int(np.ceil(length * rate)), 1))
    response[0] = 1.0
    if t60 == 0.0 or len(response) == 1:
        return response
    times = np.arange(1, len(response)) / rate
    noise = np.random.default_rng(seed).standard_normal(len(times))
    tail = noise * np.exp(np.maximum(-_DECAY * times / t60, -600.0))
    response[1:] = tail * np.sqrt(10.0 ** (-direct_to_reverberant_db / 10.0) / (tail @ tail))
    return response


def reverberated(pressure: FloatArray, response: FloatArray) -> FloatArray:
    """``(k, t)`` Pa in the room, of ``(k, t)`` Pa in the open; what sounds on after the end is cut."""
    # Imported here, because it takes half a second and most commands do not need it.
    from scipy.signal import oaconvolve

    heard: FloatArray = oaconvolve(pressure, response[None], axes=1)[:, : pressure.shape[1]]
    return heard


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
