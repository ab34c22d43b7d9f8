"""Policy of an estimate: refused readings are tried at the default levels, too small errors are widened."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import (
    BLOCK,
    METHOD,
    ROUNDS,
    SAMPLES,
    SPACING,
    Estimate,
    locate,
    needs_images,
)
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.touch.touch import Contact, contact_of
from harness.basics.errors import FitRefused
from harness.bench.gap import BenchErrors
from harness.effects.accuracy import Accuracy
from harness.recording.observation import Observation
from harness.sim.optics.inverse import GelReader, GelReading

RESOLUTION = (SPACING, ROUNDS, SAMPLES, BLOCK)
"""Knobs of how finely readings are compared; neither which senses are used nor how they are simulated."""


@dataclass(frozen=True, eq=False)
class Readings:
    """A run's readings, brought as far as settings share: the gel's surface in each picture."""

    observations: tuple[Observation, ...]  #: the contacts.
    gels: tuple[GelReading, ...]  #: the gel at each contact; none if no setting uses the pictures.
    model: Model  #: the object and the sensor.
    prior: Prior  #: prior of the object's orientation.
    seed: int  #: random seed.

    @property
    def shared(self) -> tuple[float, float]:
        """CPU and wall time in s that reading the pictures took."""
        return sum(gel.seconds[0] for gel in self.gels), sum(gel.seconds[1] for gel in self.gels)

    @property
    def refused_pictures(self) -> dict[int, str]:
        """Reason why a contact's picture is not used, by the contact's index; its height map is zero."""
        return {k: gel.refusal for k, gel in enumerate(self.gels) if gel.refusal}

    @property
    def pictured(self) -> bool:
        """Whether not every picture is refused."""
        return not self.refused_pictures or len(self.refused_pictures) < len(self.observations)

    @property
    def struck(self) -> bool:
        """Whether any contact was."""
        return any(observation.strike is not None for observation in self.observations)

    @property
    def heard(self) -> bool:
        """Whether any contact was struck, and the object has modes to compare its sound with."""
        return self.struck and not self.model.sound_refusal

    def under(self, model: Model) -> "Readings":
        """The same readings, to be compared with another model of the object."""
        return replace(self, model=model)

    def first(self, count: int) -> "Readings":
        """Those of the first contacts alone."""
        return replace(self, observations=self.observations[:count], gels=self.gels[:count])


def read(
    observations: Sequence[Observation], reader: GelReader, model: Model, prior: Prior, seed: int
) -> Readings:
    """Invert the picture of every contact that was not inverted yet.

    Args:
        observations: contacts of a run.
        reader: reader of the gel's pictures.
        model: the object and the sensor.
        prior: prior of the object's orientation.
        seed: random seed.
    """
    gels = tuple(reader.read(each.images) for each in observations)
    return Readings(tuple(observations), gels, model, prior, seed)


def estimate_contacts(
    readings: Readings, accuracy: Accuracy, first: int | None = None, judged: bool = True
) -> tuple[Estimate, ...]:
    """Estimate after each contact from the ``first`` on; after the last alone if ``first`` is None.

    If the residuals of the last one are larger than the bench's stated errors allow, it is estimated again
    under errors so much larger, with a warning. Readings that fit no place at other levels than the default's
    are estimated again at these: a refusal must not depend on the resolution.

    Args:
        readings: readings of the run.
        accuracy: accuracy of the estimates.
        first: number of contacts of the first estimate.
        judged: whether readings that fit no place are refused.

    Raises:
        FitRefused: no place on this object explains the readings, no image shows a contact, or no picture
            of them may be used.
    """
    errors, began = readings.model.errors, time.perf_counter()
    try:
        found = _estimate_under(errors, readings, accuracy, first, judged)
    except FitRefused:
        usual = accuracy.with_({knob.name: knob.default for knob in RESOLUTION})
        if usual.levels == accuracy.levels:
            raise
        lost = time.perf_counter() - began
        found = estimate_contacts(readings, usual, first, judged)
        last = found[-1]
        # The seconds of the refused attempt count with the last one's judging.
        seconds = {**last.seconds, "judge": last.seconds.get("judge", 0.0) + lost}
        doubt = "at the levels asked for no place explained the readings; at the default levels this one does"
        return (*found[:-1], replace(last, seconds=seconds, doubts=(*last.doubts, doubt)))
    factor = found[-1].times_stated if judged and accuracy.of(METHOD) == "grid" else 1.0
    if factor == 1.0:
        return found
    less_sure = replace(readings, prior=readings.prior.times(factor))
    wider = _estimate_under(errors.times(factor), less_sure, accuracy)[-1]
    # The seconds are those of both estimates but for the images.
    before = {stage: took for stage, took in found[-1].seconds.items() if stage != "images"}
    seconds = {stage: took + before.get(stage, 0.0) for stage, took in wider.seconds.items()}
    doubt = (
        f"the readings are {factor:.1f} times further off than the station's [errors] allow, by the fit's "
        "own residuals: the region is that of errors so large; check the bench, or state them"
    )
    return (*found[:-1], replace(wider, seconds=seconds, doubts=(*wider.doubts, doubt)))


def _estimate_under(
    errors: BenchErrors,
    readings: Readings,
    accuracy: Accuracy,
    first: int | None = None,
    judged: bool = True,
) -> tuple[Estimate, ...]:
    noise, images = noise_at(errors), needs_images(accuracy)
    if images and not readings.pictured:
        raise FitRefused(f"no contact's picture may be used; of contact 1: {readings.refused_pictures[0]}")
    pitch, block = readings.model.sensor.pitch, accuracy.of(BLOCK)
    contacts = [Contact(observation.base_from_gel) for observation in readings.observations]
    for index, gel in enumerate(readings.gels if images else ()):
        if not gel.refusal:
            pose = contacts[index].base_from_gel
            contacts[index] = contact_of(pose, gel.height, pitch, block, noise.touch)
    strikes = [observation.strike for observation in readings.observations] if readings.heard else []
    seconds = readings.shared[1] if images else 0.0
    model, prior, seed = readings.model, readings.prior, readings.seed
    return locate(contacts, model, prior, accuracy, noise, seed, first, seconds, strikes, judged)
