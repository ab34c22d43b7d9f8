"""The controller's watchdog, kept fed; and whether it bit because this computer was late."""

from typing import Final

from drivers.ur.link import LATELY, Link
from harness.basics.clock import now

KICK_PERIOD: Final = 0.02  # s; five kicks in the 0.1 s that the watchdog waits at a real bench
LATE: Final = 0.8  # of the watchdog's patience between two kicks: it may have ended the script


class Watchdog:
    """Kicks for one link, and a memory of the kicks that came late."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._kicked = now()
        self._late = -LATELY
        self._script_ran = True
        self.bit = False

    def start(self) -> None:
        """The watchdog has just been armed; the script runs."""
        self._link.kick()
        self._kicked = now()
        self._script_ran = True
        self.bit = False

    def kick(self) -> None:
        """Kick, if it is time to."""
        if now() - self._kicked < KICK_PERIOD:
            return
        if self._is_late():
            self._late = now()
        self._link.kick()
        self._kicked = now()

    def look(self) -> None:
        """Notice the end of the script; ``bit`` tells whether a late kick is to blame.

        A script that ended for any other reason (the stop button at the pendant) stays ended.
        """
        ran, self._script_ran = self._script_ran, self._link.program_running()
        if ran and not self._script_ran:
            self.bit = self._is_late() or now() - self._late < LATELY

    def _is_late(self) -> bool:
        return now() - self._kicked > LATE * self._link.patience
