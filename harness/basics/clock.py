"""The bench clock: monotonic seconds, and its offset to the wall clock."""

import time
from collections.abc import Callable


def now() -> float:
    """Seconds on the bench clock (the system's monotonic clock)."""
    return time.monotonic()


def clock_offset_ns(bench_clock: Callable[[], float] = now) -> int:
    """Measure the wall clock (ns since 1970) minus the bench clock.

    The bench clock starts again at a reboot, so every session measures the offset for itself; corrections of
    the wall clock during a session do not move the bench clock.

    Args:
        bench_clock: returns s on the clock by which readings are stamped.
    """
    return time.time_ns() - round(bench_clock() * 1e9)
