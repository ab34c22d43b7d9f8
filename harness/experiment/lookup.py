"""Experiments by name, and whose run a folder is."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.whole_file import make_folder
from harness.bench.experiments import EXPERIMENTS, loaded, require_experiment
from harness.experiment.experiment import AnyExperiment
from harness.recording.recording import Recording


def find_experiment(name: str) -> AnyExperiment:
    """Return the experiment of this name.

    Raises:
        WrongUse: there is none.
    """
    experiment: AnyExperiment = loaded(require_experiment(name))
    return experiment


def experiment_of(recording: Recording) -> AnyExperiment:
    """The experiment that a run is of.

    Raises:
        WrongUse: it is a calibration's, or of an experiment that this version does not have.
    """
    name = recording.header.experiment
    row = EXPERIMENTS.get(name)
    if row is None:
        raise WrongUse(f"{recording.folder} is a run of {name!r}, which this version does not have")
    if row.value is None:
        raise WrongUse(
            f"{recording.folder} is a run of `touchstone {row.command}`; read it with "
            f"`touchstone {row.command} {recording.folder}`"
        )
    return find_experiment(name)


def require_of(recording: Recording, name: str, doing: str) -> None:
    """Refuse a run of anything but the experiment or calibration ``name``.

    Args:
        recording: of the run.
        name: as in the table.
        doing: what was asked of it: ``"--resume"``.

    Raises:
        WrongUse: the run is another's.
    """
    whose = recording.header.experiment
    if whose != name:
        raise WrongUse(f"{doing} {recording.folder}: it is a run of {whose}, not of {name}")


@contextmanager
def new_runs_folder(name: str, object_name: str | None, stamp: str) -> Iterator[Path]:
    """Create a folder under ``runs/`` for this process alone; a block that fails leaves no empty folder."""
    base = Path("runs") / "-".join(part for part in (stamp, name, object_name) if part)
    make_folder(base.parent)
    folder = base
    for number in count(2):
        try:
            folder.mkdir()
            break
        except FileExistsError:
            folder = base.with_name(f"{base.name}-{number}")
    try:
        yield folder
    except BaseException:
        with suppress(OSError):  # it is not empty
            folder.rmdir()
        raise
