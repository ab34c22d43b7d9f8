"""The section of a localization's report on its senses: posteriors, strikes and resonances."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from experiments.contact_localization.answer import Answer, ScoredContact
from experiments.contact_localization.posterior.estimate import SPACING, Estimate
from experiments.contact_localization.posterior.strikes import StrikeEvidence, hear
from experiments.contact_localization.report.result import SENSES, true_points
from experiments.contact_localization.sound.likelihood import ModeRow
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.basics.materials import Material
from harness.bench.acquisition import Strike
from harness.experiment.report_content import (
    Bar,
    CaptionedPicture,
    Missing,
    PageBlock,
    PageSection,
    ReportTable,
)
from harness.report.figures.figures import Album
from harness.report.figures.pictures import Posterior, Sides, close_up
from harness.report.figures.sound import senses_figure, spectrogram_pair
from harness.report.wording import NONE, duration
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_sound import radiation, ring
from harness.strikes.spectra import Analysis

NOT_STRUCK = "not struck"

_EDGE = 0.1
"""Fraction of the greatest force; the hammer touches between the rise to it and the fall to it."""

_MIN_WIDTH = 0.03
"""Width in m of the close-up of the object."""

_CLOSE_UP_PIXELS = 460


def gather_strikes(scored: ScoredContact) -> StrikeEvidence | Missing:
    """Return the evidence of a run's strikes, or the reason why there is none."""
    found = scored.found
    if not scored.run.scene.sensors.sound:
        return Missing("the scene called for no sound")
    if found.readings.model.sound_refusal:
        return Missing(found.readings.model.sound_refusal)
    strike_evidence = hear(
        [observation.strike for observation in found.readings.observations],
        found.readings.model,
        float(scored.accuracy[SPACING.name]),
        alone=not found.last.gates,
    )
    return Missing("no contact was struck") if strike_evidence is None else strike_evidence


def show_senses(
    scored: ScoredContact, object_from_gel: FloatArray, sides: Sides, album: Album
) -> Iterator[PageBlock]:
    """Show the contribution of each sense to a run's answer, or the reason why there is none.

    Args:
        scored: the run and its answer.
        object_from_gel: ``(4, 4)`` estimated gel pose of the last contact.
        sides: views of the object.
        album: album of the page.
    """
    strike_evidence = gather_strikes(scored)
    if isinstance(strike_evidence, Missing):
        yield strike_evidence
        return
    found, true = scored.found, true_points(scored)
    truth, by_sense = None if true is None else true[-1], found.by_sense
    # The close-up spans the area that every sense's posterior covers, and at most the object.
    answer, mesh = found.last.position_in_object, scored.run.mesh
    extents = [
        one.credible90 + float(np.linalg.norm(one.position_in_object - answer))
        for one in by_sense.values()
        if isinstance(one, Estimate)
    ]
    across = min(max(_MIN_WIDTH, 3.0 * max(extents, default=0.0)), mesh.diagonal)
    near = close_up(mesh, answer, -object_from_gel[:3, 2], across, _CLOSE_UP_PIXELS)
    posteriors = {
        SENSES[sense]: posterior_of(one) if isinstance(one, Estimate) else Missing(str(one))
        for sense, one in by_sense.items()
    }
    yield CaptionedPicture(
        album.photograph("senses", senses_figure((*sides.shots, near), posteriors, truth)),
        "The posterior of the last contact after all contacts: from the tactile images, from the sound of "
        "the strikes, and from both; first row from the side of the answer, second row from the opposite "
        f"side, third row close up, {1e3 * across:.0f} mm across, along the tool. All three use the tool "
        f"poses. Blue cross: the answer of the sense{'.' if truth is None else '; green star: the truth.'}",
    )
    for sense, one in by_sense.items():
        if isinstance(one, FitRefused):
            yield Missing(f"no answer from {SENSES[sense]}: {one}")
    yield PageSection("Strikes", tuple(_strikes(found, strike_evidence, album)))
    yield PageSection("Peaks and modes", tuple(_peaks(found, strike_evidence)))


def posterior_of(estimate: Estimate) -> Posterior:
    """Return the hypotheses of an estimate's last contact, for pictures."""
    return Posterior(
        estimate.points,
        estimate.weights,
        estimate.position_in_object,
        np.array([mode.position for mode in estimate.modes]).reshape(-1, 3),
        np.array([mode.weight for mode in estimate.modes]),
        estimate.credible90,
    )


