"""One motion in the child: started asynchronously, watched tick by tick, stopped for a reason.

ur_rtde's ``moveUntilContact`` is not used: it blocks in the library for as long as it moves (no
stop, no watchdog kick), has no travel limit and no force threshold of ours, and steps back from
the contact. Here the search is a straight line to the end of the travel, and the guard ends it.
"""

import threading
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from drivers.ur import dashboard, pipe
from drivers.ur.link import Link
from drivers.ur.stream import Guard, Stream
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, SafetyStop, TouchstoneError

START_WITHIN: Final = 0.5  # s for the script to begin a motion it accepted
SETTLE_WITHIN: Final = 0.5  # s from the end of the script's motion to rest at the target
BRAKE_WITHIN: Final = 0.05  # s for ur_rtde to pass on a brake, before the program is ended without it
STOP_WITHIN: Final = 1.0  # s from braking to rest
CAUSE_WITHIN: Final = 0.2  # s for the controller to send the state that says why its program ended
RISE: Final = 0.5  # N; a motion that starts beyond the press limit may go on while the force falls
JOINT_TOLERANCE: Final = 1e-3  # rad
POSITION_TOLERANCE: Final = 0.5e-3  # m


@dataclass(frozen=True)
class Outcome:
    """How a motion ended."""

    value: bool = True  #: what the caller is told.
    error: TouchstoneError | None = None  #: what is raised instead.
    latch: bool = False  #: whether the program is ended and the arm stays stopped until it is opened again.


@dataclass(eq=False)
class Motion:
    """A joint motion (``joints``) or a straight line (``pose``), and what may end it."""

    id: int  #: of the request.
    what: str  #: for messages.
    joints: list[float] | None  #: rad, of a joint motion.
    pose: list[float] | None  #: UR's pose vector, of a line.
    near: list[float]  #: rad, the joints a line starts from.
    speed: float  #: rad/s or m/s.
    acceleration: float  #: rad/s^2 or m/s^2.
    guard: Guard  #: forces that end it.
    deadline: float  #: s on the bench clock.
    _outcome: Outcome | None = None
    _count: int = -1
    _began: bool = False
    _since: float = field(default_factory=now)
    _ended: float | None = None
    _cut: float | None = None

    @classmethod
    def from_message(cls, message: pipe.Message, force: float) -> "Motion":
        """The motion of a request; ``force`` N is what the sensor reads before it."""
        press, hard = float(message["force_press"]), float(message["force_any"])
        guard = Guard(
            press=max(press, force + RISE),
            hard=hard,
            contact=message.get("contact"),
            direction=np.array(message.get("direction", [0.0, 0.0, 0.0])),
        )
        return cls(
            id=message["id"],
            what=message["what"],
            joints=message.get("joints"),
            pose=message.get("pose"),
            near=message.get("near", []),
            speed=message["speed"],
            acceleration=message["acceleration"],
            guard=guard,
            deadline=now() + message["seconds"],
        )

    @property
    def stopping(self) -> bool:
        """Whether it was told to stop."""
        return self._outcome is not None

    def start(self, link: Link) -> None:
        """Send it; returns while the arm begins to move."""
        self._count, _ = link.progress()
        self._since = now()
        if self.joints is not None:
            link.start_joints(self.joints, self.speed, self.acceleration)
        elif self.pose is not None:
            link.start_line(self.pose, self.speed, self.acceleration)

    def stop(self, link: Link, outcome: Outcome) -> None:
        """Brake; ``outcome`` is told once the arm is at rest. The first reason stands."""
        if self._outcome is not None:
            return
        self._outcome = outcome
        self._since = now()
        link.brake()

    def look(self, link: Link, stream: Stream) -> Outcome | None:
        """How it ended, or None while it goes on."""
        self._heed_force(link, stream)
        if self._outcome is not None:
            return self._stopped(link, stream)
        if not link.program_running():
            return self._cut_short(link)
        if now() > self.deadline:
            text = (
                f"{self.what} did not end in the time it should take; check the speed slider at the pendant"
            )
            self.stop(link, Outcome(error=BenchFault(text)))
            return None
        return self._progress(link, stream)

    def _cut_short(self, link: Link) -> Outcome | None:
        """The program ended or was paused under the motion: nothing may take it up again."""
        self._cut = now() if self._cut is None else self._cut
        if link.state_is_older() and now() - self._cut < CAUSE_WITHIN:
            return None
        cause = link.why()
        return Outcome(error=type(cause)(f"{self.what} was cut short: {cause}"), latch=True)

    def _heed_force(self, link: Link, stream: Stream) -> None:
        trip = stream.trip
        if trip is None:
            return
        if trip.kind == "hard" and not (self._outcome and self._outcome.latch):
            text = (
                f"{self.what} met {trip.force:.1f} N; the limit is {self.guard.hard:g} N: the arm is stopped "
                "and stays so until it is opened again. Free it by hand (pendant, freedrive) first"
            )
            self._stop_twice(link)
            self._since = now()
            self._outcome = Outcome(error=SafetyStop(text), latch=True)
        elif trip.kind == "press":
            text = (
                f"{self.what} met {trip.force:.1f} N; the limit is {self.guard.press:.1f} N: it was stopped"
            )
            self.stop(link, Outcome(error=SafetyStop(text)))
        elif trip.kind == "contact":
            self.stop(link, Outcome(value=True))

    def _stop_twice(self, link: Link) -> None:
        """Brake, then end the program; end it all the same if braking does not return."""
        backup = threading.Timer(BRAKE_WITHIN, dashboard.stop, (link.address,))
        backup.start()
        if not self.stopping:
            link.brake()
        backup.cancel()
        link.halt()

    def _stopped(self, link: Link, stream: Stream) -> Outcome | None:
        if stream.at_rest:
            return self._outcome
        if now() > self._since + STOP_WITHIN:
            link.halt()
            raise BenchFault(
                f"{self.what}: the arm did not come to rest within {STOP_WITHIN:g} s of braking; it was "
                "stopped through its dashboard"
            )
        return None

    def _progress(self, link: Link, stream: Stream) -> Outcome | None:
        count, running = link.progress()
        self._began = self._began or count != self._count
        if not self._began and now() > self._since + START_WITHIN:
            # It may begin yet, with nobody watching.
            text = f"{self.what} was accepted but did not begin: {link.why()}"
            return Outcome(error=BenchFault(text), latch=True)
        if not self._began or running:
            return None
        self._ended = self._ended or now()
        error, tolerance, unit = self._error(stream.newest)
        if stream.at_rest and error <= tolerance:
            return Outcome(value=self.guard.contact is None)
        if now() > self._ended + SETTLE_WITHIN:
            text = f"{self.what} ended {error:.2g} {unit} off its target (limit {tolerance:g}): {link.why()}"
            return Outcome(error=BenchFault(text))
        return None

    def _error(self, packet: FloatArray) -> tuple[float, float, str]:
        if self.joints is not None:
            off = packet[pipe.FIELDS["joints"]] - np.array(self.joints)
            return float(np.abs(off).max()), JOINT_TOLERANCE, "rad"
        off = packet[pipe.FIELDS["pose"]][:3] - np.array(self.pose)[:3]
        return float(np.linalg.norm(off)), POSITION_TOLERANCE, "m"
