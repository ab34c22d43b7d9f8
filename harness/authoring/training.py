"""What every training is told to do, and how long a network takes: none of it needs torch."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import numpy as np

Report = Callable[[str, float], None]
"""Told what is being done and the share of it that is done."""


class Resumable(Protocol):
    """A training that can stop after any epoch and go on from its checkpoint."""

    epoch: int

    @property
    def done(self) -> bool:
        """Whether all epochs were trained."""

    def step_epoch(self) -> float:
        """Train one epoch; its loss."""

    def save(self, path: Path) -> None:
        """Write a checkpoint."""

    def load(self, path: Path) -> None:
        """Go on from a checkpoint."""


def train(training: Resumable, epochs: int, checkpoint: Path, report: Report) -> None:
    """Train to the end, from the checkpoint where there is one.

    Args:
        training: is trained.
        epochs: that it takes, to say how far it is.
        checkpoint: written after every epoch.
        report: told of progress.

    Raises:
        DataRefused: a checkpoint that cannot be gone on from.
    """
    if checkpoint.exists():
        training.load(checkpoint)
    while not training.done:
        report(f"training, epoch {training.epoch + 1} of {epochs}", training.epoch / epochs)
        training.step_epoch()
        training.save(checkpoint)


class Laps:
    """Seconds on the clock of parts that follow each other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}  #: of each part.
        self._since = time.perf_counter()

    def lap(self, part: str) -> None:
        """What passed since the last lap belongs to ``part``."""
        now = time.perf_counter()
        self.seconds[part], self._since = now - self._since, now


def median_seconds(call: Callable[[], Any], times: int) -> float:
    """S of the processor (all threads of this program) that one of so many calls takes, in the median.

    Not seconds on the clock: what else the machine does must not be written into an object's file.
    """
    took = []
    for _ in range(times):
        begun = time.process_time()
        call()
        took.append(time.process_time() - begun)
    return float(np.median(took))
