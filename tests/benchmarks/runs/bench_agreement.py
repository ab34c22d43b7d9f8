"""How often live readings fit the right model, and how often a wrong one is named.

``python tests/benchmarks/runs/bench_agreement.py RECORDINGS [--seeds 10] [--first-seed 6001] [--case NAME]``
performs runs of contact localization with strikes in process, gap on, six built-in objects, and compares each
with the right model and with wrong ones. The folder keeps the recordings, and in ``rows.jsonl`` what was
compared: what is there is not done again; take that file away after a change of the comparison. A solid of
revolution that is turned about its axis is not moved; it is left out of that row. The pitcher is not struck:
to solve for the modes of its mocked truth takes two minutes a run. Seconds are of CPU.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from itertools import product
from pathlib import Path
from time import process_time

import numpy as np
from rich.console import Console

from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.experiment import EXPERIMENT
from harness.agreement.agreement import Sense, Verdict
from harness.agreement.compare_run import agreement_of
from harness.agreement.subject import Subject, own_subject, subject_of_file
from harness.basics.materials import material
from harness.bench.scene import scene_from_options
from harness.bench.scene_objectfile import shipped_objectfiles
from harness.bench.station_file import Station, load_station, station_path
from harness.experiment.in_process import record_run
from harness.objects.household import MATERIALS, build
from harness.recording.run_folder import RunFiles
from harness.sim.optics.tactile_calibration import TactileCalibration
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

OBJECTS = tuple(MATERIALS)
ROUND = ("bowl", "plate")
"""Solids of revolution."""

SILENT = ("pitcher",)

SENSES: tuple[Sense, ...] = ("arm", "touch", "sound")
MOVED = 10.0e-3
TURNED = np.radians(15.0)


@dataclass(frozen=True)
class ComparedRun:
    """One run against one model."""

    case: str  #: what was wrong: a key of ``CASES``, or ``"moved microphone"``.
    run: str  #: the recording's name.
    object: str  #: that was recorded.
    verdicts: Mapping[Sense, Verdict]  #: by sense.
    sentences: Sequence[str]  #: of every sense.
    seconds: float  #: of CPU.

    @property
    def doubts(self) -> tuple[str, ...]:
        """The senses that do not fit."""
        return tuple(sense for sense, verdict in self.verdicts.items() if verdict == "does not fit")


def moved(subject: Subject, seed: int) -> Subject:
    """The object stated 10 mm from where it stood, any way along the table."""
    angle = np.random.default_rng((seed, 21)).uniform(0.0, 2.0 * np.pi)
    x, y, z = subject.scene.object.pose.position
    aside = MOVED * np.array([np.cos(angle), np.sin(angle)])
    return _posed(subject, position=(float(x + aside[0]), float(y + aside[1]), z))


def turned(subject: Subject, seed: int) -> Subject:
    """The object stated 15 degrees from how it stood, either way about the vertical."""
    sign = np.random.default_rng((seed, 22)).choice([-1.0, 1.0])
    return _posed(subject, yaw=float(subject.scene.object.pose.yaw + sign * TURNED))


def _posed(subject: Subject, **pose: object) -> Subject:
    object_ = subject.scene.object
    scene = subject.scene.model_copy(
        update={"object": object_.model_copy(update={"pose": object_.pose.model_copy(update=pose)})}
    )
    return replace(subject, scene=scene)


def another_object(subject: Subject, seed: int) -> Subject:
    """Another of the built-in objects, at the same place."""
    own = OBJECTS.index(subject.scene.object.name)
    name = OBJECTS[(own + 1 + seed % (len(OBJECTS) - 1)) % len(OBJECTS)]
    object_ = scene_from_options(f"builtin:{name}").object
    object_ = object_.model_copy(update={"pose": subject.scene.object.pose})
    scene = subject.scene.model_copy(update={"object": object_})
    return replace(subject, scene=scene, mesh=build(name), material=material(object_.material))


class OtherLamps(RunFiles):
    """A run beside the calibration of a sensor whose lamps stand a third of a turn around."""

    @cached_property
    def calibration(self) -> TactileCalibration:
        """Red is where green was."""
        own = super().calibration
        return replace(
            own,
            background=np.roll(own.background, 1, axis=-1),
            table=np.roll(own.table, 1, axis=-1),
            smooth=np.roll(own.smooth, 1, axis=-1),
        )


NETWORKS = "right, by its ObjectFile"
CASES: Mapping[str, Callable[[RunFiles, int], Subject]] = {
    "right": lambda run, _: own_subject(run),
    NETWORKS: lambda run, _: subject_of_file(run, shipped_objectfiles()[run.scene.object.name]),
    "another object": lambda run, seed: another_object(own_subject(run), seed),
    "moved 10 mm": lambda run, seed: moved(own_subject(run), seed),
    "turned 15 deg": lambda run, seed: turned(own_subject(run), seed),
    "another sensor's lamps": lambda run, _: own_subject(OtherLamps(run.recording)),
}
MICROPHONE = "moved microphone"


def compared(case: str, run: RunFiles, subject: Subject) -> ComparedRun:
    """A run against a model."""
    began = process_time()
    found = agreement_of(subject.run, subject)
    seconds = process_time() - began
    verdicts = {one.compared.sense: one.verdict for one in found.senses}
    name = run.recording.folder.name
    return ComparedRun(case, name, run.scene.object.name, verdicts, found.sentences(), seconds)


class Rows:
    """What was compared before, in a file of a JSON object a line."""

    def __init__(self, path: Path) -> None:
        self._path = path
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        found = [ComparedRun(**json.loads(line)) for line in lines]
        self._known = {(row.case, row.run): row for row in found}

    def row(self, case: str, run: RunFiles, subject_of: Callable[[], Subject]) -> ComparedRun:
        """As it is known, or compared now."""
        key = case, run.recording.folder.name
        if key not in self._known:
            self._known[key] = compared(case, run, subject_of())
            with self._path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(self._known[key])) + "\n")
        return self._known[key]


def rows(
    seed: int, folder: Path, station: Station, known: Rows, cases: Sequence[str]
) -> Iterator[ComparedRun]:
    """Every run of a seed against every model of some cases."""
    for gap, name in product(("default", "moved_microphone"), OBJECTS):
        cell = ContactCell(name, gap, seed, "spread", sound=name not in SILENT)
        still = gap == "default"
        if not (still or (cell.sound and MICROPHONE in cases)):
            continue
        scene = cell.create_scene(scene_from_options(f"builtin:{name}"))
        run = RunFiles(record_run(EXPERIMENT, cell, scene, station, folder))
        if not still:
            yield known.row(MICROPHONE, run, partial(own_subject, run))
            continue
        for case, subject_of in CASES.items():
            if case in cases and not (case.startswith("turned") and name in ROUND):
                yield known.row(case, run, partial(subject_of, run, cell.seed))


def finish_cases(found: Sequence[ComparedRun]) -> None:
    """Print or write a row for each case: runs, those in doubt, and the senses that are; median seconds."""
    cells: list[list[Cell]] = []
    for case in (*CASES, MICROPHONE):
        of = [row for row in found if row.case == case]
        if of:
            doubted = [sum(sense in row.doubts for row in of) for sense in SENSES]
            seconds = np.array([row.seconds for row in of])
            doubts = sum(bool(row.doubts) for row in of)
            cells.append([case, len(of), doubts, *doubted, float(np.median(seconds))])
    heads = "; ".join(f"by {sense}" for sense in SENSES)
    finish_figure(
        "objectfile", "agreement", f"case; runs; in doubt; {heads}; time, median [CPU s] .1f", cells
    )


def finish_objects(found: Sequence[ComparedRun]) -> None:
    """Print the runs in doubt of each object, of how many."""
    cells = []
    for case in (*CASES, MICROPHONE):
        of = {name: [row for row in found if (row.case, row.object) == (case, name)] for name in OBJECTS}
        cells.append([case, *(f"{sum(bool(r.doubts) for r in each)} of {len(each)}" for each in of.values())])
    finish_figure("objectfile", "agreement by object", "; ".join(("in doubt", *OBJECTS)), cells)


def main() -> None:
    """Perform what is not there, compare, and print."""
    options = benchmark_parser(__doc__)
    options.add_argument("recordings", type=Path)
    options.add_argument("--seeds", type=int, default=10)
    options.add_argument("--first-seed", type=int, default=6001)
    every = (*CASES, MICROPHONE)
    options.add_argument("--case", choices=every, action="append", help="may be given again; all if left out")
    given = options.parse_args()
    seeds, console = range(given.first_seed, given.first_seed + given.seeds), Console(width=140)
    given.recordings.mkdir(parents=True, exist_ok=True)
    station = load_station(station_path("mock"))
    known = Rows(given.recordings / "rows.jsonl")
    found: list[ComparedRun] = []
    for seed in seeds:
        for row in rows(seed, given.recordings, station, known, given.case or every):
            found.append(row)
            shown = row.sentences if bool(row.doubts) == row.case.startswith("right") else ()
            console.print(f"{row.case}, {row.object}: {', '.join(row.doubts) or 'fits'}", *shown, sep="\n  ")
        console.print(f"to seed {seed}")
        finish_cases(found)
        finish_objects(found)


if __name__ == "__main__":
    main()
