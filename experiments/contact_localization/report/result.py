"""The answer as JSON: what a script reads, and what ``result.json`` holds."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.dials import KNOBS
from experiments.contact_localization.answer import Answer
from experiments.contact_localization.posterior.baselines import mean_random_error
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.posterior.gate import Gate
from experiments.contact_localization.posterior.posterior import Mode
from experiments.contact_localization.report.comparison import Comparison
from experiments.contact_localization.report.truth import Truth
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, RecordingDamaged, WrongUse
from harness.basics.symmetry import SymmetryGroup
from harness.effects.accuracy import Level
from harness.effects.explain import as_json
from harness.recording.run_folder import RunFiles

SCHEMA = 1
RESULT = "result.json"
"""In a run's folder, and in that of a replay."""


@dataclass(frozen=True, eq=False)
class Scored:
    """Everything that a result and a report are made from.

    Attributes:
        run: the folder.
        found: its answer.
        geometry: ``(3,)`` metres, the answer from the arm's translations alone, without one image.
        comparison: live against simulated.
        truth: of a mocked run.
        symmetry: of the object.
        accuracy: the chosen levels by knob.
        warnings: what the operator should know.
    """

    run: RunFiles
    found: Answer
    geometry: FloatArray
    comparison: Comparison
    truth: Truth | None
    symmetry: SymmetryGroup
    accuracy: Mapping[str, Any]
    warnings: tuple[str, ...]

    @property
    def true_points(self) -> FloatArray | None:
        """``(contacts, 3)`` metres, None where any is unknown."""
        count = len(self.found.observations)
        if self.truth is None or not all(k in self.truth.points for k in range(count)):
            return None
        return np.array([self.truth.points[k] for k in range(count)])


def result_of(scored: Scored, report: str | None) -> dict[str, Any]:
    """The result as JSON values; keys carry their unit."""
    run, found = scored.run, scored.found
    true = scored.true_points
    last_true = None if true is None else true[-1]
    return {
        "schema": SCHEMA,
        "experiment": run.recording.header.experiment,
        "object": run.scene.object.name,
        "mock": run.recording.header.mock is not None,
        "seed": run.recording.header.seed,
        "contacts": len(found.observations),
        "estimates": {
            sense: {"refused": str(found)} if isinstance(found, FitRefused) else estimate_of(scored, found)
            for sense, found in scored.found.by_sense.items()
        },
        "answer": scored.found.sense,
        "random_baseline_m": None if last_true is None else mean_random_error(run.mesh, last_true),
        "geometry_baseline_m": _distance(scored.geometry, last_true),
        "symmetry": scored.symmetry.name,
        "plan": _plan(scored.comparison),
        "accuracy": dict(scored.accuracy),
        "warnings": list(scored.warnings),
        "world": None if scored.truth is None else dict(scored.truth.differences),
        "recording": str(run.recording.folder),
        "report": report,
    }


def levels_of_result(folder: Path) -> dict[str, Level]:
    """The levels that the result in a folder was found at; none where it has no result.

    Raises:
        RecordingDamaged: the result cannot be read, or was found at a level that is no longer there.
    """
    path = folder / RESULT
    if not path.exists():
        return {}
    known = {knob.name: knob for knob in KNOBS}
    try:
        levels = json.loads(path.read_text())["accuracy"]
        return {name: known[name].checked(level) for name, level in levels.items()}
    except (ValueError, KeyError, TypeError, AttributeError, WrongUse) as error:
        raise RecordingDamaged(f"{path} does not say at which levels it was found ({error})") from error


def estimate_of(scored: Scored, last: Estimate) -> dict[str, Any]:
    """An estimate by one sense or by both, scored where the truth is known."""
    true = scored.true_points
    errors = None if true is None else np.linalg.norm(last.contacts - true, axis=1)
    end = None if true is None else true[-1]
    return {
        "position_m": last.position_in_object.tolist(),
        "error_m": None if errors is None else float(errors[-1]),
        "error_symmetric_m": None if end is None else scored.symmetry.distance(last.position_in_object, end),
        "error_mean_m": None if errors is None else float(errors.mean()),
        "error_top10_m": None if end is None else float(np.linalg.norm(last.candidates - end, axis=1).mean()),
        "credible90_m": last.credible90,
        "region90_area_m2": last.region.area,
        "in_region90": None if end is None else last.region.contains(end),
        "modes": [_mode(mode) for mode in last.modes],
        "yaw_rad": last.yaw,
        "yaw_sigma_rad": last.yaw_sigma,
        "contacts": [
            _contact(
                k, point, last.gates[k] if last.gates else None, None if errors is None else float(errors[k])
            )
            for k, point in enumerate(last.contacts)
        ],
        "seconds": sum(last.seconds.values()),
        "seconds_by_stage": dict(last.seconds),
    }


def flags_of(gate: Gate) -> list[str]:
    """What is wrong with a contact, in words."""
    said = []
    if gate.missed:
        said.append("missed: the image shows no contact; it was not used")
    if gate.slipped:
        said.append("slipped: it fits much worse than the others; its weight is limited")
    if gate.repeats is not None:
        said.append(f"repeated: the same place as contact {gate.repeats + 1}; together they count once")
    return said


def fit_of(gate: Gate) -> float | None:
    """Nats; None where there is no image or, as JSON has no infinity, where the contact fits nowhere near."""
    return gate.fit if gate.fit is not None and np.isfinite(gate.fit) else None


def _contact(index: int, point: FloatArray, gate: Gate | None, error: float | None) -> dict[str, Any]:
    return {
        "contact": index + 1,
        "position_m": point.tolist(),
        "error_m": error,
        "fit_nats": None if gate is None else fit_of(gate),
        "flags": [] if gate is None else flags_of(gate),
    }


def _mode(mode: Mode) -> dict[str, Any]:
    spread = float(np.sqrt(np.trace(mode.covariance)))
    return {"position_m": mode.position.tolist(), "weight": mode.weight, "spread_m": spread}


def _plan(comparison: Comparison) -> dict[str, Any]:
    described = as_json(comparison.plan)
    evaluation = comparison.evaluation
    for step in described["ran"]:
        step["seconds"] = evaluation.seconds.get(step["effect"])
        step["calls"] = evaluation.calls.get(step["effect"], 0)
    return described


def _distance(point: FloatArray, true: FloatArray | None) -> float | None:
    return None if true is None else float(np.linalg.norm(point - true))
