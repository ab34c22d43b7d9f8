"""Threads that share loops, and arrays that are used again."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from harness.arrays import AnyArray
from harness.cores import own_cores
from harness.errors import WrongUse


class Crew:
    """Threads for loops that hold no lock.

    Args:
        threads: None for as many as the process has cores.
    """

    def __init__(self, threads: int | None = None) -> None:
        self.threads = own_cores() if threads is None else threads
        if self.threads < 1:
            raise WrongUse(f"{self.threads} threads compute nothing; say 1 or more")
        self._pool = ThreadPoolExecutor(self.threads, "vision") if self.threads > 1 else None

    def share(self, work: Callable[[int, int], None], count: int, parts: int) -> None:
        """Call ``work(first, last)`` for parts of ``range(count)``, and return when all are done."""
        if self._pool is None or count < parts or parts < 2:
            if count:
                work(0, count)
            return
        ends = np.linspace(0, count, parts + 1).astype(int).tolist()
        jobs = [self._pool.submit(work, a, b) for a, b in pairwise(ends[1:])]
        work(ends[0], ends[1])
        for job in jobs:
            job.result()


class Room:
    """Arrays by name, made once and used again while they are large enough."""

    def __init__(self) -> None:
        self._arrays: dict[str, AnyArray] = {}

    def take(self, name: str, shape: tuple[int, ...], dtype: Any) -> AnyArray:
        """An array with anything in it; the last one of that name is overwritten."""
        size = int(np.prod(shape))
        held = self._arrays.get(name)
        if held is None or len(held) < size or held.dtype != dtype:
            held = self._arrays[name] = np.empty(max(size, 1), dtype)
        return held[:size].reshape(shape)