def _strikes(found: Answer, strike_evidence: StrikeEvidence, album: Album) -> Iterator[PageBlock]:
    evidence = strike_evidence.term.evidence
    reasons = dict(zip(strike_evidence.struck.tolist(), evidence.reasons, strict=True))
    strikes = [observation.strike for observation in found.readings.observations]
    summary = f"{int(evidence.used.sum())} of {len(strikes)} strikes count"
    if evidence.band[1] > 0.0:
        low, high = 1e-3 * np.array(evidence.band)
        summary += f"; together they excite {low:.1f} to {high:.1f} kHz"
    yield f"{summary}."
    rows = [
        format_strike(index + 1, strike, reasons.get(index, NOT_STRUCK))
        for index, strike in enumerate(strikes)
    ]
    headings = ("contact", "strike", "greatest force", "contact time", "greatest pressure")
    yield ReportTable(headings, rows, "llrrr")
    pair = pair_spectrograms(found, strike_evidence)
    if isinstance(pair, Missing):
        yield pair
        return
    contact, recorded, simulated = pair
    figure = spectrogram_pair(recorded.times, recorded.frequencies, recorded.levels, simulated.levels)
    yield CaptionedPicture(
        album.photograph("spectrograms", figure),
        f"The strike of contact {contact} as recorded, as the model rings at the estimated position under "
        "the recorded force, and the difference. Each is relative to its own loudest. The model has neither "
        "the room nor the microphone's noise, which remain between the lines.",
    )


def format_strike(contact: int, strike: Strike | None, unused: str) -> tuple[str, ...]:
    """Return the row of a strike: peak force, contact time and peak pressure.

    Args:
        contact: number of the contact, from 1.
        strike: evidence of the strike; None if the contact was not struck.
        unused: reason why the strike is not used; empty if it is.
    """
    state = f"not used: {unused}" if unused else "used"
    if strike is None or strike.silent:
        return (str(contact), state, NONE, NONE, NONE)
    return (
        str(contact),
        state,
        f"{float(strike.force.max()):.3g} N",
        duration(contact_time(strike.force, strike.rate)),
        f"{float(np.abs(strike.pressure).max()):.3g} Pa",
    )


def contact_time(force: FloatArray, rate: float) -> float:
    """Seconds about the greatest of ``(t,)`` N for which it stays above a tenth, between samples by lines.

    What touches longer than the recording lasts is counted to its end.
    """
    top = int(np.argmax(force))
    level = _EDGE * float(force[top])
    return (_until(force[top:], level) + _until(force[top::-1], level)) / rate


def _until(falling: FloatArray, level: float) -> float:
    """Samples until a force that starts above a level falls to it."""
    below = np.flatnonzero(falling <= level)
    if not len(below):
        return float(len(falling) - 1)
    after = int(below[0])
    drop = float(falling[after - 1] - falling[after])
    return after - 1 + float(falling[after - 1] - level) / drop


def pair_spectrograms(
    found: Answer, strike_evidence: StrikeEvidence
) -> tuple[int, "Spectrogram", "Spectrogram"] | Missing:
    """Return the last contact with a usable strike, and its spectrograms as recorded and as modelled."""
    counted = strike_evidence.struck[strike_evidence.term.evidence.used]
    if not len(counted):
        return Missing("no strike counts")
    index = int(counted[-1])
    strike, model = found.readings.observations[index].strike, found.readings.model
    if strike is None or model.modes is None or model.material is None:
        return Missing("the object has no modes")
    direction, factor = _directions(found, [index])[0], estimate_sound_scale(found, strike_evidence)
    point = found.last.contacts[index]
    return (index + 1, *sound_pair(strike, model.modes, model.material, point, direction, factor))


def estimate_sound_scale(found: Answer, strike_evidence: StrikeEvidence) -> float:
    """Estimate the ratio of the object's frequencies to the model's at the answer."""
    struck = [int(k) for k in strike_evidence.struck]
    return strike_evidence.term.scale_at(found.last.contacts[struck], _directions(found, struck))


def _directions(found: Answer, contacts: Sequence[int]) -> FloatArray:
    """Return the ``(K, 3)`` unit directions of the hammer in the object's frame at the answer's yaw."""
    object_from_base = found.readings.prior.object_from_base(np.array([found.last.yaw]))[0]
    axes = np.array([found.readings.observations[k].base_from_gel[:3, 2] for k in contacts])
    return np.asarray(axes @ object_from_base.T)


def match_peaks(found: Answer, strike_evidence: StrikeEvidence) -> tuple[ModeRow, ...] | Missing:
    """Match the common resonances of the strikes to the modes at the answer."""
    evidence = strike_evidence.term.evidence
    if int(evidence.used.sum()) < 2:
        return Missing(
            "fewer than two strikes count, and one does not separate the object from room and microphone"
        )
    if not evidence.peaks:
        return Missing("the strikes have no resonance in common")
    return strike_evidence.term.mode_table(
        found.last.contacts[strike_evidence.struck], _directions(found, strike_evidence.struck.tolist())
    )


