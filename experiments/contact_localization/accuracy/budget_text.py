"""What was asked of an estimate and what it took, as JSON values and in sentences."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.budget import BudgetResult, answer_within
from experiments.contact_localization.accuracy.dials import FINEST, setting_name
from experiments.contact_localization.accuracy.front import Front, foresee, front_for
from experiments.contact_localization.accuracy.solving import Solved, object_key
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.bench.scene import SceneFile
from harness.effects.scene_object import known_object
from harness.experiment.experiment import Target
from harness.experiment.truth import read_truth
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles


def staleness(front: Front) -> str:
    """Why the front is not of this machine and code, what is done about it, and how to be rid of it."""
    kind = "the curve that came with the program" if front.shipped else "this machine's curve"
    return (
        f"{kind} is stale ({'; '.join(front.reasons)}): its seconds are scaled by what reading the images "
        "takes now; measure here with `touchstone cost contact-localization`"
    )


def doubts(front: Front, target: Target) -> tuple[str, ...]:
    """What the operator should know of the front before an answer goes by it."""
    said = [] if front.trusted else [staleness(front)]
    if target.error is not None and not front.vouches:
        said.append(
            f"settings were measured with {front.contacts} contacts and this run has fewer, so no error is "
            "promised; measure fewer with `touchstone cost contact-localization --contacts N`"
        )
    return tuple(said)


def as_json(found: BudgetResult, front: Front, target: Target, recording: Recording) -> dict[str, Any]:
    """What was asked, what it took, and what the finest levels say, as JSON values."""
    truth, asked = read_truth(recording), found.asked
    last = recording.committed - 1
    true = None if truth is None else truth.points.get(last)
    return {
        "asked": {"budget_s": target.seconds, "error_m": target.error},
        "setting": asked.point.name,
        "levels": dict(asked.point.levels),
        "tried": list(asked.tried),
        "seconds": asked.seconds,
        "cpu_s": asked.cpu,
        "predicted_at_most_s": asked.predicted,
        "promised_error_m": asked.promise if np.isfinite(asked.promise) else None,
        "kept": asked.kept,
        **_answer_json(asked.solved, true),
        "finest": {
            "setting": setting_name(FINEST),
            "seconds": found.finest_seconds,
            "apart_m": _apart(found),
            **_answer_json(found.finest, true),
        },
        "curve": {
            "made": front.made,
            "stale": list(front.reasons),
            "shipped": front.shipped,
            "contacts": front.contacts,
        },
    }


def sentences(cost: Mapping[str, Any]) -> tuple[str, ...]:
    """The same for people, from what ``as_json`` gave."""
    return (_took(cost), _finest(cost["finest"]))


def _took(cost: Mapping[str, Any]) -> str:
    budget, error = cost["asked"]["budget_s"], cost["asked"]["error_m"]
    took = f"{cost['seconds']:.2g} s ({cost['cpu_s']:.2g} s of CPU time) at {cost['setting']}"
    promise = cost["promised_error_m"]
    within = "no error is promised" if promise is None else f"within {1e3 * promise:.1f} mm in 19 of 20 runs"
    if budget is not None:
        kept = "kept" if cost["kept"] else "NOT kept"
        return f"budget {budget:g} s {kept}: the estimate took {took}; {within}"
    if cost["kept"]:
        return f"error {1e3 * error:g} mm promised: {within}; the estimate took {took}"
    return (
        f"error {1e3 * error:g} mm cannot be promised from these contacts: {within}; the estimate took "
        f"{took}; one more contact elsewhere on the object would tell most"
    )


def _finest(finest: Mapping[str, Any]) -> str:
    if finest["position_m"] is None:
        return f"the finest levels ({finest['setting']}) refused these readings: {finest['refused']}"
    apart = "" if finest["apart_m"] is None else f"lie {1e3 * finest['apart_m']:.1f} mm from this answer"
    error = (
        "" if finest["error_m"] is None else f" and would have been off by {1e3 * finest['error_m']:.1f} mm"
    )
    return f"the finest levels ({finest['setting']}) {apart}{error}; {finest['seconds']:.2g} s, not counted"


def _apart(found: BudgetResult) -> float | None:
    ours, finest = found.asked.solved.estimate, found.finest.estimate
    if ours is None or finest is None:
        return None
    return float(np.linalg.norm(ours.position_in_object - finest.position_in_object))


def _answer_json(solved: Solved, true: FloatArray | None) -> dict[str, Any]:
    position = None if solved.estimate is None else solved.estimate.position_in_object
    error = None if position is None or true is None else float(np.linalg.norm(position - true))
    return {
        "position_m": None if position is None else position.tolist(),
        "error_m": error,
        "refused": solved.refusal,
    }


class ContactBudgets:
    """Budgets of a localization, by the curve of this machine or the one that came with the program."""

    def foresee(self, scene: SceneFile, target: Target) -> str:
        """What will be tried, in a sentence; a budget that cannot be kept ends here."""
        front = front_for(scene, scene.section(Localization).contacts)
        return foresee(front, target, object_key(scene.object.name, known_object(scene).mesh))

    def doubts(self, recording: Recording, target: Target) -> tuple[str, ...]:
        """What the operator should know of the curve."""
        return doubts(_front(recording), target)

    def answer(self, recording: Recording, target: Target) -> dict[str, Any]:
        """The estimate as it was asked for, timed, and what the finest levels would have said."""
        front = _front(recording)
        return as_json(answer_within(recording, front, target), front, target, recording)

    def sentences(self, cost: Mapping[str, Any]) -> tuple[str, ...]:
        """What was asked and what it took, for people."""
        return sentences(cost)


def _front(recording: Recording) -> Front:
    return front_for(RunFiles(recording).scene, recording.committed)


BUDGETS = ContactBudgets()
