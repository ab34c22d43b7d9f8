"""The page of a run: answer, pictures of the experiment, agreement with a model, bench, and cost."""

import datetime as dt
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from harness.basics.files.json_file import JsonObject
from harness.bench import microphone_take
from harness.bench.acquisition_channels import CLOCK, FLAGS, FORCE, PRESSURE
from harness.bench.device import Health, Reading
from harness.effects.explain import NetworkInUse, networks_at
from harness.experiment.compare import Comparison
from harness.experiment.experiment import AnyExperiment, AnyScored
from harness.experiment.front import front_at_hand
from harness.experiment.report_content import (
    Missing,
    Notice,
    PageBlock,
    PageSection,
    ReportTable,
    RunReport,
)
from harness.recording.run_folder import RunFiles
from harness.report.agreement_part import show_agreement
from harness.report.figures.figures import Album
from harness.report.template import write_page
from harness.report.wording import NONE, duration, format_key, rate, show_value

PAGE = "report.html"
"""Name of the page in a report's folder, and of its template."""

_IN_BLOCKS = (FORCE, PRESSURE)
"""Channels whose every reading is a block of samples."""

_REMARKS = (CLOCK, FLAGS, microphone_take.CLOCK, microphone_take.FLAGS, microphone_take.CALLBACK)
"""Channels that describe a capture and hold no sample."""

_HEARD_WITH = {"hammer": ("microphone",)}
"""Instruments whose box reads another's channels too."""


