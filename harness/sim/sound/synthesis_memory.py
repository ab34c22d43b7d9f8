"""Working memory of a sound that is summed: kept by each thread from one to the next."""

import threading
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray

_KEPT = 1 << 24
"""Bytes of working memory that a thread keeps from one sound to the next."""


class Memory(threading.local):
    """Memory of one thread, handed out piece by piece and used again by its next sound.

    Fresh memory has to be cleared by the system page by page, which took as long as all the
    arithmetic of a sound of 512 modes.
    """

    def __init__(self) -> None:
        self._bytes = np.empty(0, np.uint8)
        self._used = self._wanted = 0

    def forget(self) -> None:
        """Begin a sound: all pieces are free again, and as many bytes there as the last one took."""
        size = min(self._wanted, _KEPT)
        if size > len(self._bytes):
            self._bytes = np.empty(size, np.uint8)
        self._used = self._wanted = 0

    def piece(self, shape: tuple[int, int], kind: np.dtype[Any]) -> AnyArray:
        """An array with whatever was there before."""
        size = -(-int(np.prod(shape)) * kind.itemsize // 64) * 64
        self._wanted += size
        if self._used + size > len(self._bytes):
            return np.empty(shape, kind)
        begin, self._used = self._used, self._used + size
        return self._bytes[begin : begin + size].view(kind)[: shape[0] * shape[1]].reshape(shape)


MEMORY = Memory()
"""Of whoever sums a sound."""
