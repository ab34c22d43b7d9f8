"""The plain page of a run: what every experiment can show, whatever it asks."""

import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.bench.device import Health
from harness.experiment.compare import Comparison
from harness.experiment.experiment import Experiment, Scored
from harness.report import wording
from harness.report.data import Artefact, EffectRun, InstrumentRow
from harness.report.instruments import artefacts, instruments
from harness.report.observed import Observed, observed_rows
from harness.report.simulated import effect_rows, world_rows
from harness.report.template import rendered
from harness.report.values import Missing

PAGE = "report.html"
TEMPLATE = "run.html"


@dataclass(frozen=True, eq=False)
class RunPage:
    """All that the page shows.

    Attributes:
        title: what was asked, of what.
        lines: the answer for people.
        values: the answer by name, as text.
        step: what steps are called.
        steps: how many.
        object_name: as the operator calls it.
        material: of the object.
        mock: whether the far end of every cable was a mock.
        made: date and time of the run, as text.
        command: what was typed.
        recording: where it lies, as text.
        instruments: one row each.
        calibrations: one row each.
        effects: one row each.
        observed: what the scene observes, simulated at the answer.
        world: what the mocked world did differently, by name.
        versions: of packages, by name.
        git: hash of the checkout.
        warnings: what the operator should know.
    """

    title: str
    lines: tuple[str, ...]
    values: tuple[tuple[str, str], ...]
    step: str
    steps: int
    object_name: str
    material: str
    mock: bool
    made: str
    command: str
    recording: str
    instruments: tuple[InstrumentRow, ...] | Missing
    calibrations: tuple[Artefact, ...] | Missing
    effects: tuple[EffectRun, ...]
    observed: tuple[Observed, ...]
    world: dict[str, str] | Missing
    versions: dict[str, str]
    git: str
    warnings: tuple[str, ...]


def write_run_page(
    experiment: Experiment,
    scored: Scored,
    comparison: Comparison,
    health: Mapping[str, Health] | None,
    folder: Path,
) -> Path:
    """Write the page; its path.

    Args:
        experiment: that the run is of.
        scored: the answer.
        comparison: what the scene observes.
        health: of the instruments at the end of the session; None for a replay.
        folder: made if it does not exist.
    """
    folder.mkdir(parents=True, exist_ok=True)
    data = page_of(experiment, scored, comparison, health)
    page = rendered(TEMPLATE, data=data, say=wording, is_missing=lambda value: isinstance(value, Missing))
    (folder / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def page_of(
    experiment: Experiment, scored: Scored, comparison: Comparison, health: Mapping[str, Health] | None
) -> RunPage:
    """What the page of a scored run shows."""
    run, header = scored.run, scored.run.recording.header
    result = experiment.result(scored)
    return RunPage(
        title=f"{experiment.title}: {run.scene.title or run.scene.object.name}",
        lines=tuple(
            experiment.lines({**result, "object": run.scene.object.name, "mock": header.mock is not None})
        ),
        values=tuple(_flat(result)),
        step=experiment.plural,
        steps=run.recording.committed,
        object_name=run.scene.object.name,
        material=run.scene.object.material,
        mock=header.mock is not None,
        made=header.created,
        command=" ".join(["touchstone", *sys.argv[1:]]),
        recording=str(run.recording.folder),
        instruments=instruments(run, health),
        calibrations=artefacts(run),
        effects=effect_rows(comparison),
        observed=observed_rows(comparison),
        world=world_rows(scored, {}),
        versions={name: text for name, text in header.versions.items() if name != "git"},
        git=header.versions["git"],
        warnings=(*scored.warnings, *result.get("warnings", ())),
    )


def _flat(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{name}.")
        elif name != "warnings":
            yield f"{above}{name}", f"{value:.6g}" if isinstance(value, float) else str(value)
