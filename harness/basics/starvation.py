"""Measure whether this computer was too busy to serve an instrument, before hardware is blamed.

A thread that should wake every 20 ms records how late it woke. A process that was late itself says nothing
about the far end of a cable.
"""

import contextlib
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from harness.basics.clock import now

PERIOD = 0.02
"""Seconds between two wakes."""

LATE = 0.1
"""Delay in s of one wake from which this process was starved."""

BUSY_LOAD = 2.0
"""Programs that want to run, per processor, from which a computer is busy."""

BUSY_PRESSURE = 60.0
"""Per cent of the last 10 s in which some program waited for a processor (``/proc/pressure/cpu``)."""

_KEPT = 3000
"""Wakes that are remembered: a minute."""


class WakeWatch:
    """Records how late a thread of this process wakes.

    Args:
        clock: returns s.
        sleep: waits for s.
    """

    def __init__(
        self, clock: Callable[[], float] = now, sleep: Callable[[float], object] = time.sleep
    ) -> None:
        self._clock = clock
        self._sleep = sleep
        self._delays: deque[tuple[float, float]] = deque(maxlen=_KEPT)
        self._due = clock()
        self._started = threading.Lock()

    def start(self) -> None:
        """Begin to record, in a thread of its own; does nothing if already begun."""
        if self._started.acquire(blocking=False):
            self._due = self._clock() + PERIOD
            threading.Thread(target=self._run, name="wake watch", daemon=True).start()

    def wake(self) -> None:
        """Sleep for one period and record the delay."""
        self._due = self._clock() + PERIOD
        self._sleep(PERIOD)
        woken = self._clock()
        self._delays.append((woken, woken - self._due))

    def delay_since(self, since: float) -> float:
        """Return the longest delay in s of a wake after ``since``, with that of a wake still due."""
        while True:
            with contextlib.suppress(RuntimeError):  # the thread appended meanwhile
                delays = [delay for woken, delay in self._delays if woken > since]
                break
        overdue = self._clock() - self._due if self._started.locked() else 0.0
        return max(0.0, overdue, *delays)

    def _run(self) -> None:
        while True:
            self.wake()


WATCH = WakeWatch()
"""The watch of this process; drivers start it as they open."""


def describe_load() -> str:
    """Return the load of this computer in words, for example ``load 15.0 on 2 processors``."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count() or 1} processors"


def is_busy() -> bool:
    """Return whether programs on this computer wait for a processor."""
    if os.getloadavg()[0] >= BUSY_LOAD * (os.cpu_count() or 1):
        return True
    with contextlib.suppress(OSError, ValueError, IndexError):
        line = Path("/proc/pressure/cpu").read_text(encoding="ascii").split()[1]
        return float(line.removeprefix("avg10=")) >= BUSY_PRESSURE
    return False


def name_cause(hardware: str, since: float, watch: WakeWatch | None = None) -> str:
    """Return what to do about an instrument that was silent: about this computer, where that was late.

    Args:
        hardware: what to do if this computer was in time, for example ``check the camera's cable``.
        since: s on the bench clock, when the silence began.
        watch: of this process; its own where None.
    """
    delay = (watch or WATCH).delay_since(since)
    if delay >= LATE:
        return (
            f"this computer was busy: a program on it had to wait {1e3 * delay:.0f} ms for a processor "
            f"({describe_load()}); close other programs and try again"
        )
    if is_busy():
        return (
            f"this computer is busy ({describe_load()}); close other programs and try again, and if this "
            f"happens on an idle computer, {hardware}"
        )
    return hardware
