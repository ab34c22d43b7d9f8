"""How often contact localization refuses the right object, at every level of its dials, and another object.

``python tests/benchmarks/touch/bench_refused.py [OBJECT ...] [--seeds 20] [--first-seed 31000] [--spacing
close] [--sense touch] [--level default] [--another] [--rows FILE]`` performs runs of six contacts on the
mocked bench in process, gap default, yaw known. It answers each contact by itself, each two that follow
each other and all six, with every dial at its default, at its cheapest and at its finest level, one dial at
a time and all together; ``--sense`` and ``--level`` choose among those. By touch alone nothing is struck.
Without OBJECT the nine objects of the tables, as far as their meshes are there; a seed of every object
comes before the next seed, so a table that was stopped is even over objects. With ``--another`` each run is
answered by the next object's model instead, and should be refused. With ``--rows`` every answer is appended
to a file of JSON lines, and a run that lies in it is not performed again; ``--seeds 0`` prints what there
is.
"""

import json
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console

sys.path.insert(0, str(Path(__file__).parents[3]))

from experiments.contact_localization.accuracy.measurement import ContactMeasurement
from experiments.contact_localization.accuracy.run import ContactRun, run_of
from experiments.contact_localization.answer import Models, prepare, solve
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.posterior.estimate import (
    BLOCK,
    METHOD,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
    Senses,
)
from experiments.contact_localization.posterior.policy import Readings
from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.accuracy import Knob, Level, Setting
from harness.effects.scene_object import known_object
from harness.effects.sound import EDGE, MODES
from harness.experiment.in_process import RunCell, open_run
from harness.experiment.subjects import objects
from harness.recording.run_folder import station_calibration
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.support.localization import conditions
from tests.support.real_data import find_shared_data

COUNTS = (1, 2, 6)
"""Contacts that are answered together: all of them, or as many groups of a run's as there are."""

DEFAULT = "default"
_OWN = (SPACING, ROUNDS, SAMPLES, BLOCK)


@dataclass(frozen=True)
class CheckedAnswer:
    """One answer, or refusal, of some contacts of a run."""

    object: str  #: its name.
    seed: int  #: of the run.
    spacing: str  #: of its contacts.
    model: str  #: name of the object that it was answered by.
    sense: Senses  #: that answered.
    level: str  #: which dial was turned, and to what.
    contacts: int  #: how many were used.
    first: int  #: the first of them, from 0.
    refusal: str  #: the program's sentence; empty where it answered.
    error: float | None  #: m, of the last of them; None where it was refused.
    inside: bool  #: whether the truth is in the region of 90 %.
    fits: tuple[float | None, ...]
    """nats of the contacts' own fits at the answer; None for one that was not used."""


def settings(sense: Senses) -> Mapping[str, Setting]:
    """The default, every dial at its cheapest and its finest level, and all of them so together."""
    method: Setting = {SENSES.name: sense, METHOD.name: "grid"}
    own: tuple[Knob[Level], ...] = (*_OWN, MODES) if sense == "both" else _OWN
    default = {knob.name: knob.default for knob in own}
    turned: dict[str, Setting] = {DEFAULT: {**method, **default}}
    for knob in own:
        for level in (knob.levels[0], knob.levels[-1]):
            if level != knob.default:
                turned[f"{knob.name} {level}"] = {**method, **default, knob.name: level}
    cheap: Setting = {EDGE.name: EDGE.levels[0]} if sense == "both" else {}
    turned["all cheapest"] = {**method, **{knob.name: knob.levels[0] for knob in own}, **cheap}
    # Finer elements than the default take minutes an object, and a refusal is by the images.
    turned["all finest"] = {**method, **{knob.name: knob.levels[-1] for knob in own}}
    return turned


def checked(
    cell: RunCell,
    run: ContactRun,
    model: str,
    models: Models,
    senses: Collection[Senses],
    levels: Collection[str],
) -> Iterator[CheckedAnswer]:
    """A run's contacts, answered by an object's model at some levels, all where none is named."""
    readings = run.readings({})
    for sense in senses:
        for level, setting in settings(sense).items():
            if not levels or level in levels:
                under = readings.under(models.at(setting))
                prepare(under.model, setting)
                for count, first in _groups(len(run.observations)):
                    some = _group(under, count, first)
                    true = run.truth[first + count - 1]
                    yield _checked(cell, model, sense, level, first, some, setting, true)


def _groups(contacts: int) -> Iterator[tuple[int, int]]:
    """How many contacts are answered together, and the first of them."""
    for count in COUNTS:
        yield from ((count, first) for first in range(0, contacts - count + 1, count))


def _group(readings: Readings, count: int, first: int) -> Readings:
    """Of some contacts that follow each other alone."""
    chosen = range(first, first + count)
    return replace(
        readings,
        observations=tuple(readings.observations[k] for k in chosen),
        gels=tuple(readings.gels[k] for k in chosen),
    )


def _checked(
    cell: RunCell,
    model: str,
    sense: Senses,
    level: str,
    first: int,
    readings: Readings,
    setting: Setting,
    true: FloatArray,
) -> CheckedAnswer:
    count, solved = len(readings.observations), solve(readings, setting)
    found = solved.found
    return CheckedAnswer(
        object=cell.object,
        seed=cell.seed,
        spacing=cell.conditions["spacing"],
        model=model,
        sense=sense,
        level=level,
        contacts=count,
        first=first,
        refusal=solved.refusal or "",
        error=None if found is None else float(np.linalg.norm(found.position_in_object - true)),
        inside=found is not None and bool(found.region.contains(true)),
        fits=() if found is None else tuple(gate.fit for gate in found.gates),
    )


