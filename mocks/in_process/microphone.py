"""A microphone on a sound card without a cable, in simulated time: a crystal and a latency of its own."""

from collections.abc import Callable

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.resampling import resample
from harness.bench.device import Health, Reading
from harness.bench.instruments.sound import MicrophoneSection
from harness.bench.microphone_take import OVERLOAD, readings_of_take
from mocks.in_process.arm import Stage
from mocks.in_process.hammer import Fired, InProcessHammer
from mocks.sound_card.card import CardConverter
from mocks.world.sound import WorldSound

BLOCK = 512
"""Samples in a recorded block."""

DRIFT_PPM = -25.0
"""Parts in a million by which the card samples faster than nominal; the box's crystal is another one."""

LATENCY = 1.7e-3
"""s by which the card's times are late, in every strike: its converter's filters, and what nobody states."""

WANDER = 80e-6
"""s, standard deviation of the two clocks' difference from strike to strike, as seen over the wires."""

UNCERTAINTY = 3e-6
"""s, of the card's own clock, as a fit to a PipeWire null sink says: most of the wandering is the box's."""

_RESIDUAL = 10e-6
_SPARE = 0.01
_IDLE = 2.0


class InProcessMicrophone:
    """A ``Microphone`` that hears what the hammer of the same bench strikes.

    Args:
        sound: of the run.
        hammer: says what was struck last, and when.
        rate: Hz, at which the sound is made.
        stage: simulated time.
        section: of the station.
        converter: of the card.
    """

    def __init__(
        self,
        sound: WorldSound,
        hammer: InProcessHammer,
        rate: float,
        stage: Stage,
        section: MicrophoneSection,
        converter: CardConverter,
    ) -> None:
        self._sound = sound
        self._hammer = hammer
        self._rate = rate
        self._stage = stage
        self._section = section
        self._converter = converter
        self._nominal = float(section.rate or 0.0)
        self._true_rate = self._nominal * (1.0 + 1e-6 * DRIFT_PPM)
        self._opened = 0.0
        self._quiet = sound.idle(_IDLE)

    def open(self) -> None:
        """Nothing to connect; this is when the stream begins."""
        self._opened = self._stage.time

    def close(self) -> None:
        """Nothing to release."""

    def record(self, seconds: float) -> tuple[Reading, ...]:
        """The next ``seconds`` of sound."""
        start = self._stage.time
        return self.between(start, start + seconds)

    def between(self, start: float, end: float) -> tuple[Reading, ...]:
        """The sound from ``start`` to ``end`` s on the bench clock, in whole blocks; see ``Microphone``."""
        self._stage.time = max(self._stage.time, end)
        fired = self._hammer.fired
        step, sample = (-1, -1) if fired is None else (fired.step, fired.sample)
        noise = self._sound.converter_noise(step, sample).spawn(1)[0]
        late = LATENCY - (self._section.latency or 0.0) + WANDER * float(noise.standard_normal())
        first = int(np.floor((start - late) * self._true_rate / BLOCK))
        last = int(np.ceil((end - late) * self._true_rate / BLOCK))
        numbers = np.arange(first * BLOCK, last * BLOCK)
        pressure = self._pressure(numbers / self._true_rate, fired)
        counts = self._converter.counts(pressure, noise).reshape(-1, BLOCK)
        return self._readings(numbers[::BLOCK], late, counts)

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Not there: on a bench in process the hammer triggers."""
        raise NotImplementedError(
            "InProcessMicrophone.capture: the hammer triggers; ask `between` afterwards"
        )

    def health(self) -> Health:
        """Every sample; how late they are nobody knows."""
        identity = f"{self._section.serial} on a sound card in process".strip()
        return Health("microphone", identity, self._true_rate, 0, None, "simulated time")

    def _pressure(self, times: FloatArray, fired: Fired | None) -> FloatArray:
        """``(t,)`` Pa at bench times: the strike from its firing on, else what is always there."""
        zero = 0.0 if fired is None else fired.time
        begin, end = (int(np.floor((t - zero) * self._rate)) for t in (times[0] - _SPARE, times[-1] + _SPARE))
        numbers = np.arange(begin, end)
        heard = self._quiet[numbers % len(self._quiet)]
        if fired is not None:
            rung = self._sound.strike(fired.base_from_flange, fired.step, fired.sample).pressure
            inside = (numbers >= 0) & (numbers < len(rung))
            heard[inside] = rung[numbers[inside]]
        return resample(heard, zero + begin / self._rate, self._rate, times, self._nominal)

    def _readings(self, numbers: AnyArray, late: float, counts: AnyArray) -> tuple[Reading, ...]:
        times = numbers / self._true_rate + late
        full = self._converter.full_scale
        flag = OVERLOAD if np.any((counts >= full) | (counts <= -full - 1)) else 0
        line = np.array([numbers[-1], times[-1], self._true_rate, _RESIDUAL, UNCERTAINTY, self._opened])
        age = BLOCK / self._true_rate
        callbacks = np.stack([times + age, np.full(len(times), age)], axis=1)
        return readings_of_take(times, counts, np.full(len(times), flag), callbacks, line, self._nominal)
