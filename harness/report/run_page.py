"""The plain page of a run: what every experiment can show, whatever it asks."""

import datetime as dt
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.bench import microphone_take
from harness.bench.acquisition_channels import CLOCK, FLAGS, FORCE, PRESSURE
from harness.bench.device import Health, Reading
from harness.effects.explain import NetworkInUse, networks_at
from harness.experiment.compare import Comparison
from harness.experiment.experiment import AnyExperiment, AnyScored
from harness.recording.run_folder import RunFiles
from harness.report import wording
from harness.report.agreement_part import agreement_part
from harness.report.data import NOT_COMPARED, Artefact, EffectRun, InstrumentRow, Observed
from harness.report.figures.figures import Album, Picture
from harness.report.template import write_page
from harness.report.turned import TurnedSurface
from harness.report.values import Missing

PAGE = "report.html"
TEMPLATE = "run.html"

_LONGEST = 240
"""Letters of a value in the table of the answer."""

NO_TRUTH = Missing("the truth is not known: this is not a mocked run, or its truth was taken away")

_IN_BLOCKS = (FORCE, PRESSURE)
"""Channels whose every reading is a block of samples."""

_REMARKS = (CLOCK, FLAGS, microphone_take.CLOCK, microphone_take.FLAGS, microphone_take.CALLBACK)
"""Channels that say something of a capture and hold no sample."""

_HEARD_WITH = {"hammer": ("microphone",)}
"""Instruments whose box reads another's channels too."""


@dataclass(frozen=True)
class PageSection:
    """A part of a page that an experiment adds."""

    title: str  #: over it.
    words: str  #: a sentence or two.
    picture: Picture | None = None  #: below them; None for none.
    turned: TurnedSurface | None = None
    """a surface that a page's reader can turn, below the picture; None for none."""


def write_run_page(
    experiment: AnyExperiment,
    scored: AnyScored,
    comparison: Comparison,
    health: Mapping[str, Health] | None,
    folder: Path,
    sections: Sequence[PageSection] = (),
) -> Path:
    """Write the page; its path.

    Args:
        experiment: that the run is of.
        scored: the answer.
        comparison: what the scene observes.
        health: of the instruments at the end of the session; None for a replay.
        folder: made if it does not exist.
        sections: that the experiment adds, after the answer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    run, result = scored.run, scored.result
    named = {"object": run.scene.object.name, "mock": run.recording.header.mock is not None}
    facts = facts_of(experiment.title, scored, comparison, health)
    data = {
        **facts,
        "lines": experiment.lines({**result, **named}),
        "answer": [(name, _text(value)) for name, value in flat(result) if name.split(".")[-1] != "warnings"],
        "sections": sections,
        "steps": f"{run.recording.committed} {experiment.plural}",
        "warnings": (*scored.warnings, *result.get("warnings", ())),
    }
    return write_page(
        folder / PAGE,
        TEMPLATE,
        data=data,
        say=wording,
        is_missing=lambda value: isinstance(value, Missing),
        agreement=agreement_part(facts["agreement"], Album(folder)),
    )


def facts_of(
    title: str,
    scored: AnyScored,
    comparison: Comparison,
    health: Mapping[str, Health] | None,
    ours: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """What every report says of a run, by the names of ``ReportData``.

    Args:
        title: of the experiment.
        scored: the answer.
        comparison: what the scene observes.
        health: of the instruments at the end of the session; None for a replay.
        ours: the estimator's side of what the world did differently.
    """
    run, header = scored.run, scored.run.recording.header
    return {
        "title": f"{title}: {run.scene.title or run.scene.object.name}",
        "object_name": run.scene.object.name,
        "material": run.scene.object.material,
        "mock": header.mock is not None,
        "made": header.created,
        "command": " ".join(["touchstone", *sys.argv[1:]]),
        "recording": str(run.recording.folder),
        "instruments": instruments(run, health),
        "calibrations": artefacts(run),
        "effects": effect_rows(comparison),
        "networks": network_rows(scored),
        "observed": tuple(
            row for name, said in comparison.observed().items() for row in _observed(name, said)
        ),
        "agreement": comparison.agreement or NOT_COMPARED,
        "world": (
            NO_TRUTH
            if scored.truth is None
            else {
                name: _said(value) for name, value in (*flat(scored.truth.differences), *(ours or {}).items())
            }
        ),
        "versions": {name: text for name, text in header.versions.items() if name != "git"},
        "git": header.versions["git"],
    }


def _text(value: Any) -> str:
    """Of a value of the result, the beginning where it is long: a fit may have thousands of numbers."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list) and value and all(isinstance(one, float) for one in value):
        value = [float(f"{one:.6g}") for one in value]
    text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."


