"""Fill the report of a run from its folder, its answer and, for a mocked run, its truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.answer import PROGRAM, Answer, ScoredContact
from experiments.contact_localization.answer import Answer as Found
from experiments.contact_localization.next_contact import EXPECTED
from experiments.contact_localization.posterior.consistency import Gate
from experiments.contact_localization.posterior.estimate import (
    DIALS,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    Estimate,
    Senses,
)
from experiments.contact_localization.posterior.estimate import SENSES as BY
from experiments.contact_localization.report.result import by_translations, flags_of, true_points
from experiments.contact_localization.report.sound_report import posterior_of, sound_of
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import setting_name
from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import FitRefused
from harness.basics.geometry import inverse, rotation_from_quaternion, transform, translation
from harness.bench.device import Health
from harness.effects.quantities import Quantities
from harness.experiment.compare import Comparison
from harness.experiment.front import front_at_hand
from harness.experiment.lookup import named
from harness.recording.run_folder import RunFiles
from harness.report.data import (
    AnswerRow,
    BenchPart,
    BenchScene,
    ContactRow,
    ErrorCurve,
    ReportData,
    TwinDeviation,
)
from harness.report.figures.pictures import CLAY, arm_parts, sensor_parts, table_and_pedestal
from harness.report.page import write_report
from harness.report.run_page import NO_TRUTH, facts_of
from harness.report.values import Missing
from harness.report.wording import SENSES
from harness.skills.press import ContactMotion
from harness.twin.bench_of import twin_of
from harness.twin.compare import compare_arm, compare_contact
from harness.twin.rehearsal import predict_contact


def write(
    scored: ScoredContact, comparison: Comparison, health: Mapping[str, Health] | None, folder: Path
) -> Path:
    """Draw the report; the path of its page."""
    return write_report(report_of(scored, comparison, health), folder)


def report_of(
    scored: ScoredContact, comparison: Comparison, health: Mapping[str, Health] | None
) -> ReportData:
    """Everything the page shows.

    Args:
        scored: the run and its answer.
        comparison: what the scene observes, simulated at the answer.
        health: of the instruments at the end of the session; None for a replay.
    """
    run, found = scored.run, scored.found
    # The estimator's side of what the world did differently.
    ours = {
        "mesh_vertices, the estimator's": str(len(run.mesh.vertices)),
        "mesh_faces, the estimator's": str(len(run.mesh.faces)),
        "optics_level, the comparison's": str(scored.accuracy.get("touch.optics", "")),
        "calibration_sha256, the estimator's": run.calibration.sha256,
    }
    history = scored.answering.history(found.last, found.sense)
    return ReportData(
        **facts_of("Contact localization", scored, comparison, health, ours),
        mesh=run.mesh,
        answer=_answer(scored),
        contacts=_contacts(scored, comparison, history),
        bench=_bench(run, found),
        error_by_contact=_by_contact(scored, history),
        error_by_seconds=_by_seconds(scored),
        twin=deviations(run, found),
        sound=sound_of(scored),
        symmetry=scored.answering.symmetry.name,
        accuracy={name: str(level) for name, level in scored.accuracy.items()},
        warnings=(*scored.warnings, *scored.result["warnings"]),
    )


def _answer(scored: ScoredContact) -> AnswerRow:
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
    scored: ScoredContact, comparison: Comparison, history: tuple[Estimate | FitRefused, ...]
) -> tuple[ContactRow, ...]:
    count = len(history)
    touch = comparison.evaluation.touch
    images, gels = _of_each(touch.image, "touch.image", count), _of_each(touch.gel, "touch.gel", count)
    gates: tuple[Gate | None, ...] = scored.found.last.gates or (None,) * count
    poses, true, readings = object_from_gels(scored.found), true_points(scored), scored.found.readings
    return tuple(
        ContactRow(
            number=k + 1,
            step=str(k + 1),
            live=readings.observations[k].images[-1],
            simulated=images[k],
            live_height=readings.gels[k].height,
            simulated_height=gels[k],
            object_from_gel=poses[k],
            posterior=Missing(str(after)) if isinstance(after, FitRefused) else posterior_of(after),
            truth=None if true is None else true[k],
            error=None if true is None else _error(after, true[k]),
            flags=() if gate is None else tuple(flags_of(gate, readings.gels[k].refusal)),
            notes=(("fit", _fit(gate)), *_expected(scored.run, k)),
        )
        for k, (after, gate) in enumerate(zip(history, gates, strict=True))
    )


def _error(after: Estimate | FitRefused, true: FloatArray) -> float | None:
    """m; None where there is no estimate."""
    if isinstance(after, FitRefused):
        return None
    return float(np.linalg.norm(after.position_in_object - true))


def _of_each(values: AnyArray | None, name: str, count: int) -> list[Any]:
    """Return a quantity of every contact, or why it was not simulated."""
    if values is not None:
        return list(values)
    return [Missing(f"the scene's observe does not ask for {name}")] * count


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
    base_from_gels = np.array([observation.base_from_gel for observation in found.readings.observations])
    joints = run.recording.step(len(found.readings.observations) - 1).readings["arm.joints"].values[-1]
    corners = run.mesh.bounds
    in_base = base_from_object[:3, :3] @ corners.T + base_from_object[:3, 3:]
    parts = (
        BenchPart(run.mesh, base_from_object, CLAY),
        *table_and_pedestal(
            base_from_object, float(in_base[2].min()), 0.5 * scene.support.width, scene.table.height
        ),
        *sensor_parts(station.gel.sensor, base_from_gels[-1], inverse(station.flange_from_gel)),
        *arm_parts(station.arm.model, joints),
    )
    return BenchScene(parts, base_from_gels, in_base.mean(axis=1))


def _by_contact(
    scored: ScoredContact, history: tuple[Estimate | FitRefused, ...]
) -> tuple[ErrorCurve, ...] | Missing:
    true, found = true_points(scored), scored.found
    if true is None:
        return NO_TRUTH
    counts = tuple(float(k + 1) for k in range(len(true)))
    alone = tuple(float(np.linalg.norm(by_translations(found, k + 1) - at)) for k, at in enumerate(true))
    # The same readings after each contact by each other sense that answered in the end.
    others = [
        _curve(sense, scored.answering.history(last, sense), true)
        for sense, last in found.others.items()
        if not isinstance(last, FitRefused)
    ]
    return (
        _curve(found.sense, history, true),
        *others,
        ErrorCurve("translations alone, no image", counts, alone, by="geometry"),
    )


def _curve(sense: Senses, history: tuple[Estimate | FitRefused, ...], true: FloatArray) -> ErrorCurve:
    """M after each contact that has an estimate."""
    errors = {k + 1: _error(after, at) for k, (after, at) in enumerate(zip(history, true, strict=True))}
    known = {float(count): error for count, error in errors.items() if error is not None}
    return ErrorCurve(SENSES[sense], tuple(known), tuple(known.values()), by=sense)


def _by_seconds(scored: ScoredContact) -> tuple[ErrorCurve, ...] | Missing:
    """Return error and seconds of each sense's answer, and those measured at its levels on other runs."""
    true, run = true_points(scored), scored.run
    if true is None:
        return NO_TRUTH
    count, front = len(true), front_at_hand(named(PROGRAM), run)
    unused = (PARTICLES,) if scored.accuracy.of(METHOD) == "grid" else (ROUNDS, SAMPLES)
    curves = []
    for sense, last in {scored.found.sense: scored.found.last, **scored.found.others}.items():
        if isinstance(last, FitRefused):
            continue
        levels = {**scored.accuracy, BY.name: sense}
        label = setting_name({knob.name: levels[knob.name] for knob in DIALS if knob not in unused})
        seconds, error = sum(last.seconds.values()) / count, _error(last, true[-1])
        assert error is not None
        curves.append(ErrorCurve(SENSES[sense], (seconds,), (error,), (label,), by=sense))
        point = None if front is None else front.at(levels)
        if front is not None and point is not None:
            mean = float(np.exp(np.log(point.wall_seconds).mean())) / front.steps
            name = f"{SENSES[sense]}, mean of {len(point.samples)} measured runs"
            curves.append(ErrorCurve(name, (mean,), (point.error.value,), (point.name,), by=sense))
    return tuple(curves)


