"""The readings of a localization in memory, which are answered at any setting."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from experiments.contact_localization.answer import Models, observe, prepare, prior_of, solve
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.baselines import mean_random_error
from experiments.contact_localization.posterior.estimate import SPACING, Estimate, needs_images
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.settings import SIMULATED, needs_sound
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Setting
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.solving import Solved
from harness.experiment.subjects import object_key
from harness.experiment.truth import read_truth
from harness.recording.observation import Observation
from harness.recording.run_folder import RunFiles
from harness.sim.optics.inverse import GelReader, GelReading

SILENT = (
    "what accuracy costs was measured by sound alone, and this run was not heard; measure touch with "
    "`touchstone cost contact-localization --sense touch`"
)
"""Reason why a setting that needs sound is not answered."""


@dataclass(frozen=True, eq=False)
class ContactRun:
    """A recorded run of contact localization as a ``Solver``."""

    observations: tuple[Observation, ...]  #: the contacts.
    reader: GelReader  #: reader of their pictures.
    models: Models  #: models of the object.
    prior: Prior  #: prior of its orientation.
    seed: int  #: random seed of the estimate.
    object: str  #: name that its seconds were measured under.
    truth: Mapping[int, FloatArray]  #: ``(3,)`` m, the true contacts by index; empty if unknown.

    @property
    def true(self) -> FloatArray | None:
        """True position ``(3,)`` in m of the last contact; None if unknown."""
        return self.truth.get(len(self.observations) - 1)

    def first(self, steps: int) -> "ContactRun":
        """Return the run with its first contacts alone."""
        return replace(self, observations=self.observations[:steps])

    def explain_refusal(self, setting: Setting) -> str | None:
        """State why a setting cannot be answered: it needs sound and no contact was struck."""
        struck = any(observation.strike is not None for observation in self.observations)
        return SILENT if needs_sound(setting) and not struck else None

    def prepare(self, setting: Setting) -> None:
        """Compute the object's samples and modes, and load the kernels."""
        prepare(self.models.at(setting), setting)

    def shares_preparation(self, one: Setting, other: Setting) -> bool:
        """State whether the two settings have the same samples and modes, as far as ``one`` needs them."""
        varied = SIMULATED if needs_sound(one) else (TOUCH,)
        simulated = all(one.get(knob.name) == other.get(knob.name) for knob in varied)
        return simulated and one[SPACING.name] == other[SPACING.name]

    def work(self, setting: Setting) -> float:
        """Count the coarse hypotheses on the object as a setting models it."""
        return places_left(self.observations, self.models.at(setting), self.prior)

    @cached_property
    def _gels(self) -> tuple[GelReading, ...]:
        return tuple(self.reader.read(each.images) for each in self.observations)

    def readings(self, setting: Setting) -> Readings:
        """Return the readings that a setting uses, with its model of the object."""
        gels = self._gels if needs_images(setting) else ()
        return Readings(self.observations, gels, self.models.at(setting), self.prior, self.seed)

    def read(self, setting: Setting) -> tuple[float, float]:
        """Invert the pictures if a setting uses them; return CPU and wall time in s of all of them."""
        return self.readings(setting).shared

    def solve(self, setting: Setting) -> Solved[Estimate]:
        """Locate the last contact; a refused answer has the error of a random point."""
        self.prepare(setting)
        readings, true = self.readings(setting), self.true
        solved = solve(readings, setting)
        if solved.found is None:
            return replace(
                solved, error=None if true is None else mean_random_error(readings.model.mesh, true)
            )
        position = solved.found.position_in_object
        error = None if true is None else float(np.linalg.norm(position - true))
        return replace(solved, position=position.tolist(), error=error)


def run_of(files: RunFiles) -> ContactRun:
    """Read a recorded run."""
    truth = read_truth(files.recording)
    return ContactRun(
        observe(files),
        files.gel_reader,
        Models(lambda accuracy: model_of_run(files, accuracy), files.network_levels),
        prior_of(files),
        files.recording.header.seed,
        object_key(files.scene.object.name, files.mesh),
        {} if truth is None else truth.points,
    )


COARSE_SPACING = 8.0e-3
"""Distance in m between the surface's samples: coarse, as counting must be fast compared with an answer."""

_ALL = 10**9
"""Hypotheses: more than there are, so that none is left out of the count."""


def places_left(observations: Sequence[Observation], model: Model, prior: Prior) -> float:
    """The number of coarse hypotheses within the grid's reach, before any image or sound is looked at.

    A mug's handle leaves few, a tray's floor thousands: an answer weighs each by all that was read.

    Args:
        observations: the contacts; only their poses are used.
        model: of the object.
        prior: of its orientation.

    Returns:
        At least 1.
    """
    contacts = [Contact(observation.base_from_gel) for observation in observations]
    search = Search(contacts, model, prior, COARSE_SPACING, noise_at(model.errors))
    everyone = np.arange(len(contacts), dtype=np.int64)
    gels, _, _ = search.places(everyone, 0, most=_ALL)
    return float(max(1, len(gels)))
