"""A training's state in one file, so that it goes on where it was killed, bit for bit."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
import torch

from harness.arrays import AnyArray
from harness.errors import DataRefused

_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


@dataclass(frozen=True, eq=False)
class Progress:
    """How far a training has come.

    Attributes:
        epoch: that were trained.
        losses: of each.
    """

    epoch: int
    losses: list[float]


def save_training(
    path: Path, identity: str, progress: Progress, network: torch.nn.Module, adam: torch.optim.Adam
) -> None:
    """Write weights, both moments of Adam, its steps, the epoch and the losses; whole or not at all.

    Args:
        path: a ``.npz`` file.
        identity: a digest of all that the training depends on.
        progress: of the training.
        network: that is trained.
        adam: that trains it.
    """
    arrays: dict[str, AnyArray] = {
        "identity": np.array(identity),
        "epoch": np.array(progress.epoch),
        "losses": np.array(progress.losses),
    }
    for number, parameter in enumerate(network.parameters()):
        arrays[f"weight.{number}"] = parameter.detach().cpu().numpy()
        for name, value in adam.state[parameter].items():
            arrays[f"{name}.{number}"] = value.cpu().numpy()
    part = path.with_name(f".{path.name}.part")
    with part.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)
        stream.flush()
        os.fsync(stream.fileno())
    part.replace(path)


def load_training(path: Path, identity: str, network: torch.nn.Module, adam: torch.optim.Adam) -> Progress:
    """Put a network and its Adam where ``save_training`` left them.

    Raises:
        DataRefused: the file cannot be read, or is of another training.
    """
    arrays = _read(path)
    if str(arrays.get("identity")) != identity:
        raise DataRefused(
            f"checkpoint {path} is of another network, object, data or seed; "
            "delete it to begin anew, or build into another folder"
        )
    state = adam.state_dict()
    moments = {}
    for number, parameter in enumerate(network.parameters()):
        with torch.no_grad():
            parameter.copy_(torch.from_numpy(arrays[f"weight.{number}"]))
        names = [name for name in _MOMENTS if f"{name}.{number}" in arrays]
        moments[number] = {name: torch.from_numpy(arrays[f"{name}.{number}"]) for name in names}
    state["state"] = {number: values for number, values in moments.items() if values}
    adam.load_state_dict(state)
    return Progress(int(arrays["epoch"]), arrays["losses"].tolist())


def _read(path: Path) -> Mapping[str, AnyArray]:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (OSError, ValueError, BadZipFile, EOFError, KeyError) as error:
        raise DataRefused(f"checkpoint {path} cannot be read ({error}); delete it to begin anew") from error