def effect_rows(comparison: Comparison) -> tuple[EffectRun, ...]:
    """Every effect of the plan: those that ran with what they took, those left out with the reason."""
    plan, evaluation = comparison.plan, comparison.evaluation
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


def network_rows(scored: AnyScored) -> tuple[NetworkInUse, ...]:
    """The networks that stood for a simulation in an answer; none where the run carries no ObjectFile."""
    if scored.run.scene.object.objectfile is None:
        return ()
    return networks_at(scored.run.objectfile.description, scored.accuracy.levels)


def _observed(name: str, said: Mapping[str, Any]) -> Iterator[Observed]:
    if "parts" in said:
        for part, inner in said["parts"].items():
            yield from _observed(f"{name}: {part}", inner)
    elif "shape" in said:
        shape = " x ".join(str(length) for length in said["shape"]) or "one number"
        yield Observed(name, shape, said.get("least"), said.get("mean"), said.get("most"))
    else:
        yield Observed(name, said["kind"])


def flat(tree: Mapping[str, object], above: str = "") -> Iterator[tuple[str, object]]:
    """Names and values of a tree, those of a branch with its name before theirs."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value else "0"  # nor -0
    if isinstance(value, list):
        return ", ".join(_said(item) for item in value)
    return str(value)


def instruments(run: RunFiles, health: Mapping[str, Health] | None) -> tuple[InstrumentRow, ...] | Missing:
    """One row an instrument.

    Args:
        run: the folder.
        health: at the end of the session; None for a replay.
    """
    if health is None:
        return Missing("estimated again from the recording: no instrument was open")
    nominal = {name: section.nominal_rate for name, section in run.station.sections.items()}
    counts: dict[str, int] = {}
    for step in run.recording.steps():
        for reading in step.readings.values():
            whose = reading.channel.name.split(".")[0]
            counts[whose] = counts.get(whose, 0) + samples(reading)
    return tuple(
        InstrumentRow(
            name=" and ".join(names),
            address=said.identity,
            rate=said.rate,
            nominal_rate=nominal.get(name),
            readings=sum(counts.get(one, 0) for one in names),
            drops=said.drops,
            latency_median=said.latency,
            remark=said.detail,
        )
        for name, said in health.items()
        for names in [[name, *(other for other in _HEARD_WITH.get(name, ()) if other not in health)]]
    )


def samples(reading: Reading) -> int:
    """How many samples a reading holds: each count of a block is one, a remark on a capture is none."""
    if reading.channel.name in _REMARKS:
        return 0
    return int(reading.values.size) if reading.channel.name in _IN_BLOCKS else len(reading.times)


def artefacts(run: RunFiles) -> tuple[Artefact, ...]:
    """The gel's calibration and, where the run was to be heard, that of the hammer's box."""
    header, acquisition = run.calibration.header, run.acquisition
    gel = Artefact(
        name=f"tactile optics of {header.sensor}",
        serial=header.serial,
        made=header.date,
        age_days=_age(run, header.date),
        residual=f"{header.held_out_db:.1f} dB on presses held out, {header.residual_rms:.1f} counts rms",
        sha256=run.calibration.sha256,
    )
    if acquisition is None:
        return (gel,)
    box = Artefact(
        name=f"newtons and pascals of {acquisition.model}",
        serial=f"{acquisition.serial}, hammer {acquisition.hammer_serial}, "
        f"microphone {acquisition.microphone_serial}",
        made=acquisition.date,
        age_days=_age(run, acquisition.date),
        residual=f"{100.0 * acquisition.residual:.1f} % of {acquisition.made_from}",
        sha256=acquisition.hash,
    )
    return gel, box


def _age(run: RunFiles, date: str) -> float:
    """Days from an artefact's date to the run."""
    made = dt.datetime.fromisoformat(date)
    made = made if made.tzinfo is not None else made.replace(tzinfo=dt.UTC)
    age = dt.datetime.fromisoformat(run.recording.header.created) - made
    return age.total_seconds() / 86400.0
