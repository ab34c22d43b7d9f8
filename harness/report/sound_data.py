"""What a report shows of sound, and of what each sense contributed, as plain values."""

from dataclasses import dataclass

from harness.basics.arrays import FloatArray
from harness.report.values import Missing, Posterior


@dataclass(frozen=True, eq=False)
class SenseAnswer:
    """The last contact by one sense, or by both.

    Attributes:
        name: "touch", "audio" or "both".
        posterior: by it; where it refused the object, why.
        error: metres from the true contact; None where unknown.
        area: m^2 of the surface that hold 90 % of the posterior.
        seconds: the estimate took.
    """

    name: str
    posterior: Posterior | Missing
    error: float | None = None
    area: float | None = None
    seconds: float | None = None


@dataclass(frozen=True, eq=False)
class SpectrogramPair:
    """A strike as it was heard beside what the model says at the estimated place.

    Attributes:
        contact: whose strike, from 1.
        times: ``(n,)`` s from the strike.
        frequencies: ``(f,)`` Hz.
        recorded: ``(f, n)`` dB against its own loudest.
        simulated: ``(f, n)`` dB against its own loudest.
    """

    contact: int
    times: FloatArray
    frequencies: FloatArray
    recorded: FloatArray
    simulated: FloatArray


@dataclass(frozen=True)
class PeakLine:
    """A peak that the strikes have in common, and the modes it is taken for.

    Attributes:
        frequency: Hz, as heard.
        damping: 1/s, as heard.
        residual: from 0 to 1, share of the peak's band that is not one waveform.
        level: dB against the strongest peak.
        modes: numbers of the matched modes, from 1; empty where no mode explains the peak.
        mode_frequency: Hz, of the matched modes at the common scale; None where there is none.
        mode_damping: 1/s, of the matched modes; None where there is none.
        probability: of the match.
        nats: that the peak adds at the answer, over a peak that says nothing.
        weight: how much of its nats counts in the posterior.
    """

    frequency: float
    damping: float
    residual: float
    level: float
    modes: tuple[int, ...]
    mode_frequency: float | None
    mode_damping: float | None
    probability: float
    nats: float
    weight: float

    @property
    def counted(self) -> float:
        """Nats that the peak adds to the posterior at the answer."""
        return self.weight * self.nats

    @property
    def apart(self) -> float | None:
        """Relative difference of the peak from the matched modes; None where there are none."""
        return None if self.mode_frequency is None else self.frequency / self.mode_frequency - 1.0


@dataclass(frozen=True)
class StrikeLine:
    """One contact's strike.

    Attributes:
        contact: from 1.
        unused: why it does not count; empty where it does.
        force: N, greatest; None where there was no strike.
        contact_time: s between the rise to a tenth of the greatest force and the fall to it.
        pressure: Pa, greatest.
    """

    contact: int
    unused: str
    force: float | None = None
    contact_time: float | None = None
    pressure: float | None = None


@dataclass(frozen=True, eq=False)
class Sound:
    """What each sense contributed to the answer, and what the strikes of a run said.

    Attributes:
        senses: touch, audio and both, in that order.
        strikes: one line a contact.
        pair: of the last strike that counts.
        peaks: by ascending frequency.
        set_aside: peaks that were heard and are not one waveform, or are echoes.
        band: Hz, least and greatest frequency that at least two strikes excited; None where none.
        scale: real frequency over the model's, the most probable one.
    """

    senses: tuple[SenseAnswer, ...]
    strikes: tuple[StrikeLine, ...]
    pair: SpectrogramPair | Missing
    peaks: tuple[PeakLine, ...] | Missing
    set_aside: int = 0
    band: tuple[float, float] | None = None
    scale: float = 1.0