_MOST_POSES = 200


def deviations(run: RunFiles, found: Answer) -> tuple[TwinDeviation, ...]:
    """By step: the controller's poses against the twin's, and the contact against the rehearsed one."""
    bench = twin_of(run.scene, run.station, run.mesh)
    planned = run.recording.header.plan.get("pressed", [])
    rows = []
    for index, observation in enumerate(found.readings.observations):
        readings = run.recording.step(index).readings
        joints, poses = readings["arm.joints"].values, readings["arm.base_from_flange"].values
        count = min(len(joints), len(poses))
        chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_POSES)).astype(np.int64))
        matrices = np.array([transform(rotation_from_quaternion(p[3:]), p[:3]) for p in poses[chosen]])
        arm = compare_arm(run.station.arm.model, joints[chosen], matrices)
        if index < len(planned):
            pressed = np.array(planned[index])
        else:  # chosen on the way: fully pressed, as planned then
            motion = ContactMotion.from_parameters(run.recording.step(index).step.parameters)
            along = translation((motion.search + motion.press) * motion.axis)
            pressed = along @ motion.base_from_stand_off @ run.station.flange_from_gel
        rehearsed = predict_contact(bench, index, pressed)
        contact = compare_contact(bench, rehearsed, observation.base_from_gel).distance
        rows.append(
            TwinDeviation(
                f"step {index + 1}",
                float(arm.distances.mean()),
                float(arm.distances.max()),
                float(arm.angles.max()),
                contact,
            )
        )
    return tuple(rows)


GIVES = ("contact.gel_from_object",)
"""What an answer gives the simulation."""


def sources(scored: ScoredContact) -> Quantities:
    """Return the answer's part of what the scene's observed quantities are computed from."""
    return {"contact_gel_from_object": inverse(object_from_gels(scored.found))}


def object_from_gels(found: Answer) -> FloatArray:
    """``(contacts, 4, 4)``: each gel as deep behind its estimated contact as its own images say."""
    object_from_base = found.readings.prior.object_from_base(np.array([found.last.yaw]))[0]
    poses = []
    for observation, point, gel in zip(
        found.readings.observations, found.last.contacts, found.readings.gels, strict=True
    ):
        rotation = object_from_base @ observation.base_from_gel[:3, :3]
        rows, columns = gel.height.shape
        middle = gel.height[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
        poses.append(transform(rotation, point + float(middle.mean()) * rotation[:, 2]))
    return read_only(np.array(poses))
