"""Strikes heard by a sound card: the box plays the force and the card the sound, at one moment."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import WrongUse
from harness.basics.resampling import resample
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.station_file import Station
from mocks.daq.strike_counts import StrikeCounts, StrikesOnBox
from mocks.far_ends import LabBench
from mocks.faults import Fault
from mocks.lab_processes import FarEnd
from mocks.shared_pose import Firing
from mocks.sound_card.card import SoundCard
from mocks.sound_card.player import MEANWHILE

NOISE = -110.0
"""dB of full scale, rms: a converter of 24 bits as sound cards have them."""


@dataclass(frozen=True)
class CardConverter:
    """A converter as it is, which a calibration only approximates."""

    counts_per_pascal: float  #: of microphone, preamplifier and converter.
    offset: float  #: counts at rest.
    full_scale: int  #: greatest count; beyond it the converter stays there.

    @classmethod
    def of(cls, calibration: AcquisitionCalibration) -> "CardConverter":
        """The converter that a calibration of a microphone on a sound card speaks of."""
        return cls(
            1.0 / calibration.pascals_per_count,
            calibration.microphone_offset,
            calibration.microphone_full_scale_counts,
        )

    def counts(self, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """``(t,)`` int32 of ``(t,)`` Pa."""
        own = self.full_scale * 10.0 ** (NOISE / 20.0) * noise.standard_normal(len(pressure))
        wanted = np.rint(pressure * self.counts_per_pascal + self.offset + own)
        clipped: AnyArray = np.clip(wanted, -self.full_scale - 1, self.full_scale).astype(np.int32)
        return clipped


AHEAD = 0.3
"""s from when a strike is computed to when it begins: a sound card asks for its samples that early."""

_WORD = 32
_IDLE = 2.0


@dataclass(frozen=True)
class Wire:
    """How a sound card is wired."""

    rate: int  #: samples a second.
    channels: int  #: of the card.
    channel: int  #: with the microphone.
    converter: CardConverter  #: of that channel.
    sound_rate: float  #: Hz, at which the world makes its sound.

    def samples(self, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """``(n, channels)`` int32 of ``(t,)`` Pa: their upper bits are the converter's counts."""
        count = int((len(pressure) - 1) / self.sound_rate * self.rate)
        heard = resample(pressure, 0.0, self.sound_rate, np.arange(count) / self.rate, float(self.rate))
        counts = self.converter.counts(heard, noise)
        shift = _WORD - 1 - int(self.converter.full_scale).bit_length()
        played = np.zeros((len(counts), self.channels), np.int32)
        played[:, self.channel] = np.left_shift(counts, shift)
        return played


class PluggedCard:
    """A sound card, playing, with the station's microphone on it; a ``FarEnd``.

    Args:
        station: with a microphone of its own.
        folder: in which the card makes its own.

    Raises:
        BenchFault: no sound card can be mocked on this computer, and why.
        WrongUse: the station's microphone is on the hammer's box, or there is no hammer.
    """

    faults = ("unplug",)  #: the card is taken away, for good.

    def __init__(self, station: Station, folder: Path) -> None:
        section, hammer = station.own_microphone, station.hammer
        if section is None or hammer is None:
            raise WrongUse(f"the station {station.title!r} has no microphone on a sound card; none is mocked")
        channels, rate = section.channels or 1, round(section.rate or 0.0)
        self.card = SoundCard(rate, channels, under=folder)
        self.card.start()
        converter = CardConverter.of(hammer.acquisition)
        self.wire = Wire(rate, channels, section.channel or 0, converter, hammer.rate)
        self.address = self.card.microphone
        self.environment = self.card.environment

    def wait_ready(self, timeout: float) -> None:
        """Nothing to wait for: it plays once it is made."""

    def cue(self, _fault: Fault) -> None:
        """Take the card away."""
        self.card.unplug()

    def kill(self) -> None:
        """End its processes."""
        self.card.stop()


def start_microphone(_name: str, lab: LabBench) -> FarEnd:
    """Plug in a sound card with the station's microphone."""
    return PluggedCard(lab.station, lab.folder)


class StrikesOnCard(StrikesOnBox):
    """Samples of inputs 0 and 1 of the hammer's box, while the card plays the microphone's sound.

    A strike begins on both at one scan of the box, ``AHEAD`` s after it was computed.

    Args:
        strikes: of the run, the box's input 1 being shorted.
        firing: the newest firing.
        card: that plays.
        wire: of the card.
        scans: number of a scan of the box, its bench time in s, and scans a second; of now.
    """

    def __init__(
        self,
        strikes: StrikeCounts,
        firing: Callable[[], Firing],
        card: SoundCard,
        wire: Wire,
        scans: Callable[[], tuple[int, float, float]],
    ) -> None:
        super().__init__(strikes, firing)
        self._card = card
        self._wire = wire
        self._scans = scans

    def begin(self) -> None:
        """Let the card play what is always heard."""
        quiet = self._strikes.sound.idle(_IDLE)
        noise = self._strikes.sound.converter_noise(-1, -1).spawn(1)[0]
        self._card.play(self._wire.samples(quiet, noise), MEANWHILE)

    def _strike(self, firing: Firing) -> None:
        sound = self._strikes.sound
        truth = sound.strike(firing.base_from_flange, firing.step, firing.sample)
        record = self._strikes.read(truth, firing.step, firing.sample)
        noise = sound.converter_noise(firing.step, firing.sample).spawn(1)[0]
        samples = self._wire.samples(truth.pressure, noise)
        number, time, rate = self._scans()
        begin = number + int(np.ceil((now() + AHEAD - time) * rate))
        self._playing = begin, record
        self._card.play(samples, time + (begin - number) / rate)