_PEAK_HEADINGS = (
    *("peak", "level", "modes", "model", "difference", "match"),
    *("damping", "model damping", "residual"),
)


def _peaks(found: Answer, strike_evidence: StrikeEvidence) -> Iterator[PageBlock]:
    peaks, factor = match_peaks(found, strike_evidence), estimate_sound_scale(found, strike_evidence)
    if isinstance(peaks, Missing):
        yield peaks
        return
    matched, rejected = sum(bool(peak.modes) for peak in peaks), len(strike_evidence.term.evidence.rejected)
    yield (
        f"{len(peaks)} {'resonance' if len(peaks) == 1 else 'resonances'} in common, {matched} of them "
        "matched to modes"
        + (f", and {rejected} more rejected as echoes or as more than one waveform" if rejected else "")
        + f". The object rings {100.0 * abs(factor - 1.0):.1f} % {'above' if factor >= 1.0 else 'below'} its "
        "model."
    )
    yield (
        "Each peak is shown with the modes that explain it at the answer. The log-likelihood ratio compares "
        "it with an uninformative peak; the weight accounts for errors that neighbouring peaks share. Bars "
        "are to scale; pale bars speak against the answer."
    )
    weight = strike_evidence.term.weight
    longest = max(abs(weight * peak.nats) for peak in peaks)
    yield ReportTable(
        (*_PEAK_HEADINGS, "log-likelihood ratio", ""),
        [
            (
                *format_peak(peak, weight),
                Bar(100.0 * abs(weight * peak.nats) / (longest or 1.0), peak.nats < 0.0),
            )
            for peak in peaks
        ],
        "rrrrrrrrrrl",
    )


def format_peak(peak: ModeRow, weight: float) -> tuple[str, ...]:
    """Return the row of a peak and its matched modes; ``weight`` is the weight of its likelihood ratio."""
    numbers = [str(mode + 1) for mode in peak.modes]
    model = (NONE, NONE, NONE)
    if peak.modes:
        model = (
            f"{peak.model_frequency:.5g} Hz",
            f"{100.0 * (peak.frequency / peak.model_frequency - 1.0):+.2f} %",
            f"{peak.model_damping:.3g} 1/s",
        )
    return (
        f"{peak.frequency:.5g} Hz",
        f"{peak.level:.0f} dB",
        " to ".join(dict.fromkeys((numbers[0], numbers[-1]))) if numbers else "none",
        *model[:2],
        f"{100 * peak.probability:.0f} %",
        f"{peak.damping:.3g} 1/s",
        model[2],
        f"{100 * peak.residual:.1f} %",
        f"{peak.nats:+.2f} at weight {weight:g}",
    )


_FRAME = 0.02
_HOP = 0.004
_LASTING = 0.4
_HIGHEST = 12_000.0
_QUIETEST = -90.0
_DISTANCE = 0.3


@dataclass(frozen=True, eq=False)
class Spectrogram:
    """Levels of a sound over time and frequency."""

    times: FloatArray  #: ``(n,)`` s from the strike, the middle of each frame.
    frequencies: FloatArray  #: ``(f,)`` Hz.
    levels: FloatArray  #: ``(f, n)`` dB against the loudest, down to -90.
    loudest: float  #: Pa, rms of the loudest line.


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
) -> tuple[Spectrogram, Spectrogram]:
    """Return the sound of a strike as recorded, and as simulated with its force at a point of the model.

    The simulation has no room and no microphone; its level at 0.3 m is an upper bound.

    Args:
        strike: recorded strike.
        modes: modes of the object.
        material: material, for its damping.
        point: ``(3,)`` m, struck point in the object's frame.
        direction: ``(3,)`` unit direction of the strike.
        factor: estimated ratio of the object's frequencies to the model's.
    """
    frequencies = factor * modes.frequencies
    amplitudes = modes.gains(point[None], direction[None]) * radiation(modes, _DISTANCE)
    # What the cell says after the blow is its own noise, which would ring the modes for ever.
    force = strike.force[strike.onset :].copy()
    force[round(Analysis().pulse * strike.rate) :] = 0.0
    rung = ring(frequencies, dampings(frequencies, material), amplitudes, force[None], strike.rate)[0]
    recorded = spectrogram(strike.pressure[strike.onset :], strike.rate)
    return recorded, spectrogram(rung, strike.rate)
