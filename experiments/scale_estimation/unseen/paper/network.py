"""The paper's networks from a folder that a training wrote: one reading to one size, without an interval."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.scale_estimation.unseen.network import reading_input
from experiments.scale_estimation.unseen.paper.inputs import INPUTS
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Tensor
from harness.objectfile.runtime import Network

_GREATEST = 100.0
"""Of any number that a network takes."""

_GREATEST_LOG = 50.0
"""Of a size in m, up or down: far beyond any object, and still a number."""

_TRAIN = "python -m experiments.scale_estimation.unseen.train --profile paper --to FOLDER"


@dataclass(frozen=True, eq=False)
class PaperNetwork:
    """A trained network.

    Attributes:
        network: that runs it.
        card: where it comes from and what it reaches.
    """

    network: Network
    card: Mapping[str, object]

    def size(self, views: Sequence[Mapping[str, FloatArray]]) -> float:
        """M: the geometric mean of the sizes of one or more readings of one object.

        Args:
            views: the inputs of each, by name.

        Raises:
            DataRefused: inputs of another form, or an answer that is no size.
        """
        stacked = {
            tensor.name: np.stack([view[tensor.name] for view in views]).astype(np.float32)
            for tensor in self.network.inputs
        }
        logs = self.network(stacked)["log_size"].astype(np.float64)
        mean = float(logs.mean())
        if not abs(mean) < _GREATEST_LOG:
            raise DataRefused(
                f"{self.network.name} gives {mean:g} for the logarithm of a size in m, and only numbers "
                f"within {_GREATEST_LOG:g} are sizes; train it again: {_TRAIN}"
            )
        return float(np.exp(mean))


def paper_networks(folder: Path) -> dict[str, PaperNetwork]:
    """All of the paper's networks that lie in a folder, by sense.

    Raises:
        DataRefused: there is none, a card is missing or no JSON, or a graph must not be run.
    """
    found = {sense: opened_paper(folder, sense) for sense in INPUTS if (folder / f"{sense}.onnx").is_file()}
    if not found:
        names = ", ".join(f"{sense}.onnx" for sense in INPUTS)
        raise DataRefused(f"{folder} has none of {names}; train them: {_TRAIN}")
    return found


def opened_paper(folder: Path, sense: str) -> PaperNetwork:
    """One network and its card.

    Args:
        folder: that a training wrote.
        sense: of ``INPUTS``.

    Raises:
        DataRefused: a card is missing or no JSON, or the graph must not be run or is not of this sense.
    """
    path = folder / f"{sense}.onnx"
    try:
        card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataRefused(f"{path} has no card beside it; train it again: {_TRAIN}") from error
    inputs = [reading_input(name, shape, _GREATEST) for name, shape in INPUTS[sense]]
    size = Tensor(name="log_size", dtype="float32", shape=("n", 1), unit="1", meaning="log of the size in m")
    return PaperNetwork(Network(path.read_bytes(), path.name, inputs, [size]), card)
