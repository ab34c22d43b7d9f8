"""The answer as JSON: what a script reads, and what ``result.json`` holds."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from experiments.contact_localization.answer import Answer, ScoredContact
from experiments.contact_localization.posterior.baselines import mean_random_error, without_images
from experiments.contact_localization.posterior.consistency import Gate
from experiments.contact_localization.posterior.estimate import SPACING, Estimate, Senses
from experiments.contact_localization.posterior.strike_consistency import doubts_of_sound
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.mesh import Mesh
from harness.basics.symmetry import SymmetryGroup

SENSES: Mapping[Senses, str] = {"touch": "touch", "audio": "sound", "both": "touch and sound"}
"""Names of the senses in the report."""

SAME_PLACE = 3.0e-3
"""Distance of two places modulo the object's symmetry below which they are one, m."""


_NO_SOUND = "the object's sound is not compared, and touch alone answers"


_LEFT_OUT = "its picture is left out"


def true_points(scored: ScoredContact) -> FloatArray | None:
    """``(contacts, 3)`` metres, None where any is unknown."""
    count = len(scored.found.readings.observations)
    if scored.truth is None or not all(k in scored.truth.points for k in range(count)):
        return None
    return np.array([scored.truth.points[k] for k in range(count)])


def result_of(scored: ScoredContact) -> dict[str, Any]:
    """The answer as JSON values; keys carry their unit."""
    found: Answer = scored.found
    true = true_points(scored)
    last_true = None if true is None else true[-1]
    random = geometry = None
    by_places = by_translations(found, len(found.readings.observations))
    if last_true is not None:
        random = mean_random_error(scored.run.mesh, last_true)
        geometry = float(np.linalg.norm(by_places - last_true))
    return {
        "contacts": len(found.readings.observations),
        "estimates": {
            sense: {"refused": str(one)} if isinstance(one, FitRefused) else estimate_of(scored, one)
            for sense, one in found.by_sense.items()
        },
        "answer": found.sense,
        "random_baseline_m": random,
        "geometry_baseline_m": geometry,
        "symmetry": scored.answering.symmetry.name,
        "seconds": found.seconds,
        "warnings": list(_doubts(found, scored.answering.symmetry)),
    }


def by_translations(found: Answer, count: int) -> FloatArray:
    """``(3,)`` metres: the last of the first ``count`` contacts, from the arm's translations alone."""
    poses = [observation.base_from_gel for observation in found.readings.observations[:count]]
    return without_images(poses, found.readings.model, found.readings.prior, SPACING.default)


def _doubts(found: Answer, symmetry: SymmetryGroup) -> tuple[str, ...]:
    refusal = found.readings.model.sound_refusal
    of_sound = (f"{_NO_SOUND}: {refusal}",) if refusal else doubts_of_sound(found.readings.observations)
    pictures = found.readings.refused_pictures.items()
    of_sound = (*(f"contact {k + 1}: {_LEFT_OUT}: {why}" for k, why in pictures), *of_sound)
    # Sense by sense the doubt may be the same one.
    of_senses = [estimate.doubts for estimate in found.by_sense.values() if isinstance(estimate, Estimate)]
    of_sound += tuple(dict.fromkeys(doubt for doubts in of_senses for doubt in doubts))
    if len(found.last.modes) < 2:
        return of_sound
    shares = ", ".join(f"{100 * mode.weight:.0f} %" for mode in found.last.modes)
    places, mesh = [mode.position for mode in found.last.modes], found.readings.model.mesh
    return (
        *of_sound,
        f"the answer is ambiguous: {len(found.last.modes)} places stay likely ({shares}); "
        f"{further_contact(places, symmetry, mesh)}",
    )


def further_contact(places: Sequence[FloatArray], symmetry: SymmetryGroup, mesh: Mesh) -> str:
    """State whether another contact can distinguish the places that stay likely.

    Args:
        places: ``(3,)`` positions on the object, the likeliest first, m.
        symmetry: rotations that leave the object unchanged.
        mesh: the object.
    """
    distances = [symmetry.distance(places[0], place) for place in places[1:]]
    radii = np.linalg.norm(mesh.vertices - 0.5 * mesh.bounds.sum(axis=0), axis=1)
    is_ball = bool(np.ptp(radii) < 2.0 * symmetry.tolerance)
    if is_ball or max(distances) < SAME_PLACE:
        return (
            "the object is the same at all of them by its symmetry, and no further contact distinguishes them"
        )
    return "one more contact elsewhere on the object can distinguish them"


