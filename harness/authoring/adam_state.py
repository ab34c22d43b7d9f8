"""A network, its Adam and how far both are, in one file, to go on from bit for bit."""

from pathlib import Path

import torch

from harness.authoring.checkpoint import TrainingProgress, read_checkpoint, write_checkpoint
from harness.basics.arrays import AnyArray

_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


def save_training(
    path: Path, identity: str, progress: TrainingProgress, network: torch.nn.Module, adam: torch.optim.Adam
) -> None:
    """Write weights, both moments of Adam, its steps, the epoch and the losses; whole or not at all.

    Args:
        path: a ``.npz`` file.
        identity: a digest of all that the training depends on.
        progress: of the training.
        network: that is trained.
        adam: that trains it.
    """
    arrays: dict[str, AnyArray] = {}
    for number, parameter in enumerate(network.parameters()):
        arrays[f"weight.{number}"] = parameter.detach().cpu().numpy()
        for name, value in adam.state[parameter].items():
            arrays[f"{name}.{number}"] = value.cpu().numpy()
    write_checkpoint(path, identity, progress, arrays)


def load_training(
    path: Path, identity: str, network: torch.nn.Module, adam: torch.optim.Adam
) -> TrainingProgress:
    """Put a network and its Adam where ``save_training`` left them.

    Raises:
        DataRefused: the file cannot be read, or is of another training.
    """
    progress, arrays = read_checkpoint(path, identity)
    state = adam.state_dict()
    moments = {}
    for number, parameter in enumerate(network.parameters()):
        with torch.no_grad():
            parameter.copy_(torch.from_numpy(arrays[f"weight.{number}"]))
        names = [name for name in _MOMENTS if f"{name}.{number}" in arrays]
        moments[number] = {name: torch.from_numpy(arrays[f"{name}.{number}"]) for name in names}
    state["state"] = {number: values for number, values in moments.items() if values}
    adam.load_state_dict(state)
    return progress
