"""Threads that share loops, and arrays that are used again."""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.cores import own_cores
from harness.basics.errors import WrongUse


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

    def share(self, work: Callable[[int, int], None], count: int, parts: int, least: int = 1) -> None:
        """Call ``work(first, last)`` for parts of ``range(count)``, and return when all are done.

        Args:
            work: holds no lock while it computes.
            count: of what is shared.
            parts: to be made of it; threads take one after the other.
            least: of a part: what is cheaper done than handed to another thread.
        """
        parts = min(parts, count // least)
        if self._pool is None or parts < 2:
            if count:
                work(0, count)
            return
        ends = np.linspace(0, count, parts + 1).astype(int).tolist()
        left = list(pairwise(ends))[::-1]

        def take() -> None:
            while left:
                try:
                    first, last = left.pop()
                except IndexError:  # another thread took the last one between the question and the answer
                    return
                work(first, last)

        jobs = [self._pool.submit(take) for _ in range(self.threads - 1)]
        take()
        for job in jobs:
            # A thread that woke too late has nothing left to do and is not waited for.
            if not job.cancel():
                job.result()


class Workspace:
    """Arrays by name, made once and used again while they are large enough."""

    def __init__(self) -> None:
        self._arrays: dict[str, AnyArray] = {}

    def take(self, name: str, shape: tuple[int, ...], dtype: Any) -> AnyArray:
        """An array with anything in it; the last one of that name is overwritten."""
        size = math.prod(shape)
        held = self._arrays.get(name)
        if held is None or len(held) < size or held.dtype != dtype:
            held = self._arrays[name] = np.empty(max(size, 1), dtype)
        return held[:size].reshape(shape)
