"""Fill the report of a run from its folder, its answer and, for a mocked run, its truth."""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from experiments.contact_localization.accuracy.solving import levels_at
from experiments.contact_localization.answer import Answer as Found
from experiments.contact_localization.posterior.estimate import each_estimate
from experiments.contact_localization.posterior.gate import Gate
from experiments.contact_localization.posterior.levels import Levels
from experiments.contact_localization.report.instruments_report import artefacts, instruments
from experiments.contact_localization.report.result import Scored, flags_of, result_of
from experiments.contact_localization.report.sound_report import posterior_of, sound_of
from experiments.contact_localization.report.trade import Point
from experiments.contact_localization.report.twin_check import deviations
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, WrongUse
from harness.basics.geometry import inverse
from harness.bench.device import Health
from harness.recording.run_folder import RunFiles
from harness.report.data import (
    Answer,
    Bench,
    Contact,
    Curve,
    EffectRun,
    ReportData,
)
from harness.report.figures.props import arm_parts, object_part, sensor_parts, table_and_pedestal
from harness.report.values import Missing
from harness.report.wording import SENSES

NO_TRUTH = Missing("the truth is not known: this is not a mocked run, or its truth was taken away")


def report_of(
    scored: Scored,
    geometry_errors: tuple[float, ...] | None,
    trade: tuple[Point, ...],
    health: Mapping[str, Health] | None,
) -> ReportData:
    """Everything the page shows.

    Args:
        scored: the run, its answer, what it was compared with.
        geometry_errors: m after each contact, of the answer without images; None where unknown.
        trade: errors and seconds at several levels of accuracy.
        health: of the instruments at the end of the session; None for a replay.
    """
    run, found = scored.run, scored.found
    header = run.recording.header
    return ReportData(
        title=f"Contact localization: {run.scene.title or run.scene.object.name}",
        object_name=run.scene.object.name,
        material=run.scene.object.material,
        mesh=run.mesh,
        mock=header.mock is not None,
        made=header.created,
        command=" ".join(["touchstone", *sys.argv[1:]]),
        recording=str(run.recording.folder),
        answer=_answer(scored),
        contacts=tuple(_contact(scored, k) for k in range(len(found.observations))),
        bench=_bench(run, found),
        error_by_contact=_by_contact(scored, geometry_errors),
        error_by_seconds=_by_seconds(trade),
        instruments=instruments(run, health),
        calibrations=artefacts(run),
        effects=_effects(scored),
        world=_world(scored),
        twin=deviations(run, found),
        versions={name: text for name, text in header.versions.items() if name != "git"},
        git=header.versions["git"],
        sound=sound_of(scored),
        symmetry=scored.symmetry.name,
        accuracy={name: str(level) for name, level in scored.accuracy.items()},
        warnings=scored.warnings,
    )


