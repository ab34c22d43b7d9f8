"""Fill the report of a run from its folder, its answer and, for a mocked run, its truth."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.answer import Answer as Found
from experiments.contact_localization.choosing.next_contact import EXPECTED
from experiments.contact_localization.posterior.consistency import Gate
from experiments.contact_localization.posterior.dials import METHOD, Senses
from experiments.contact_localization.posterior.dials import SENSES as BY
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.report.comparison import object_from_gels
from experiments.contact_localization.report.result import by_translations, flags_of, true_points
from experiments.contact_localization.report.sound_report import posterior_of, sound_of
from experiments.contact_localization.report.sweep import SweepPoint, trade
from experiments.contact_localization.report.twin_check import deviations
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import inverse
from harness.bench.device import Health
from harness.effects.accuracy import Accuracy
from harness.experiment.compare import Comparison
from harness.experiment.experiment import Scored
from harness.recording.run_folder import RunFiles
from harness.report.data import (
    AnswerRow,
    BenchScene,
    ContactRow,
    ErrorCurve,
    ReportData,
)
from harness.report.figures.props import arm_parts, object_part, sensor_parts, table_and_pedestal
from harness.report.page import write_report
from harness.report.run_page import facts_of
from harness.report.simulated import NO_TRUTH
from harness.report.values import Missing
from harness.report.wording import SENSES


def write(scored: Scored, comparison: Comparison, health: Mapping[str, Health] | None, folder: Path) -> Path:
    """Draw the report; the path of its page."""
    return write_report(report_of(scored, comparison, health), folder)


def report_of(scored: Scored, comparison: Comparison, health: Mapping[str, Health] | None) -> ReportData:
    """Everything the page shows.

    Args:
        scored: the run and its answer.
        comparison: what the scene observes, simulated at the answer.
        health: of the instruments at the end of the session; None for a replay.
    """
    run, found = scored.run, scored.found
    history = scored.answering.history(found.last, found.sense)
    return ReportData(
        **facts_of("Contact localization", scored, comparison, health, _ours(scored)),
        mesh=run.mesh,
        answer=_answer(scored),
        contacts=_contacts(scored, comparison, history),
        bench=_bench(run, found),
        error_by_contact=_by_contact(scored, history),
        error_by_seconds=_by_seconds(_sweep(scored)),
        twin=deviations(run, found),
        sound=sound_of(scored),
        symmetry=scored.answering.symmetry.name,
        accuracy={name: str(level) for name, level in scored.accuracy.items()},
        warnings=(*scored.warnings, *scored.result["warnings"]),
    )


def _answer(scored: Scored) -> AnswerRow:
    result = scored.result
    touch = result["estimates"][result["answer"]]
    return AnswerRow(
        position=scored.found.last.position_in_object,
        seconds=touch["seconds"],
        credible90=touch["credible90_m"],
        error=touch["error_m"],
        error_symmetric=touch["error_symmetric_m"],
        error_mean=touch["error_mean_m"],
        random_baseline=result["random_baseline_m"],
        geometry_baseline=result["geometry_baseline_m"],
        modes=len(touch["modes"]),
    )


def _contacts(
    scored: Scored, comparison: Comparison, history: tuple[Estimate | FitRefused, ...]
) -> tuple[ContactRow, ...]:
    images = _of_each(comparison, "touch.image", len(history))
    gels = _of_each(comparison, "touch.gel", len(history))
    poses, true = object_from_gels(scored.found), true_points(scored)
    return tuple(
        ContactRow(
            number=k + 1,
            step=str(k + 1),
            live=scored.found.observations[k].images[-1],
            simulated=images[k],
            live_height=scored.found.heights[k],
            simulated_height=gels[k],
            object_from_gel=poses[k],
            posterior=Missing(str(after)) if isinstance(after, FitRefused) else posterior_of(after),
            truth=None if true is None else true[k],
            error=None if true is None else _error(after, true[k]),
            flags=() if gate is None else tuple(flags_of(gate, scored.found.refused_pictures.get(k))),
            notes=(("fit", _fit(gate)), *_expected(scored.run, k)),
        )
        for k, (after, gate) in enumerate(zip(history, _gates(scored.found, len(history)), strict=True))
    )


def _error(after: Estimate | FitRefused, true: FloatArray) -> float | None:
    """m; None where there is no estimate."""
    if isinstance(after, FitRefused):
        return None
    return float(np.linalg.norm(after.position_in_object - true))


def _of_each(comparison: Comparison, name: str, count: int) -> list[Any]:
    """A quantity of every contact, or why it was not simulated."""
    values = comparison.evaluation.values
    if name in values:
        return list(values[name])
    return [Missing(f"the scene's observe does not ask for {name}")] * count


def _gates(found: Found, count: int) -> tuple[Gate | None, ...]:
    return found.last.gates or (None,) * count


def _fit(gate: Gate | None) -> str:
    if gate is None:
        return "the image was not used"
    return "no contact in the image" if gate.fit is None else f"{gate.fit:.1f} nats"


def _expected(run: RunFiles, contact: int) -> tuple[tuple[str, str], ...]:
    """Of contacts that were chosen one by one, what error the choice expected; nothing of planned ones."""
    if run.scene.section(Localization).choose == "planned":
        return ()
    error = run.recording.step(contact).step.parameters.get(EXPECTED)
    return (("error expected when it was chosen", "planned" if error is None else f"{1e3 * error:.1f} mm"),)


def _bench(run: RunFiles, found: Found) -> BenchScene:
    station, scene = run.station, run.scene
    base_from_object = scene.base_from_object(run.mesh)
    base_from_gels = np.array([observation.base_from_gel for observation in found.observations])
    joints = run.recording.step(len(found.observations) - 1).readings["arm.joints"].values[-1]
    corners = run.mesh.bounds
    in_base = base_from_object[:3, :3] @ corners.T + base_from_object[:3, 3:]
    parts = (
        object_part(run.mesh, base_from_object),
        *table_and_pedestal(
            base_from_object, float(in_base[2].min()), 0.5 * scene.support.width, scene.table.height
        ),
        *sensor_parts(station.gel.sensor, base_from_gels[-1], inverse(station.flange_from_gel)),
        *arm_parts(station.arm.model, joints),
    )
    return BenchScene(parts, base_from_gels, in_base.mean(axis=1))


def _by_contact(
    scored: Scored, history: tuple[Estimate | FitRefused, ...]
) -> tuple[ErrorCurve, ...] | Missing:
    true, found = true_points(scored), scored.found
    if true is None:
        return NO_TRUTH
    counts = tuple(float(k + 1) for k in range(len(true)))
    alone = _errors([by_translations(found, k + 1) for k in range(len(true))], true)
    return (
        _curve(found.sense, history, true),
        *_by_other_senses(scored, true),
        ErrorCurve("translations alone, no image", counts, alone, by="geometry"),
    )


def _by_other_senses(scored: Scored, true: FloatArray) -> Iterator[ErrorCurve]:
    """The same readings after each contact by each other sense that answered in the end."""
    for sense, last in scored.found.others.items():
        if not isinstance(last, FitRefused):
            yield _curve(sense, scored.answering.history(last, sense), true)


def _curve(sense: Senses, history: tuple[Estimate | FitRefused, ...], true: FloatArray) -> ErrorCurve:
    """M after each contact that has an estimate."""
    errors = {k + 1: _error(after, at) for k, (after, at) in enumerate(zip(history, true, strict=True))}
    known = {float(count): error for count, error in errors.items() if error is not None}
    return ErrorCurve(SENSES[sense], tuple(known), tuple(known.values()), by=sense)


def _errors(points: Sequence[FloatArray], true: FloatArray) -> tuple[float, ...]:
    """m, contact by contact."""
    return tuple(float(np.linalg.norm(point - at)) for point, at in zip(points, true, strict=True))


def _sweep(scored: Scored) -> tuple[SweepPoint, ...]:
    true = true_points(scored)
    return () if true is None else trade(scored.answering.readings, true[-1])


def _by_seconds(trade: tuple[SweepPoint, ...]) -> tuple[ErrorCurve, ...] | Missing:
    if not trade:
        return NO_TRUTH
    methods: dict[str, list[SweepPoint]] = {}
    heard = any(point.accuracy.of(BY) == "audio" for point in trade)
    for point in trade:
        methods.setdefault(_method(point.accuracy, heard), []).append(point)
    return tuple(
        ErrorCurve(
            name,
            tuple(point.seconds_a_contact for point in points),
            tuple(point.error for point in points),
            tuple(point.name for point in points),
            by=_by(points[0].accuracy, heard),
        )
        for name, points in methods.items()
    )


def _by(accuracy: Accuracy, heard: bool) -> str:
    """What answers: the paper's filter, or a sense; of a run without sound all are touch."""
    if accuracy.of(METHOD) == "particle":
        return "particle"
    return accuracy.of(BY) if heard else "touch"


def _method(accuracy: Accuracy, heard: bool) -> str:
    if accuracy.of(METHOD) == "particle":
        return "the paper's particle filter"
    return f"grid, {SENSES[accuracy.of(BY)]}" if heard else "grid"


def _ours(scored: Scored) -> dict[str, str]:
    """The estimator's side of what the world did differently."""
    return {
        "mesh_vertices, the estimator's": str(len(scored.run.mesh.vertices)),
        "mesh_faces, the estimator's": str(len(scored.run.mesh.faces)),
        "optics_level, the comparison's": str(scored.accuracy.get("touch.optics", "")),
        "calibration_sha256, the estimator's": scored.run.calibration.sha256,
    }