@dataclass(frozen=True)
class Choice:
    """What is answered of every run."""

    spacing: str  #: of the contacts.
    senses: Collection[Senses]  #: that answer.
    levels: Collection[str]  #: that are answered at; none for all.
    another: bool  #: whether the next object's model answers in place of the run's own.


def checked_runs(
    scenes: Mapping[str, SceneFile], seeds: range, choice: Choice, rows: Path | None
) -> list[CheckedAnswer]:
    """Every answer of every run, and those that a file holds already."""
    console, station = Console(stderr=True), load_station(station_path("mock"))
    found, names = [] if rows is None else rows_of(rows), list(scenes)
    there = {(row.object, row.seed, row.spacing) for row in found}
    answering = dict(zip(names, names[1:] + names[:1] if choice.another else names, strict=True))
    models: dict[str, Models] = {}
    measured = ContactMeasurement(EXPERIMENT)
    chosen = conditions(choice.spacing, sense="both" if "both" in choice.senses else "touch")
    for cell in measured.cells(names, seeds, chosen):
        if (cell.object, cell.seed, cell.conditions["spacing"]) in there:
            continue
        model = answering[cell.object]
        if model not in models:
            models[model] = _models(replace(cell, object=model).create_scene(scenes[model]), station)
        try:
            with open_run(EXPERIMENT, cell, cell.create_scene(scenes[cell.object]), station) as files:
                run = run_of(files)
        except TouchstoneError as error:
            console.print(f"{cell.name} was not performed: {error}")
            continue
        new = list(checked(cell, run, model, models[model], choice.senses, choice.levels))
        found += new
        _append(rows, new)
        console.print(f"{cell.name} answered")
    return found


def _models(scene: SceneFile, station: Station) -> Models:
    mesh, calibration = known_object(scene).mesh, station_calibration(station)
    return Models(lambda accuracy: model_of_scene(scene, station, mesh, calibration, accuracy))


def rows_of(path: Path) -> list[CheckedAnswer]:
    """What a file of JSON lines holds; nothing where there is none yet."""
    if not path.exists():
        return []
    lines = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return [CheckedAnswer(**{**line, "fits": tuple(line["fits"])}) for line in lines]


def _append(path: Path | None, new: Iterable[CheckedAnswer]) -> None:
    if path is not None:
        with path.open("a", encoding="utf-8") as stream:
            stream.writelines(f"{json.dumps(asdict(row))}\n" for row in new)


def finish_levels(rows: Sequence[CheckedAnswer]) -> None:
    """Print or write by sense, level and contacts: refused, mean error of the rest, in their region, lost.

    Lost are answers that hold the truth at the default levels, and here are refused or do not.
    """
    cells_of = []
    right = {_run_of(row) for row in rows if row.level == DEFAULT and row.inside}
    for sense, level in dict.fromkeys((row.sense, row.level) for row in rows):
        of = [row for row in rows if (row.sense, row.level) == (sense, level)]
        parts = ([row for row in of if row.contacts == count] for count in COUNTS)
        cells_of.append([f"{sense}, {level}", *(cell for part in parts for cell in _counted(part, right))])
    heads = (f"{count} contacts: refused; mean error [mm] .1f; in the region; lost" for count in COUNTS)
    finish_figure("localization", "refused", "; ".join(("sense and levels", *heads)), cells_of)


def finish_refusals(rows: Sequence[CheckedAnswer]) -> None:
    """Print by object and contacts: refused answers of all levels and senses, and the runs they are from."""
    table = []
    for name in (*dict.fromkeys(row.object for row in rows), "all"):
        cells_of = []
        for count in COUNTS:
            of = [row for row in rows if name in (row.object, "all") and row.contacts == count]
            refused = [row for row in of if row.refusal]
            runs = {(row.object, row.seed, row.spacing) for row in refused}
            cells_of.append(f"{len(refused)} / {len(of)}, {len(runs)}")
        table.append([name, *cells_of])
    heads = (f"{count} contacts: refused / of, runs" for count in COUNTS)
    finish_figure("localization", "refused by object", "; ".join(("object", *heads)), table)


def _counted(rows: Sequence[CheckedAnswer], right: Collection[tuple[object, ...]]) -> list[Cell]:
    errors = [row.error for row in rows if row.error is not None]
    lost = sum(_run_of(row) in right and not row.inside for row in rows)
    mean = 1e3 * sum(errors) / len(errors) if errors else None
    return [f"{len(rows) - len(errors)} / {len(rows)}", mean, sum(row.inside for row in rows), lost]


def _run_of(row: CheckedAnswer) -> tuple[object, ...]:
    return row.object, row.seed, row.spacing, row.model, row.sense, row.contacts, row.first


def main() -> None:
    """Perform, answer, and print two tables."""
    options = benchmark_parser(__doc__)
    options.add_argument("objects", nargs="*")
    options.add_argument("--seeds", type=int, default=20)
    options.add_argument("--first-seed", type=int, default=31000)
    options.add_argument("--spacing", choices=("close", "spread"), default="close")
    options.add_argument("--sense", action="append", choices=("touch", "both"))
    options.add_argument("--level", action="append", default=[])
    options.add_argument("--another", action="store_true")
    options.add_argument("--rows", type=Path)
    given = options.parse_args()
    every = objects(find_shared_data())
    scenes = {name: every[name] for name in given.objects or every}
    choice = Choice(given.spacing, given.sense or ("touch", "both"), given.level, given.another)
    seeds = range(given.first_seed, given.first_seed + given.seeds)
    rows = checked_runs(scenes, seeds, choice, given.rows)
    finish_levels(rows)
    finish_refusals(rows)


if __name__ == "__main__":
    main()