def estimate_of(scored: ScoredContact, last: Estimate) -> dict[str, Any]:
    """An estimate by one sense or by both, scored where the truth is known."""
    true = true_points(scored)
    errors = None if true is None else np.linalg.norm(last.contacts - true, axis=1)
    end, gels = None if true is None else true[-1], scored.found.readings.gels
    return {
        "position_m": last.position_in_object.tolist(),
        "error_m": None if errors is None else float(errors[-1]),
        "error_symmetric_m": None
        if end is None
        else scored.answering.symmetry.distance(last.position_in_object, end),
        "error_mean_m": None if errors is None else float(errors.mean()),
        "error_top10_m": None if end is None else float(np.linalg.norm(last.candidates - end, axis=1).mean()),
        "credible90_m": last.credible90,
        "region90_area_m2": last.region.area,
        "in_region90": None if end is None else last.region.contains(end),
        "modes": [
            {
                "position_m": mode.position.tolist(),
                "weight": mode.weight,
                "spread_m": float(np.sqrt(np.trace(mode.covariance))),
            }
            for mode in last.modes
        ],
        "yaw_rad": last.yaw,
        "yaw_sigma_rad": last.yaw_sigma,
        "contacts": [
            {
                "contact": k + 1,
                "position_m": point.tolist(),
                "error_m": None if errors is None else float(errors[k]),
                "fit_nats": last.gates[k].finite_fit if last.gates else None,
                "flags": flags_of(last.gates[k], gels[k].refusal) if last.gates else [],
            }
            for k, point in enumerate(last.contacts)
        ],
        "seconds": sum(last.seconds.values()),
        "seconds_by_stage": dict(last.seconds),
    }


def flags_of(gate: Gate, refusal: str = "") -> list[str]:
    """What is wrong with a contact, in words.

    Args:
        gate: how it fits.
        refusal: reason why its picture is not used; empty if it is.
    """
    said = []
    if refusal:
        said.append(f"{_LEFT_OUT}: {refusal}")
    elif gate.missed:
        said.append("missed: the image shows no contact; it was not used")
    if gate.slipped:
        said.append("slipped: it fits much worse than the others; its weight is limited")
    if gate.repeats is not None:
        said.append(f"repeated: the same place as contact {gate.repeats + 1}; together they count once")
    return said


def answer_lines(result: Mapping[str, Any]) -> list[str]:
    """A line for each sense; the last one with the baselines."""
    lines = []
    last = next(reversed(result["estimates"]))
    for sense, found in result["estimates"].items():
        if "refused" in found:
            lines.append(f"{sense}: refused: {found['refused']}")
            continue
        x, y, z = (1e3 * value for value in found["position_m"])
        place = f"({x:.1f}, {y:.1f}, {z:.1f}) mm on the {result['object']}"
        said = [f"{sense}: contact {result['contacts']} at {place}"]
        if found["error_m"] is not None:
            symmetric = found["error_symmetric_m"]
            modulo = f" ({_mm(symmetric)} modulo symmetry)" if symmetric < 0.9 * found["error_m"] else ""
            said.append(f"error {_mm(found['error_m'])}{modulo}")
        if len(found["modes"]) > 1:
            said.append(f"{len(found['modes'])} likely places")
        said += [f"90 % within {_mm(found['credible90_m'])}", f"{found['seconds']:.2f} s"]
        if sense == last and result["geometry_baseline_m"] is not None:
            said.append(
                f"baselines: geometry alone {_mm(result['geometry_baseline_m'])}, "
                f"random {_mm(result['random_baseline_m'])}"
            )
        lines.append(("mock bench, " if result["mock"] else "") + "; ".join(said))
    return lines


def _mm(metres: float) -> str:
    return f"{metres * 1e3:.1f} mm"
