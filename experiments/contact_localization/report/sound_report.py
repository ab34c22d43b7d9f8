"""What the report shows of each sense: three posteriors, the strikes, and what they were heard to say."""

from collections.abc import Sequence

import numpy as np

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.posterior.dials import SPACING
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.report.result import true_points
from experiments.contact_localization.report.sound_pictures import sound_pair
from experiments.contact_localization.sound.evidence import StrikeEvidence, hear
from experiments.contact_localization.sound.likelihood import ModeRow
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.bench.acquisition import Strike
from harness.experiment.experiment import Scored
from harness.report.sound_data import PeakLine, SenseAnswer, Sound, SpectrogramPair, StrikeLine
from harness.report.values import Missing, Posterior

NOT_STRUCK = "not struck"

_EDGE = 0.1
"""Of the greatest force: between its rise to this and its fall to it the hammer touches."""


def sound_of(scored: Scored) -> Sound | Missing:
    """What each sense contributed to a run's answer, or why there is nothing to show."""
    found = scored.found
    if not scored.run.scene.sensors.sound:
        return Missing("the scene called for no sound")
    if found.model.sound_refusal:
        return Missing(found.model.sound_refusal)
    heard = hear(
        [observation.strike for observation in found.observations],
        found.model,
        float(scored.accuracy[SPACING.name]),
        alone=not found.last.gates,
    )
    if heard is None:
        return Missing("no contact was struck")
    evidence = heard.term.evidence
    return Sound(
        senses=_senses(scored),
        strikes=_strikes(found, heard),
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


def _senses(scored: Scored) -> tuple[SenseAnswer, ...]:
    points = true_points(scored)
    true = None if points is None else points[-1]
    return tuple(_sense(name, found, true) for name, found in scored.found.by_sense.items())


def _sense(name: str, found: Estimate | FitRefused, true: FloatArray | None) -> SenseAnswer:
    if isinstance(found, FitRefused):
        return SenseAnswer(name, Missing(str(found)))
    return SenseAnswer(
        name=name,
        posterior=posterior_of(found),
        error=None if true is None else float(np.linalg.norm(found.position_in_object - true)),
        area=found.region.area,
        seconds=sum(found.seconds.values()),
    )


def _strikes(found: Answer, heard: StrikeEvidence) -> tuple[StrikeLine, ...]:
    reasons = dict(zip(heard.struck.tolist(), heard.term.evidence.reasons, strict=True))
    return tuple(
        strike_line(index + 1, observation.strike, reasons.get(index, NOT_STRUCK))
        for index, observation in enumerate(found.observations)
    )


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
    strike, modes, material = found.observations[index].strike, found.model.modes, found.model.material
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
    object_from_base = found.prior.object_from_base(np.array([found.last.yaw]))[0]
    axes = np.array([found.observations[k].base_from_gel[:3, 2] for k in contacts])
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
    return tuple(_peak(row, heard.term.weight) for row in rows)


def _peak(row: ModeRow, weight: float) -> PeakLine:
    return PeakLine(
        frequency=row.frequency,
        damping=row.damping,
        residual=row.residual,
        level=row.level,
        modes=tuple(mode + 1 for mode in row.modes),
        mode_frequency=row.model_frequency if row.modes else None,
        mode_damping=row.model_damping if row.modes else None,
        probability=row.probability,
        nats=row.nats,
        weight=weight,
    )
