"""A contact localized from observations alone, at levels named in short."""

from collections.abc import Sequence
from dataclasses import replace

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.posterior.policy import estimate_contacts, read
from experiments.contact_localization.settings import KNOBS
from harness.effects.accuracy import Accuracy, Level
from harness.experiment.answer import score
from harness.experiment.levels import chosen_levels
from harness.recording.observation import Observation
from harness.recording.run_folder import RunFiles
from harness.sim.optics.inverse import GelReader


def dials(**levels: Level) -> Accuracy:
    """The default accuracy but for the estimator's ``spacing``, ``rounds`` and so on; a level may be any."""
    wanted = {f"localization.{name}": level for name, level in levels.items()}
    knobs = [
        replace(knob, levels=(*knob.levels, wanted[knob.name]))
        if wanted.get(knob.name, knob.default) not in knob.levels
        else knob
        for knob in KNOBS
    ]
    return Accuracy.default(knobs).with_(wanted)


def chosen(texts: list[str]) -> Accuracy:
    """As an operator writes them."""
    return chosen_levels(KNOBS, texts)


def conditions(
    *spacings: str, yaws: Sequence[str] = ("known",), sense: str = "touch"
) -> dict[str, Sequence[str]]:
    """Return the conditions of planned contacts with the default gap, as a measurement takes them."""
    return {
        "spacing": spacings,
        "gap": ["default"],
        "yaw": yaws,
        "choose": ["planned"],
        "sense": [sense],
    }


def answer(run: RunFiles, accuracy: Accuracy) -> Answer:
    """What a whole recording says."""
    found = score(EXPERIMENT, run, accuracy).found
    assert isinstance(found, Answer)
    return found


def estimate(
    observations: Sequence[Observation],
    model: Model,
    prior: Prior,
    accuracy: Accuracy | None = None,
    seed: int = 0,
) -> Estimate:
    """The last contact, from the images and strikes of all."""
    readings = read(observations, GelReader(model.calibration), model, prior, seed)
    return estimate_contacts(readings, accuracy or dials())[-1]
