"""What each stage of a computation took: on the clock, and of the processor."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

CPU = "cpu."
"""Before a stage's name where its seconds are those of the processor, all threads together."""

Begin = Callable[[str], None]
"""Called with the name of a stage, in words, as it begins."""


def ignore_stage(_stage: str) -> None:
    """Report no stage."""


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add what happens meanwhile to the seconds of a stage, under its name and under ``CPU`` and its name."""
    begun, worked = time.perf_counter(), time.process_time()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - begun
    seconds[CPU + stage] = seconds.get(CPU + stage, 0.0) + time.process_time() - worked


def wall(seconds: Mapping[str, float]) -> dict[str, float]:
    """On the clock, by stage."""
    return {stage: took for stage, took in seconds.items() if not stage.startswith(CPU)}


def cpu(seconds: Mapping[str, float]) -> dict[str, float]:
    """Of the processor, by stage."""
    return {stage.removeprefix(CPU): took for stage, took in seconds.items() if stage.startswith(CPU)}
