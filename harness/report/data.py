"""All that a report shows, as plain values: the page is a pure function of these."""

from dataclasses import dataclass, field

from harness.agreement.agreement import Agreement
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.effects.explain import NetworkInUse
from harness.report.values import Missing, Posterior

NOT_COMPARED = Missing("the readings were not compared with a model")
"""Why a report has no part that compares them."""


@dataclass(frozen=True, eq=False)
class AnswerRow:
    """The answer of a run, for its last contact. Lengths in metres; None where unknown."""

    position: FloatArray  #: ``(3,)`` in the object's frame.
    seconds: float  #: the estimate took, from recorded readings to this answer.
    credible90: float | None = None  #: radius about the answer that holds 90 % of the posterior.
    error: float | None = None  #: straight-line distance to the true contact.
    error_symmetric: float | None = None  #: the same, the least over the object's rotations.
    error_mean: float | None = None  #: mean error over all contacts of the run.
    random_baseline: float | None = None  #: expected error of a random point of the surface.
    geometry_baseline: float | None = None  #: error of the relative translations alone.
    modes: int = 1  #: how many separate places stay likely; more than 1 is an ambiguous answer.


@dataclass(frozen=True, eq=False)
class ContactRow:
    """One press."""

    number: int  #: from 1.
    step: str  #: name of the step in the recording.
    live: AnyArray | Missing  #: ``(rows, columns, 3)`` uint8 RGB, what the sensor saw.
    simulated: AnyArray | Missing  #: the same shape and type at the estimated contact.
    live_height: FloatArray | Missing  #: ``(rows, columns)`` metres of indentation, from the live image.
    simulated_height: FloatArray | Missing  #: ``(rows, columns)`` metres at the estimated contact.
    object_from_gel: FloatArray | Missing  #: ``(4, 4)``, where the estimate puts the sensor.
    posterior: Posterior | Missing  #: after this contact and all before it.
    truth: FloatArray | None = None  #: ``(3,)`` metres, or None.
    error: float | None = None  #: metres of this contact's answer, or None.
    flags: tuple[str, ...] = ()  #: "slipped", "missed", "repeated" and the like, with what was done about it.
    notes: tuple[tuple[str, str], ...] = ()  #: other facts, as (name, value with unit).


@dataclass(frozen=True, eq=False)
class BenchPart:
    """A body in the picture of the bench."""

    mesh: Mesh  #: metres, in its own frame.
    base_from_part: FloatArray  #: ``(4, 4)``.
    colour: tuple[float, float, float]  #: red, green, blue from 0 to 1.
    smooth: bool = True  #: shade over edges of less than 35 degrees.


@dataclass(frozen=True, eq=False)
class BenchScene:
    """What the picture of the bench shows: its bodies and, in base, the contact frames."""

    parts: tuple[BenchPart, ...]  #: bodies; the object among them.
    base_from_gels: FloatArray  #: ``(n, 4, 4)`` of the contacts, drawn as tool axes.
    focus: FloatArray  #: ``(3,)`` metres, the point looked at.


@dataclass(frozen=True)
class ErrorCurve:
    """Errors in metres against contacts, or against seconds; the first curve is ours."""

    name: str  #: in the legend.
    x: tuple[float, ...]  #: contacts, or seconds.
    error: tuple[float, ...]  #: metres, as many.
    labels: tuple[str, ...] = ()  #: beside each point, or empty.
    by: str = ""
    """"both", "touch", "audio", "geometry" or "particle", which has a colour of its own; empty for the next
    of the chart's colours."""


@dataclass(frozen=True)
class InstrumentRow:
    """How one instrument did during the run. Rates in Hz, times in seconds."""

    name: str
    address: str
    rate: float | None
    nominal_rate: float | None
    readings: int
    drops: int | None
    latency_median: float | None
    remark: str = ""


@dataclass(frozen=True)
class Artefact:
    """A calibration artefact the run relied on."""

    name: str
    serial: str
    made: str
    age_days: float
    residual: str
    sha256: str


@dataclass(frozen=True)
class EffectRun:
    """An effect of the simulation that ran, or did not, and why."""

    name: str  #: what it provides.
    ran: bool  #: whether it was computed.
    reason: str  #: in words.
    calls: int | None = None  #: how often, None if not counted.
    seconds: float | None = None  #: total, None if not timed.
    stored: bool = False  #: whether it was read from the store of results instead of computed.


@dataclass(frozen=True)
class Observed:
    """A simulated quantity that the scene asked for."""

    name: str  #: of the effect that provides it, and of a part of it.
    shape: str  #: of the array; what it is where it is none.
    least: float | None = None  #: of its numbers; None where it has none.
    mean: float | None = None  #: likewise.
    most: float | None = None  #: likewise.


@dataclass(frozen=True)
class TwinDeviation:
    """Recorded against rehearsed poses of one step: metres and radians."""

    step: str
    position_mean: float
    position_max: float
    angle_max: float
    contact_point: float | None = None