def write_run_page(
    experiment: AnyExperiment,
    scored: AnyScored,
    comparison: Comparison,
    health: Mapping[str, Health] | None,
    folder: Path,
) -> Path:
    """Write the page of a run and its pictures.

    Args:
        experiment: experiment of the run.
        scored: the answer.
        comparison: the observed quantities, simulated at the answer.
        health: health of the instruments at the end of the session; None for a replay.
        folder: created if it does not exist; files of the same names are replaced.

    Returns:
        Path of the page, which refers to nothing outside itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    run, header = scored.run, scored.run.recording.header
    if experiment.report is None:
        report = _plain_report(experiment, scored)
    else:
        report = experiment.report(scored, comparison, folder)
    described = run.scene.object
    return write_page(
        folder / PAGE,
        PAGE,
        title=f"{experiment.title}: {run.scene.title or described.name}",
        is_mock=header.mock is not None,
        sentence=report.sentence,
        facts=(
            f"{described.name}, {described.material}",
            f"{run.recording.committed} {experiment.plural}",
            header.created,
        ),
        command=" ".join(["touchstone", *sys.argv[1:]]),
        recording=str(run.recording.folder),
        sections=(
            PageSection("Answer", _answer(report, scored)),
            PageSection("Readings and estimates", report.sections or (Missing("there are no pictures"),)),
            PageSection("Agreement with the model", show_agreement(comparison.agreement, Album(folder))),
            PageSection(
                "Bench",
                (
                    PageSection("Instruments", (list_instruments(run, health),)),
                    PageSection("Calibrations", (list_calibrations(run),)),
                    PageSection("Simulated effects", tuple(_list_effects(scored, comparison))),
                    PageSection("Differences of the mocked world", _world(experiment, scored)),
                    PageSection("Versions", (_versions(header.versions),)),
                ),
            ),
            PageSection("Cost of the answer", tuple(_cost(experiment, scored, report.seconds))),
        ),
    )


def _plain_report(experiment: AnyExperiment, scored: AnyScored) -> RunReport:
    """Show the numbers of the result, for an experiment without a report of its own."""
    named = {"object": scored.run.scene.object.name, "mock": scored.run.recording.header.mock is not None}
    numbers = {key: value for key, value in scored.result.items() if isinstance(value, int | float)}
    values = [show_value(format_key(key, value)[0], key, value) for key, value in numbers.items()]
    return RunReport(" ".join(experiment.lines({**scored.result, **named})), values)


def _answer(report: RunReport, scored: AnyScored) -> tuple[PageBlock, ...]:
    rows = [(value.quantity, value.value, value.unit, value.uncertainty) for value in report.values]
    return (
        *(Notice(warning) for warning in (*scored.warnings, *scored.result.get("warnings", ()))),
        ReportTable(("quantity", "value", "unit", "uncertainty"), rows, "lrll"),
        "The file result.json in the folder of the run, or of its replay, has all values at full precision.",
    )


def list_instruments(run: RunFiles, health: Mapping[str, Health] | None) -> ReportTable | Missing:
    """List the instruments with their readings and errors during the run.

    Args:
        run: folder of the run.
        health: health at the end of the session; None for a replay.
    """
    if health is None:
        return Missing("estimated again from the recording: no instrument was open")
    nominal = {name: section.nominal_rate for name, section in run.station.sections.items()}
    counts: dict[str, int] = {}
    for step in run.recording.steps():
        for reading in step.readings.values():
            whose = reading.channel.name.split(".")[0]
            counts[whose] = counts.get(whose, 0) + count_samples(reading)
    rows = []
    for name, found in health.items():
        names = [name, *(other for other in _HEARD_WITH.get(name, ()) if other not in health)]
        rows.append(
            (
                " and ".join(names),
                found.identity,
                str(sum(counts.get(one, 0) for one in names)),
                rate(found.rate),
                rate(nominal.get(name)),
                NONE if found.drops is None else str(found.drops),
                duration(found.latency),
                found.detail,
            )
        )
    headings = ("instrument", "address", "samples", "rate", "nominal rate", "drops", "latency, median")
    return ReportTable((*headings, "remark"), rows, "llrrrrrl")


def count_samples(reading: Reading) -> int:
    """Count the samples of a reading: all samples of a block; a remark on a capture is no sample."""
    if reading.channel.name in _REMARKS:
        return 0
    return int(reading.values.size) if reading.channel.name in _IN_BLOCKS else len(reading.times)


def list_calibrations(run: RunFiles) -> ReportTable:
    """List the gel's calibration and, if the run was recorded with sound, that of the hammer's box."""
    header, acquisition = run.calibration.header, run.acquisition
    rows = [
        (
            f"tactile optics of {header.sensor}",
            header.serial,
            header.date,
            _age(run, header.date),
            f"{header.held_out_db:.1f} dB on held-out presses, {header.residual_rms:.1f} grey levels rms",
            run.calibration.sha256[:12],
        )
    ]
    if acquisition is not None:
        rows.append(
            (
                f"force and pressure of {acquisition.model}",
                f"{acquisition.serial}, hammer {acquisition.hammer_serial}, "
                f"microphone {acquisition.microphone_serial}",
                acquisition.date,
                _age(run, acquisition.date),
                f"{100.0 * acquisition.residual:.1f} % of {acquisition.made_from}",
                acquisition.hash[:12],
            )
        )
    return ReportTable(("calibration", "serial number", "date", "age", "residual", "SHA-256"), rows, "lllrll")


def _age(run: RunFiles, date: str) -> str:
    """Days from an artefact's date to the run."""
    made = dt.datetime.fromisoformat(date)
    made = made if made.tzinfo is not None else made.replace(tzinfo=dt.UTC)
    age = dt.datetime.fromisoformat(run.recording.header.created) - made
    return f"{age.total_seconds() / 86400.0:.0f} days"


def _list_effects(scored: AnyScored, comparison: Comparison) -> Iterator[PageBlock]:
    networks = find_networks(scored)
    if networks:
        yield (
            "The object is an ObjectFile. These networks of it replace a simulation; the errors are those of "
            "its model card."
        )
        rows = [
            (
                network.file,
                network.instead_of,
                "; ".join(" ".join(format_key(*error)).strip() for error in network.errors.items())
                or "not measured",
            )
            for network in networks
        ]
        yield ReportTable(("network", "replaces", "error"), rows, "lll")
    plan, evaluation = comparison.plan, comparison.evaluation
    if plan.ran:
        yield ReportTable(
            ("effect", "reason", "calls", "time"),
            [
                (
                    step.effect.provides,
                    step.reason,
                    "stored" if step.effect.provides in evaluation.from_store
                    else str(evaluation.calls.get(step.effect.provides, 0)),
                    duration(evaluation.seconds.get(step.effect.provides)),
                )
                for step in plan.ran
            ],
            "llrr",
        )  # fmt: skip
    if plan.skipped:
        left_out = [(step.effect.provides, step.reason) for step in plan.skipped]
        yield ReportTable(("effect left out", "reason"), left_out, "ll")
    observed = [row for name, value in comparison.observed().items() for row in _list_quantities(name, value)]
    if observed:
        yield "Quantities that the scene observes, simulated at the answer."
        yield ReportTable(("quantity", "shape", "min", "mean", "max"), observed, "llrrr")


