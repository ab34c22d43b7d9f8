"""Runs on the mocked bench without sockets, in simulated time; kept on the disk on request."""

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.basics.errors import WrongUse
from harness.basics.files.lock_file import hold_briefly
from harness.bench.experiments import loaded
from harness.bench.gap import lasting_name
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.begin import begin
from harness.experiment.experiment import AnyExperiment, RunCell
from harness.experiment.perform import IN_PROCESS_BENCH, perform_on
from harness.experiment.truth import truth_paths
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet


def performed(
    experiment: AnyExperiment, cell: RunCell, scene: SceneFile, station: Station, folder: Path
) -> Recording:
    """Plan, rehearse and perform a run.

    Args:
        experiment: which.
        cell: gives its seed and its gap.
        scene: on the table.
        station: the bench.
        folder: of the run, not there yet; the truth comes beside it.
    """
    gap = cell.conditions["gap"]
    recording = begin(experiment, scene, station, cell.seed, gap, folder).recording
    run = RunFiles(recording)
    perform_on(experiment, loaded(IN_PROCESS_BENCH)(run.scene, run.station, run.context), run, Quiet())
    return recording


def recorded(
    experiment: AnyExperiment, cell: RunCell, scene: SceneFile, station: Station, folder: Path
) -> Recording:
    """The run of a cell as it lies in a folder of recordings; performed and put there where it does not.

    Args:
        experiment: which.
        cell: its name is that of its run's folder.
        scene: on the table.
        station: the bench.
        folder: of all recordings. A run is made aside and moved there when it is whole.

    Raises:
        WrongUse: a run of that name is there, of another scene, seed or gap.
    """
    path = folder / cell.name
    if path.exists():
        found = Recording(path)
        _require_same(found, experiment, cell, scene)
        return found
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".performing-", dir=folder) as aside:
        made = performed(experiment, cell, scene, station, Path(aside) / cell.name)
        with hold_briefly(path.with_name(f".{path.name}.lock")):
            if not path.exists():  # where another process was first, its run stays
                for truth in truth_paths(made):
                    if truth.exists():
                        truth.replace(path.parent / truth.name)
                made.folder.replace(path)
        return Recording(path)


def _require_same(found: Recording, experiment: AnyExperiment, cell: RunCell, scene: SceneFile) -> None:
    header, gap = found.header, lasting_name(cell.conditions["gap"])
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
    """Whether all that a scene says is so in a recorded one, which says its defaults too."""
    if isinstance(wanted, Mapping) and isinstance(there, Mapping):
        return all(_within(value, there.get(key)) for key, value in wanted.items())
    return bool(wanted == there)
