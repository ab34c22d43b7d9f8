"""The plain page of a run: what every experiment can show, whatever it asks."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.bench.device import Health
from harness.experiment.compare import Comparison
from harness.experiment.experiment import Experiment, Scored
from harness.report import wording
from harness.report.agreement_part import agreement_part
from harness.report.data import NOT_COMPARED
from harness.report.figures.figures import Album, Picture
from harness.report.instruments import artefacts, instruments
from harness.report.simulated import effect_rows, flat, network_rows, observed_rows, world_rows
from harness.report.template import write_page
from harness.report.turned import TurnedSurface
from harness.report.values import Missing

PAGE = "report.html"
TEMPLATE = "run.html"

_LONGEST = 240
"""Letters of a value in the table of the answer."""


@dataclass(frozen=True)
class PageSection:
    """A part of a page that an experiment adds.

    Attributes:
        title: over it.
        words: a sentence or two.
        picture: below them; None for none.
        turned: a surface that a page's reader can turn, below the picture; None for none.
    """

    title: str
    words: str
    picture: Picture | None = None
    turned: TurnedSurface | None = None


def write_run_page(
    experiment: Experiment,
    scored: Scored,
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
    scored: Scored,
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
        "observed": observed_rows(comparison),
        "agreement": comparison.agreement or NOT_COMPARED,
        "world": world_rows(scored, ours or {}),
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