def find_networks(scored: AnyScored) -> tuple[NetworkInUse, ...]:
    """Return the networks that replaced a simulation in an answer; none for a run without an ObjectFile."""
    if scored.run.scene.object.objectfile is None:
        return ()
    return networks_at(scored.run.objectfile.description, scored.accuracy.levels)


def _list_quantities(name: str, described: JsonObject) -> Iterator[tuple[str, ...]]:
    if "parts" in described:
        for part, inner in described["parts"].items():
            yield from _list_quantities(f"{name}: {part}", inner)
    elif "shape" in described:
        shape = " x ".join(str(length) for length in described["shape"]) or "one number"
        values = (described.get(key) for key in ("least", "mean", "most"))
        yield (name, shape, *(NONE if value is None else f"{value:.4g}" for value in values))
    else:
        yield (name, described["kind"], NONE, NONE, NONE)


def _world(experiment: AnyExperiment, scored: AnyScored) -> tuple[PageBlock, ...]:
    if scored.truth is None:
        return (Missing("the truth is unknown: this is no mocked run, or the file of its truth is missing"),)
    run = scored.run
    model = {
        "optics_level": scored.accuracy.get("touch.optics"),
        "calibration_sha256": run.calibration.sha256,
    }
    if not experiment.measured:
        model |= {"mesh_vertices": len(run.mesh.vertices), "mesh_faces": len(run.mesh.faces)}
    rows = []
    for key, value in flatten(scored.truth.differences):
        name, number, unit = format_key(key, value)
        known = "" if model.get(key) is None else format_key(key, model[key])[1]
        rows.append((name, number, unit, known))
    return (
        "The mocked world was sampled for this run and differs from the estimator's model, which did not use "
        "these values.",
        ReportTable(("quantity", "world", "unit", "estimator's model"), rows, "lrlr"),
    )


def flatten(tree: Mapping[str, object], above: str = "") -> Iterator[tuple[str, object]]:
    """Yield the keys and values of the leaves of a tree, each key after those of its branches."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from flatten(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _versions(versions: Mapping[str, str]) -> ReportTable:
    return ReportTable(("software", "version"), list(versions.items()), "ll")


def _cost(experiment: AnyExperiment, scored: AnyScored, stages: Mapping[str, float]) -> Iterator[PageBlock]:
    total = {"all stages": float(scored.result["seconds"])}
    rows = [(stage, duration(seconds)) for stage, seconds in {**stages, **total}.items()]
    yield ReportTable(("stage", "time"), rows, "lr")
    knobs = [
        (knob.name, str(scored.accuracy[knob.name]), knob.unit, knob.meaning) for knob in experiment.knobs
    ]
    yield ReportTable(("knob", "level of this answer", "unit", "meaning"), knobs, "lrll")
    front = front_at_hand(experiment, scored.run)
    point = None if front is None else front.at(scored.accuracy)
    if front is None or point is None:
        yield Missing(f"no cost curve has these levels; measure one with `touchstone cost {experiment.name}`")
        return
    yield (
        f"The cost curve of {front.made} has these levels, measured on {len(point.samples)} runs of "
        f"{front.steps} {experiment.plural}."
    )
    error = [f"{point.unit.scale * x:.3g}" for x in (point.error.value, point.error.low, point.error.high)]
    seconds = [duration(x) for x in (point.seconds.value, point.seconds.low, point.seconds.high)]
    curve = [(point.unit.label, *error), ("CPU time (geometric mean, 90 % interval)", *seconds)]
    yield ReportTable(("quantity", "value", "from", "to"), curve, "lrrr")
    if front.reasons:
        yield Notice(f"The cost curve is stale: {'; '.join(front.reasons)}.")
