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
    """The answer of a run, for its last contact. Lengths in metres; None where unknown.

    Attributes:
        position: ``(3,)`` in the object's frame.
        seconds: the estimate took, from recorded readings to this answer.
        credible90: radius about the answer that holds 90 % of the posterior.
        error: straight-line distance to the true contact.
        error_symmetric: the same, the least over the object's rotations.
        error_mean: mean error over all contacts of the run.
        random_baseline: expected error of a random point of the surface.
        geometry_baseline: error of the relative translations alone.
        modes: how many separate places stay likely; more than 1 is an ambiguous answer.
    """

    position: FloatArray
    seconds: float
    credible90: float | None = None
    error: float | None = None
    error_symmetric: float | None = None
    error_mean: float | None = None
    random_baseline: float | None = None
    geometry_baseline: float | None = None
    modes: int = 1


@dataclass(frozen=True, eq=False)
class ContactRow:
    """One press.

    Attributes:
        number: from 1.
        step: name of the step in the recording.
        live: ``(rows, columns, 3)`` uint8 RGB, what the sensor saw.
        simulated: the same shape and type at the estimated contact.
        live_height: ``(rows, columns)`` metres of indentation, from the live image.
        simulated_height: ``(rows, columns)`` metres at the estimated contact.
        object_from_gel: ``(4, 4)``, where the estimate puts the sensor.
        posterior: after this contact and all before it.
        truth: ``(3,)`` metres, or None.
        error: metres of this contact's answer, or None.
        flags: "slipped", "missed", "repeated" and the like, with what was done about it.
        notes: other facts, as (name, value with unit).
    """

    number: int
    step: str
    live: AnyArray | Missing
    simulated: AnyArray | Missing
    live_height: FloatArray | Missing
    simulated_height: FloatArray | Missing
    object_from_gel: FloatArray | Missing
    posterior: Posterior | Missing
    truth: FloatArray | None = None
    error: float | None = None
    flags: tuple[str, ...] = ()
    notes: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, eq=False)
class BenchPart:
    """A body in the picture of the bench.

    Attributes:
        mesh: metres, in its own frame.
        base_from_part: ``(4, 4)``.
        colour: red, green, blue from 0 to 1.
        smooth: shade over edges of less than 35 degrees.
    """

    mesh: Mesh
    base_from_part: FloatArray
    colour: tuple[float, float, float]
    smooth: bool = True


@dataclass(frozen=True, eq=False)
class BenchScene:
    """What the picture of the bench shows: its bodies and, in base, the contact frames.

    Attributes:
        parts: bodies; the object among them.
        base_from_gels: ``(n, 4, 4)`` of the contacts, drawn as tool axes.
        focus: ``(3,)`` metres, the point looked at.
    """

    parts: tuple[BenchPart, ...]
    base_from_gels: FloatArray
    focus: FloatArray


@dataclass(frozen=True)
class ErrorCurve:
    """Errors in metres against contacts, or against seconds; the first curve is ours.

    Attributes:
        name: in the legend.
        x: contacts, or seconds.
        error: metres, as many.
        labels: beside each point, or empty.
        by: "both", "touch", "audio", "geometry" or "particle", which has a colour of its own; empty for
            the next of the chart's colours.
    """

    name: str
    x: tuple[float, ...]
    error: tuple[float, ...]
    labels: tuple[str, ...] = ()
    by: str = ""


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
    """An effect of the simulation that ran, or did not, and why.

    Attributes:
        name: what it provides.
        ran: whether it was computed.
        reason: in words.
        calls: how often, None if not counted.
        seconds: total, None if not timed.
        stored: whether it was read from the store of results instead of computed.
    """

    name: str
    ran: bool
    reason: str
    calls: int | None = None
    seconds: float | None = None
    stored: bool = False


@dataclass(frozen=True)
class Observed:
    """A simulated quantity that the scene asked for.

    Attributes:
        name: of the effect that provides it, and of a part of it.
        shape: of the array; what it is where it is none.
        least: of its numbers; None where it has none.
        mean: likewise.
        most: likewise.
    """

    name: str
    shape: str
    least: float | None = None
    mean: float | None = None
    most: float | None = None


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


@dataclass(frozen=True, eq=False)
class ReportData:
    """A run's report.

    Attributes:
        title: what was asked.
        object_name: as the operator calls it.
        material: of the object.
        mesh: the estimator's mesh, metres, object frame.
        mock: whether the far end of every cable was a mock.
        made: date and time of the run, as text.
        command: what was typed.
        recording: where it lies, as text.
        answer: of the last contact.
        contacts: in order.
        bench: for the picture.
        error_by_contact: errors after 1, 2, ... contacts.
        error_by_seconds: errors at levels of accuracy against the seconds they took.
        instruments: one row each.
        calibrations: one row each.
        effects: one row each.
        world: what the mocked world did differently from the estimator's model, by name.
        twin: recorded poses against the rehearsal.
        versions: of packages, by name.
        git: hash of the checkout, with "+" if it was changed.
        sound: what each sense contributed.
        symmetry: the object's, in words.
        accuracy: the chosen levels by knob.
        networks: of the object's ObjectFile, which stood for a simulation.
        warnings: what the operator should know.
        observed: what the scene observes, simulated at the answer.
        agreement: of the readings with a model of the object at the stated pose.
    """

    title: str
    object_name: str
    material: str
    mesh: Mesh
    mock: bool
    made: str
    command: str
    recording: str
    answer: AnswerRow | Missing
    contacts: tuple[ContactRow, ...]
    bench: BenchScene | Missing
    error_by_contact: tuple[ErrorCurve, ...] | Missing
    error_by_seconds: tuple[ErrorCurve, ...] | Missing
    instruments: tuple[InstrumentRow, ...] | Missing
    calibrations: tuple[Artefact, ...] | Missing
    effects: tuple[EffectRun, ...] | Missing
    world: dict[str, str] | Missing
    twin: tuple[TwinDeviation, ...] | Missing
    versions: dict[str, str]
    git: str
    sound: Sound | Missing
    symmetry: str = "not looked for"
    accuracy: dict[str, str] = field(default_factory=dict)
    networks: tuple[NetworkInUse, ...] = ()
    warnings: tuple[str, ...] = ()
    observed: tuple[Observed, ...] = ()
    agreement: Agreement | Missing = field(default_factory=lambda: NOT_COMPARED)
