"""A training's state in one file, whole on disk or not at all; none of it needs torch."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.basics.files.foreign_file import refused_as
from harness.basics.npz_file import read_arrays, write_arrays


@dataclass(frozen=True, eq=False)
class TrainingProgress:
    """How far a training has come."""

    epoch: int  #: that were trained.
    losses: list[float]  #: of what was trained.


def write_checkpoint(
    path: Path, identity: str, progress: TrainingProgress, arrays: Mapping[str, AnyArray]
) -> None:
    """Write a checkpoint; one that was there is replaced when the new one is on disk.

    Args:
        path: a ``.npz`` file.
        identity: a digest of all that the training depends on.
        progress: of the training.
        arrays: what it goes on from.
    """
    state = {
        "identity": np.array(identity),
        "epoch": np.array(progress.epoch),
        "losses": np.array(progress.losses),
    }
    write_arrays(path, {**state, **arrays})


def read_checkpoint(path: Path, identity: str) -> tuple[TrainingProgress, Mapping[str, AnyArray]]:
    """What ``write_checkpoint`` wrote.

    Raises:
        DataRefused: the file cannot be read, or is of another training.
    """
    begin_anew = "; delete it to begin anew"
    arrays = read_arrays(path, "a checkpoint", advice=begin_anew, refused=DataRefused)
    with refused_as(DataRefused, f"{path} does not read as a checkpoint: other arrays{begin_anew}"):
        found = str(arrays.pop("identity"))
        progress = TrainingProgress(int(arrays.pop("epoch")), arrays.pop("losses").tolist())
    if found != identity:
        raise DataRefused(
            f"checkpoint {path} is of another network, object, data or seed; "
            "delete it to begin anew, or build into another folder"
        )
    return progress, arrays
