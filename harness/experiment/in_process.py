"""Runs of tables and cost curves on the mocked bench without sockets, in simulated time."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.basics.errors import WrongUse
from harness.basics.files.lock_file import hold_briefly
from harness.bench.experiments import loaded
from harness.bench.gap import lasting_name
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import AnyExperiment
from harness.experiment.truth import truth_paths
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet


@dataclass(frozen=True)
class RunCell:
    """One run of a table or a cost curve; a subclass adds the conditions that it varies as fields."""

    object: str  #: name of the object among the subjects.
    gap: str  #: reality gap of the mocked bench: a name or a file.
    seed: int  #: random seed of the plan and of the mocked world.

    @property
    def conditions(self) -> dict[str, str]:
        """Conditions of the run by name."""
        return {name: value for name, value in vars(self).items() if name not in ("object", "seed")}

    @property
    def name(self) -> str:
        """Name of the run's file and folder."""
        return "-".join((self.object, *self.conditions.values(), str(self.seed))).replace("/", "_")

    def create_scene(self, scene: SceneFile) -> SceneFile:
        """Create the scene of the run from that of its object."""
        return scene


def perform_run(
    experiment: AnyExperiment, cell: RunCell, scene: SceneFile, station: Station, folder: Path
) -> Recording:
    """Plan, rehearse and perform a run on the mocked bench without sockets, in simulated time.

    Args:
        experiment: the experiment.
        cell: the run; only its seed and its gap are used.
        scene: scene of the run.
        station: a mocked station.
        folder: new folder of the run; the truth is written next to it.
    """
    # A report imports this module for measured curves, and needs no simulator of the arm.
    from harness.experiment.begin import begin
    from harness.experiment.perform import IN_PROCESS_BENCH, perform_on

    recording = begin(experiment, scene, station, cell.seed, cell.gap, folder).recording
    run = RunFiles(recording)
    perform_on(experiment, loaded(IN_PROCESS_BENCH)(run.scene, run.station, run.context), run, Quiet())
    return recording


def record_run(
    experiment: AnyExperiment, cell: RunCell, scene: SceneFile, station: Station, folder: Path
) -> Recording:
    """Return a run from a folder of recordings; it is performed if it is not there.

    Args:
        experiment: the experiment.
        cell: the run; its name is the name of its folder.
        scene: scene of the run.
        station: a mocked station.
        folder: folder of all recordings. A run is performed in another folder and moved here when complete.

    Raises:
        WrongUse: the folder has a run of that name with another scene, seed or gap.
    """
    path = folder / cell.name
    if path.exists():
        found = Recording(path)
        _require_same(found, experiment, cell, scene)
        return found
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".performing-", dir=folder) as aside:
        performed = perform_run(experiment, cell, scene, station, Path(aside) / cell.name)
        with hold_briefly(path.with_name(f".{path.name}.lock")):
            if not path.exists():  # if another process was first, its run stays
                for truth in truth_paths(performed):
                    if truth.exists():
                        truth.replace(path.parent / truth.name)
                performed.folder.replace(path)
        return Recording(path)


@contextmanager
def open_run(
    experiment: AnyExperiment,
    cell: RunCell,
    scene: SceneFile,
    station: Station,
    recordings: Path | None = None,
) -> Iterator[RunFiles]:
    """Provide the recording of a run, see ``record_run``; a temporary one without a folder of recordings."""
    folder: AbstractContextManager[str | Path] = (
        TemporaryDirectory(prefix="touchstone-run-") if recordings is None else nullcontext(recordings)
    )
    with folder as path:
        yield RunFiles(record_run(experiment, cell, scene, station, Path(path)))


def _require_same(found: Recording, experiment: AnyExperiment, cell: RunCell, scene: SceneFile) -> None:
    header, gap = found.header, lasting_name(cell.gap)
    differing = [
        name
        for name, there, wanted in (
            ("experiment", header.experiment, experiment.name),
            ("seed", header.seed, cell.seed),
            ("gap", (header.mock or {}).get("gap"), gap),
        )
        if there != wanted
    ]
    wanted = scene.model_dump(mode="json", by_alias=True)
    wanted.pop("observe")
    differing += [name for name, value in wanted.items() if not _within(value, header.scene.get(name))]
    if differing:
        raise WrongUse(
            f"{found.folder} is the recording of another run: it differs in {', '.join(differing)}; give "
            "another folder of recordings, or take that one away"
        )


def _within(wanted: object, there: object) -> bool:
    """State whether a recorded scene, which includes the defaults, has every value of a scene."""
    if isinstance(wanted, Mapping) and isinstance(there, Mapping):
        return all(_within(value, there.get(key)) for key, value in wanted.items())
    return bool(wanted == there)
