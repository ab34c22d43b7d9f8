"""A localization's readings in memory, to be answered at any setting; how it keeps a budget."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.answer import (
    Models,
    observe,
    prepare,
    prior_of,
    solve,
)
from experiments.contact_localization.build_model import model_of_run
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import SPACING, Estimate, needs_images
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.posterior.policy import Readings, read
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import FINEST, SIMULATED, needs_sound
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.bench.scene import SceneFile
from harness.cost.curve import Curve
from harness.cost.file import load
from harness.effects.accuracy import Level, Setting
from harness.effects.sound import EDGE, SHAPES
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.solving import Budgets, Solved
from harness.experiment.subjects import object_key
from harness.experiment.truth import read_truth
from harness.recording.observation import Observation
from harness.recording.run_folder import RunFiles
from harness.sim.optics.inverse import GelReader

SHIPPED = "data/cost.json"

_UNHEARD = (
    "what accuracy costs was measured by sound alone, and this run was not heard; measure touch with "
    "`touchstone cost contact-localization --sense touch`"
)
_NO_OBJECTFILE = (
    "what accuracy costs was measured with networks of ObjectFiles alone, and this scene names none; name "
    "one, or measure without with `touchstone cost contact-localization`"
)


@dataclass(frozen=True, eq=False)
class Run:
    """What an answer is made from."""

    observations: tuple[Observation, ...]  #: of the contacts.
    reader: GelReader  #: reader of their pictures.
    models: Models  #: of the object.
    prior: Prior  #: of its orientation.
    seed: int  #: of the draws.
    object: str  #: the name that its seconds were measured under.
    true: FloatArray | None = None  #: ``(3,)`` metres, the last contact; None where it is not known.

    def unfit(self, setting: Setting) -> str | None:
        """A setting that needs sound does not fit where no contact was struck."""
        heard = any(observation.strike is not None for observation in self.observations)
        return _UNHEARD if needs_sound(setting) and not heard else None

    def prepare(self, setting: Setting) -> None:
        """Make the object's samples and modes, and load the kernels."""
        prepare(self.models.at(setting), setting)

    def prepared_alike(self, one: Setting, other: Setting) -> bool:
        """Whether samples and modes are the same, as far as ``one`` needs them."""
        turned = SIMULATED if needs_sound(one) else (TOUCH,)
        simulated = all(one.get(knob.name) == other.get(knob.name) for knob in turned)
        return simulated and one[SPACING.name] == other[SPACING.name]

    def work(self, setting: Setting) -> float:
        """How much there is to do, whatever the setting: on the object as a setting models it."""
        return places_left(self.observations, self.models.at(setting), self.prior)

    def read(self, setting: Setting) -> Readings:
        """Its readings as a setting takes them."""
        model = self.models.at(setting)
        if needs_images(setting):
            return read(self.observations, self.reader, model, self.prior, self.seed)
        return Readings(self.observations, (), model, self.prior, self.seed)

    def solve(self, readings: Readings, setting: Setting) -> Solved[Estimate]:
        """Its readings, compared with the object as a setting models it."""
        return solve(readings.under(self.models.at(setting)), setting)

    def described(self, solved: Solved[Estimate]) -> dict[str, Any]:
        """The last contact, and how far off it is."""
        position = None if solved.found is None else solved.found.position_in_object
        off = None if position is None or self.true is None else position - self.true
        return {
            "position_m": None if position is None else position.tolist(),
            "error_m": None if off is None else float(np.linalg.norm(off)),
            "refused": solved.refusal,
        }


def run_of(files: RunFiles) -> Run:
    """A recorded run's contacts."""
    recording, truth = files.recording, read_truth(files.recording)
    return Run(
        observe(files),
        files.gel_reader,
        Models(lambda accuracy: model_of_run(files, accuracy), files.network_levels),
        prior_of(files),
        recording.header.seed,
        object_key(files.scene.object.name, files.mesh),
        None if truth is None else truth.points.get(recording.committed - 1),
    )


def shipped_curve() -> Curve:
    """The curve that comes with the program, of another machine or an earlier state of the code."""
    with as_file(files("experiments.contact_localization").joinpath(SHIPPED)) as path:
        return load(Path(path))


def _condition(scene: SceneFile) -> Mapping[str, Level]:
    asked = scene.section(Localization)
    # A real bench has a gap, and a mocked one without is only cheaper to please.
    return {"spacing": asked.spacing, "gap": "default", "yaw": asked.yaw}


def _unfit(scene: SceneFile, setting: Setting) -> str | None:
    if needs_sound(setting) and not scene.sensors.sound:
        return _UNHEARD
    networks = any(setting.get(dial.name, dial.default) != dial.default for dial in (SHAPES, TOUCH))
    return _NO_OBJECTFILE if networks and scene.object.objectfile is None else None


BUDGETS = Budgets(
    solver=run_of,
    finest=FINEST,
    steps=lambda scene: scene.section(Localization).contacts,
    condition=_condition,
    unfit=_unfit,
    # Coarser elements are measured for what they cost in accuracy; they are quicker once an object. Of
    # settings that err alike one of them would be chosen by luck.
    offered=lambda setting: setting.get(EDGE.name, EDGE.default) == EDGE.default,
    shipped=shipped_curve,
)


COARSE_SPACING = 8.0e-3
"""Metres between the surface's samples: coarse, as counting must cost little beside any answer."""

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
