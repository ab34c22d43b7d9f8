"""A software trigger on a microphone's blocks."""

import numpy as np

from drivers.microphone.blocks import Blocks, Format
from harness.basics.arrays import AnyArray


class Trigger:
    """The first sample further than a threshold from the baseline, looked for block by block.

    Args:
        blocks: of the stream.
        form: of their bytes.
        start: sample number from which to look.
        baseline: counts.
        threshold: counts.

    Attributes:
        index: number of the sample found; ``start`` until then.
    """

    def __init__(self, blocks: Blocks, form: Format, start: int, baseline: float, threshold: int) -> None:
        self.index = start
        self._blocks = blocks
        self._form = form
        self._next = start
        self._baseline = baseline
        self._threshold = threshold

    def look(self) -> bool:
        """Whether a sample has been found; ``index`` is its number."""
        for block in self._blocks.since(self._next):
            loud = np.flatnonzero(self._is_loud(self._form.counts(block.counts)))
            self._next = block.first + self._form.block
            if len(loud):
                self.index = block.first + int(loud[0])
                return True
        return False

    def _is_loud(self, counts: AnyArray) -> AnyArray:
        return np.asarray(np.abs(counts - self._baseline) > self._threshold)