def _answer(scored: Scored) -> Answer:
    result = result_of(scored, None)
    touch = result["estimates"][result["answer"]]
    return Answer(
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


def _contact(scored: Scored, index: int) -> Contact:
    found, comparison, true = scored.found, scored.comparison, scored.true_points
    after, gate = found.estimates[index], found.last.gates[index] if found.last.gates else None
    return Contact(
        number=index + 1,
        step=str(index + 1),
        live=comparison.live[index],
        simulated=comparison.simulated[index],
        live_height=comparison.live_height[index],
        simulated_height=comparison.simulated_height[index],
        object_from_gel=comparison.object_from_gel[index],
        posterior=posterior_of(after),
        truth=None if true is None else true[index],
        error=None if true is None else float(np.linalg.norm(after.position_in_object - true[index])),
        flags=() if gate is None else tuple(flags_of(gate)),
        notes=(("fit", _fit(gate)),),
    )


def _fit(gate: Gate | None) -> str:
    if gate is None:
        return "the image was not used"
    return "no contact in the image" if gate.fit is None else f"{gate.fit:.1f} nats"


def _bench(run: RunFiles, found: Found) -> Bench:
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
    return Bench(parts, base_from_gels, in_base.mean(axis=1))


def _by_contact(scored: Scored, geometry: tuple[float, ...] | None) -> tuple[Curve, ...] | Missing:
    true = scored.true_points
    if true is None:
        return NO_TRUTH
    counts = tuple(float(k + 1) for k in range(len(true)))
    ours = tuple(
        float(np.linalg.norm(estimate.position_in_object - point))
        for estimate, point in zip(scored.found.estimates, true, strict=True)
    )
    sense = scored.found.sense
    curves = [Curve(SENSES[sense], counts, ours, by=sense), *_by_other_senses(scored, true)]
    if geometry is not None:
        curves.append(Curve("translations alone, no image", counts, geometry, by="geometry"))
    return tuple(curves)


def _by_other_senses(scored: Scored, true: FloatArray) -> Iterator[Curve]:
    """The same readings after each contact by each other sense that answered in the end."""
    found, seed = scored.found, scored.run.recording.header.seed
    for sense, last in found.others.items():
        if isinstance(last, FitRefused):
            continue
        levels = replace(levels_at(scored.accuracy), senses=sense)
        count = len(found.observations)
        before = found.observations[: count - 1]
        try:
            early = each_estimate(before, found.model, found.prior, levels, seed=seed) if before else ()
        except (FitRefused, WrongUse):  # the first contacts were not struck, or told nothing yet
            continue
        points = [estimate.position_in_object for estimate in (*early, last)]
        errors = tuple(float(np.linalg.norm(p - t)) for p, t in zip(points, true, strict=True))
        yield Curve(SENSES[sense], tuple(float(k + 1) for k in range(count)), errors, by=sense)


def _by_seconds(trade: tuple[Point, ...]) -> tuple[Curve, ...] | Missing:
    if not trade:
        return NO_TRUTH
    methods: dict[str, list[Point]] = {}
    heard = any(point.levels.senses == "audio" for point in trade)
    for point in trade:
        methods.setdefault(_method(point.levels, heard), []).append(point)
    return tuple(
        Curve(
            name,
            tuple(point.seconds_a_contact for point in points),
            tuple(point.error for point in points),
            tuple(point.name for point in points),
            by=_by(points[0].levels, heard),
        )
        for name, points in methods.items()
    )


def _by(levels: Levels, heard: bool) -> str:
    """What answers: the paper's filter, or a sense; of a run without sound all are touch."""
    if levels.method == "particle":
        return levels.method
    return levels.senses if heard else "touch"


def _method(levels: Levels, heard: bool) -> str:
    if levels.method == "particle":
        return "the paper's particle filter"
    return f"grid, {SENSES[levels.senses]}" if heard else "grid"


def _effects(scored: Scored) -> tuple[EffectRun, ...]:
    plan, evaluation = scored.comparison.plan, scored.comparison.evaluation
    ran = [
        EffectRun(
            step.effect.provides,
            True,
            step.reason,
            evaluation.calls.get(step.effect.provides, 0),
            evaluation.seconds.get(step.effect.provides),
            step.effect.provides in evaluation.from_store,
        )
        for step in plan.ran
    ]
    return (*ran, *(EffectRun(step.effect.provides, False, step.reason) for step in plan.skipped))


def _world(scored: Scored) -> dict[str, str] | Missing:
    if scored.truth is None:
        return NO_TRUTH
    ours = {
        "mesh_vertices, the estimator's": str(len(scored.run.mesh.vertices)),
        "mesh_faces, the estimator's": str(len(scored.run.mesh.faces)),
        "optics_level, the comparison's": str(scored.accuracy.get("touch.optics", "")),
        "calibration_sha256, the estimator's": scored.run.calibration.sha256,
    }
    return {name: _said(value) for name, value in (*_flat(scored.truth.differences), *ours.items())}


def _flat(tree: Mapping[str, object], above: str = "") -> Iterator[tuple[str, object]]:
    """Names and values of a tree, those of a branch with its name before theirs."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value else "0"  # nor -0
    if isinstance(value, list):
        return ", ".join(_said(item) for item in value)
    return str(value)
