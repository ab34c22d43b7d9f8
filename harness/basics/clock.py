"""The bench clock: monotonic seconds, and the wall time they started from."""

import time
from dataclasses import dataclass


def now() -> float:
    """Seconds on the bench clock (the system's monotonic clock)."""
    return time.monotonic()


@dataclass(frozen=True)
class ClockOffset:
    """Wall-clock seconds since 1970 minus bench-clock seconds, read once a run."""

    seconds: float

    @classmethod
    def measure(cls) -> "ClockOffset":
        """The offset at this moment; NTP steps during a run do not move the bench clock."""
        return cls(time.time() - time.monotonic())
