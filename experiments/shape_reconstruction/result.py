"""A shape reconstruction's answer as JSON values, in lines for people, and as files of its surfaces."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.shape_reconstruction.answer import SENSES, ShapeAnswer
from experiments.shape_reconstruction.dials import METHOD
from experiments.shape_reconstruction.files import write_estimate
from experiments.shape_reconstruction.metric import published_chamfer, shape_error
from experiments.shape_reconstruction.readings import base_from_stand
from experiments.shape_reconstruction.section import ShapeRun
from experiments.shape_reconstruction.surface import SEEN, TOUCHED, ShapeEstimate
from harness.basics.errors import FitRefused
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh
from harness.experiment.experiment import Scored
from harness.experiment.truth import Truth
from harness.recording.run_folder import RunFiles

ERRORS = ("chamfer_m", "chamfer_points_m", "accuracy_m", "completeness_m", "f_score")
"""Of an estimate against the truth of a mocked run."""

_BY = {"vision": "by the picture alone", "touch": "by touch alone", "fused": "by all readings"}
"""Of estimates, for people."""

_NOT_ASKED = "the scene does not ask for it"


def true_surface(run: RunFiles, truth: Truth | None) -> Mesh | None:
    """Transform the true object of a mocked run to the frame ``stand``; None if its surface is unknown."""
    if truth is None or truth.surface is None:
        return None
    return Mesh(apply(inverse(base_from_stand(run)), truth.surface.vertices), truth.surface.faces)


def result_of(scored: Scored) -> dict[str, Any]:
    """The answer as JSON values; keys carry their unit."""
    answer: ShapeAnswer = scored.found
    truth = true_surface(scored.run, scored.truth)
    estimates = {}
    for sense in SENSES:
        one = answer.by_sense.get(sense, _NOT_ASKED)
        if isinstance(one, ShapeEstimate):
            estimates[sense] = _estimate(sense, one, truth, answer.seconds[sense])
        else:
            estimates[sense] = {**_nothing(), "seconds": answer.seconds.get(sense), "refused": str(one)}
    fused = estimates["fused"]
    return {
        "error_m": fused["chamfer_m"],
        "deviation_m": fused["deviation_m"],
        "extents_m": fused["extents_m"],
        "method": str(scored.accuracy[METHOD.name]),
        "choose": scored.run.scene.section(ShapeRun).choose,
        "presses": len(answer.evidence.touches),
        "contacts": len(answer.evidence.contacts),
        "repeated": answer.evidence.repeated,
        "ended_by_housing": len(answer.evidence.ended_by_housing),
        "estimates": estimates,
        "seconds": sum(answer.seconds[sense] for sense in answer.by_sense),
        "warnings": _warnings(scored, answer),
    }


def _estimate(sense: str, found: ShapeEstimate, truth: Mesh | None, seconds: float) -> dict[str, Any]:
    return {
        **_errors(found, truth),
        "deviation_m": float(found.deviation.mean()),
        "extents_m": np.ptp(found.mesh.bounds, axis=0).tolist(),
        "touched": float((found.known_by == TOUCHED).mean()),
        "seen": float((found.known_by == SEEN).mean()),
        "not_bounded": list(found.not_bounded),
        "doubtful_m": {str(index): float(off) for index, off in found.doubtful.items()},
        "flags": list(found.flags),
        "details": dict(found.details),
        "mesh": f"{stem_of(sense)}.ply",
        "seconds": seconds,
        "refused": None,
    }


def _nothing() -> dict[str, Any]:
    names = (*ERRORS, "deviation_m", "extents_m", "touched", "seen", "not_bounded", "doubtful_m", "flags")
    return dict.fromkeys((*names, "details", "mesh"))


def _errors(found: ShapeEstimate, truth: Mesh | None) -> dict[str, Any]:
    if truth is None:
        return dict.fromkeys(ERRORS)
    error = shape_error(found.mesh, truth)
    points = published_chamfer(found.mesh, truth)
    values = (error.chamfer, points, error.accuracy, error.completeness, error.f_score)
    return dict(zip(ERRORS, values, strict=True))


def stem_of(sense: str) -> str:
    """Name, without its ending, of a surface's files beside ``result.json``."""
    return f"shape-{sense}"


def write_files(scored: Scored, folder: Path) -> None:
    """Every estimate's surface, as the result names it."""
    answer: ShapeAnswer = scored.found
    for sense, one in answer.by_sense.items():
        if isinstance(one, ShapeEstimate):
            write_estimate(one, folder, stem_of(sense))


def _warnings(scored: Scored, answer: ShapeAnswer) -> list[str]:
    said = [f"{sense}: {one}" for sense, one in answer.by_sense.items() if isinstance(one, FitRefused)]
    fused, left_out = answer.fused, scored.answering.left_out
    said += [*scored.answering.readings.refused_pictures, *(f"shape: {flag}" for flag in fused.flags)]
    if fused.not_bounded:
        said.append(f"nothing bounds the object along {', '.join(fused.not_bounded)}: press there, or look")
    said += [
        f"step {index} is {1e3 * off:.1f} mm off what all others say: it may have slipped"
        for index, off in fused.doubtful.items()
    ]
    if answer.evidence.repeated:
        said.append(
            f"{answer.evidence.repeated} presses repeat an earlier one within the bench's errors; each place "
            "counts once"
        )
    if left_out:
        said.append(f"{len(left_out)} presses were left out; of the last: {left_out[-1]}")
    if scored.run.scene.section(ShapeRun).choose == "planned":
        said.append(
            "presses were planned on the object's own mesh: a benchmark, no reconstruction of an unknown"
        )
    return said


def lines_of(result: Mapping[str, Any]) -> list[str]:
    """A line a sense, the fused one last."""
    mock = "mock bench, " if result["mock"] else ""
    said = []
    for sense, one in result["estimates"].items():
        if one["extents_m"] is None:
            said.append(f"{mock}{_BY[sense]}: no answer: {one['refused']}")
            continue
        sides = " x ".join(f"{1e2 * side:.1f}" for side in one["extents_m"])
        open_sides = f", not bounded along {', '.join(one['not_bounded'])}" if one["not_bounded"] else ""
        error = (
            "" if one["chamfer_m"] is None else f"; {1e3 * one['chamfer_m']:.1f} mm off the truth on average"
        )
        stated = f"known to {1e3 * one['deviation_m']:.1f} mm on average"
        cost = f"{one['seconds']:.1f} s; {one['mesh']}"
        said.append(f"{mock}{_BY[sense]}: {sides} cm{open_sides}, {stated}{error}; {cost}")
    return said