@dataclass(frozen=True, eq=False)
class SenseAnswer:
    """The last contact by one sense, or by both."""

    name: str  #: "touch", "audio" or "both".
    posterior: Posterior | Missing  #: by it; where it refused the object, why.
    error: float | None = None  #: metres from the true contact; None where unknown.
    area: float | None = None  #: m^2 of the surface that hold 90 % of the posterior.
    seconds: float | None = None  #: the estimate took.


@dataclass(frozen=True, eq=False)
class SpectrogramPair:
    """A strike as it was heard beside what the model says at the estimated place."""

    contact: int  #: whose strike, from 1.
    times: FloatArray  #: ``(n,)`` s from the strike.
    frequencies: FloatArray  #: ``(f,)`` Hz.
    recorded: FloatArray  #: ``(f, n)`` dB against its own loudest.
    simulated: FloatArray  #: ``(f, n)`` dB against its own loudest.


@dataclass(frozen=True)
class PeakLine:
    """A peak that the strikes have in common, and the modes it is taken for."""

    frequency: float  #: Hz, as heard.
    damping: float  #: 1/s, as heard.
    residual: float  #: from 0 to 1, share of the peak's band that is not one waveform.
    level: float  #: dB against the strongest peak.
    modes: tuple[int, ...]  #: numbers of the matched modes, from 1; empty where no mode explains the peak.
    mode_frequency: float | None  #: Hz, of the matched modes at the common scale; None where there is none.
    mode_damping: float | None  #: 1/s, of the matched modes; None where there is none.
    probability: float  #: of the match.
    nats: float  #: that the peak adds at the answer, over a peak that says nothing.
    weight: float  #: how much of its nats counts in the posterior.

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
    """One contact's strike."""

    contact: int  #: from 1.
    unused: str  #: why it does not count; empty where it does.
    force: float | None = None  #: N, greatest; None where there was no strike.
    contact_time: float | None = None
    """s between the rise to a tenth of the greatest force and the fall to it."""
    pressure: float | None = None  #: Pa, greatest.


@dataclass(frozen=True, eq=False)
class Sound:
    """What each sense contributed to the answer, and what the strikes of a run said."""

    senses: tuple[SenseAnswer, ...]  #: touch, audio and both, in that order.
    strikes: tuple[StrikeLine, ...]  #: one line a contact.
    pair: SpectrogramPair | Missing  #: of the last strike that counts.
    peaks: tuple[PeakLine, ...] | Missing  #: by ascending frequency.
    set_aside: int = 0  #: peaks that were heard and are not one waveform, or are echoes.
    band: tuple[float, float] | None = None
    """Hz, least and greatest frequency that at least two strikes excited; None where none."""
    scale: float = 1.0  #: real frequency over the model's, the most probable one.


@dataclass(frozen=True, eq=False)
class ReportData:
    """A run's report."""

    title: str  #: what was asked.
    object_name: str  #: as the operator calls it.
    material: str  #: of the object.
    mesh: Mesh  #: the estimator's mesh, metres, object frame.
    mock: bool  #: whether the far end of every cable was a mock.
    made: str  #: date and time of the run, as text.
    command: str  #: what was typed.
    recording: str  #: where it lies, as text.
    answer: AnswerRow | Missing  #: of the last contact.
    contacts: tuple[ContactRow, ...]  #: in order.
    bench: BenchScene | Missing  #: for the picture.
    error_by_contact: tuple[ErrorCurve, ...] | Missing  #: errors after 1, 2, ... contacts.
    error_by_seconds: tuple[ErrorCurve, ...] | Missing
    """errors at levels of accuracy against the seconds they took."""
    instruments: tuple[InstrumentRow, ...] | Missing  #: one row each.
    calibrations: tuple[Artefact, ...] | Missing  #: one row each.
    effects: tuple[EffectRun, ...] | Missing  #: one row each.
    world: dict[str, str] | Missing
    """what the mocked world did differently from the estimator's model, by name."""
    twin: tuple[TwinDeviation, ...] | Missing  #: recorded poses against the rehearsal.
    versions: dict[str, str]  #: of packages, by name.
    git: str  #: hash of the checkout, with "+" if it was changed.
    sound: Sound | Missing  #: what each sense contributed.
    symmetry: str = "not looked for"  #: the object's, in words.
    accuracy: dict[str, str] = field(default_factory=dict)  #: the chosen levels by knob.
    networks: tuple[NetworkInUse, ...] = ()  #: of the object's ObjectFile, which stood for a simulation.
    warnings: tuple[str, ...] = ()  #: what the operator should know.
    observed: tuple[Observed, ...] = ()  #: what the scene observes, simulated at the answer.
    agreement: Agreement | Missing = field(default_factory=lambda: NOT_COMPARED)
    """of the readings with a model of the object at the stated pose."""
