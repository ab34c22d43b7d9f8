"""What the report shows of each sense: three posteriors, the strikes, and what they were heard to say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from experiments.contact_localization.answer import Answer, ScoredContact
from experiments.contact_localization.posterior.estimate import SPACING, Estimate
from experiments.contact_localization.posterior.strikes import StrikeEvidence, hear
from experiments.contact_localization.report.result import true_points
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.basics.materials import Material
from harness.bench.acquisition import Strike
from harness.report.data import PeakLine, SenseAnswer, Sound, SpectrogramPair, StrikeLine
from harness.report.values import Missing, Posterior
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_sound import radiation, ring
from harness.strikes.spectra import Analysis

NOT_STRUCK = "not struck"

_EDGE = 0.1
"""Of the greatest force: between its rise to this and its fall to it the hammer touches."""


def sound_of(scored: ScoredContact) -> Sound | Missing:
    """What each sense contributed to a run's answer, or why there is nothing to show."""
    found = scored.found
    if not scored.run.scene.sensors.sound:
        return Missing("the scene called for no sound")
    if found.readings.model.sound_refusal:
        return Missing(found.readings.model.sound_refusal)
    heard = hear(
        [observation.strike for observation in found.readings.observations],
        found.readings.model,
        float(scored.accuracy[SPACING.name]),
        alone=not found.last.gates,
    )
    if heard is None:
        return Missing("no contact was struck")
    evidence = heard.term.evidence
    reasons = dict(zip(heard.struck.tolist(), evidence.reasons, strict=True))
    return Sound(
        senses=_senses(scored),
        strikes=tuple(
            strike_line(index + 1, observation.strike, reasons.get(index, NOT_STRUCK))
            for index, observation in enumerate(found.readings.observations)
        ),
        pair=_pair(found, heard),
        peaks=_peaks(found, heard),
        set_aside=len(evidence.rejected),
        band=evidence.band if evidence.band[1] > 0.0 else None,
        scale=_scale(found, heard),
    )


def posterior_of(estimate: Estimate) -> Posterior:
    """The hypotheses of an estimate's last contact, for pictures."""
    return Posterior(
        estimate.points,
        estimate.weights,
        estimate.position_in_object,
        np.array([mode.position for mode in estimate.modes]).reshape(-1, 3),
        np.array([mode.weight for mode in estimate.modes]),
        estimate.credible90,
    )


def _senses(scored: ScoredContact) -> tuple[SenseAnswer, ...]:
    true, answers = true_points(scored), []
    for name, found in scored.found.by_sense.items():
        if isinstance(found, FitRefused):
            answers.append(SenseAnswer(name, Missing(str(found))))
            continue
        error = None if true is None else float(np.linalg.norm(found.position_in_object - true[-1]))
        seconds = sum(found.seconds.values())
        answers.append(SenseAnswer(name, posterior_of(found), error, found.region.area, seconds))
    return tuple(answers)


def strike_line(contact: int, strike: Strike | None, unused: str) -> StrikeLine:
    """One strike in numbers.

    Args:
        contact: from 1.
        strike: None where the contact was not struck.
        unused: why it does not count; empty where it does.
    """
    if strike is None or strike.silent:
        return StrikeLine(contact, unused)
    return StrikeLine(
        contact,
        unused,
        float(strike.force.max()),
        contact_time(strike.force, strike.rate),
        float(np.abs(strike.pressure).max()),
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


def _pair(found: Answer, heard: StrikeEvidence) -> SpectrogramPair | Missing:
    counted = heard.struck[heard.term.evidence.used]
    if not len(counted):
        return Missing("no strike counts")
    index = int(counted[-1])
    strike, model = found.readings.observations[index].strike, found.readings.model
    modes, material = model.modes, model.material
    assert strike is not None
    assert modes is not None
    assert material is not None
    direction = _directions(found, [index])[0]
    factor = _scale(found, heard)
    pair = sound_pair(strike, modes, material, found.last.contacts[index], direction, factor)
    recorded, simulated = pair.recorded, pair.simulated
    return SpectrogramPair(index + 1, recorded.times, recorded.frequencies, recorded.levels, simulated.levels)


def _scale(found: Answer, heard: StrikeEvidence) -> float:
    """Of the object's frequencies over the model's, as the places of the answer have it."""
    struck = [int(k) for k in heard.struck]
    return heard.term.scale_at(found.last.contacts[struck], _directions(found, struck))


def _directions(found: Answer, contacts: Sequence[int]) -> FloatArray:
    """``(K, 3)`` unit, in the object's frame: where the hammer went, under the answer's yaw."""
    object_from_base = found.readings.prior.object_from_base(np.array([found.last.yaw]))[0]
    axes = np.array([found.readings.observations[k].base_from_gel[:3, 2] for k in contacts])
    return np.asarray(axes @ object_from_base.T)


def _peaks(found: Answer, heard: StrikeEvidence) -> tuple[PeakLine, ...] | Missing:
    evidence = heard.term.evidence
    if int(evidence.used.sum()) < 2:
        return Missing(
            "fewer than two strikes count, and one alone cannot be told from the response of room and "
            "microphone"
        )
    if not evidence.peaks:
        return Missing("the strikes have no resonance in common")
    rows = heard.term.mode_table(found.last.contacts[heard.struck], _directions(found, heard.struck.tolist()))
    return tuple(
        PeakLine(
            frequency=row.frequency,
            damping=row.damping,
            residual=row.residual,
            level=row.level,
            modes=tuple(mode + 1 for mode in row.modes),
            mode_frequency=row.model_frequency if row.modes else None,
            mode_damping=row.model_damping if row.modes else None,
            probability=row.probability,
            nats=row.nats,
            weight=heard.term.weight,
        )
        for row in rows
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
