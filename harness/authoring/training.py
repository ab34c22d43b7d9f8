"""What every training is told to do, and how long a network takes: none of it needs torch."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

Report = Callable[[str, float], None]
"""Told what is being done and the share of it that is done."""


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
