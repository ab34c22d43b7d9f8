"""The arm's state in the child, packet by packet, and the force guard that reads each one."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from drivers.ur import pipe
from drivers.ur import words as ur_words
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.starvation import WATCH, name_cause

AT_REST: Final = 1e-3  # rad/s of the fastest joint
LOOK_PERIOD: Final = 0.002  # s
CONTACT_PACKETS: Final = 2  # in a row above the threshold; one alone may be noise


class PacketSource(Protocol):
    """What packets come from."""

    rate: float

    def packets(self) -> Iterator[FloatArray | None]:
        """Each packet as it arrives; None whenever there was none for a moment."""


@dataclass(frozen=True, eq=False)
class Guard:
    """Forces that end a motion.

    Attributes:
        press: N; ends the motion.
        hard: N; ends it and latches.
        contact: N along ``direction``, either sign; None where none is sought.
        direction: ``(3,)`` unit vector in base.
    """

    press: float
    hard: float
    contact: float | None
    direction: FloatArray


@dataclass(frozen=True)
class Trip:
    """Why the guard ended a motion: ``"hard"``, ``"press"`` or ``"contact"``, and the force in N."""

    kind: str
    force: float


class Stream:
    """Reads every packet in a thread, hands each on, watches the force."""

    def __init__(
        self, source: PacketSource, send: Callable[[FloatArray], None], wake: Callable[[], None]
    ) -> None:
        self._source = source
        self._send = send
        self._wake = wake
        self._thread = threading.Thread(target=self._run, name="arm stream", daemon=True)
        self._contact_count = 0
        self._closed = threading.Event()
        self.newest: FloatArray = np.full(pipe.WIDTH, np.nan)
        self.changed = now()
        self.packets = 0
        self.drops = 0
        self.still = 0
        self.moving = False
        self.restarts = 0
        self.failure = ""
        self.guard: Guard | None = None
        self.trip: Trip | None = None

    def start(self) -> None:
        """Begin to read."""
        WATCH.start()
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._thread.join(timeout=1.0)

    @property
    def age(self) -> float:
        """Seconds since a packet last arrived."""
        return now() - self.changed

    def becomes_younger(self, age: float, seconds: float) -> bool:
        """Whether the state is, or within some ``seconds`` becomes, at most ``age`` s old."""
        end = now() + seconds
        while self.age > age and now() < end:
            time.sleep(LOOK_PERIOD)
        return self.age <= age

    def require_younger(self, age: float) -> None:
        """Raise ``BenchFault`` where the stream has failed, or the state is more than ``age`` s old."""
        if self.failure:
            raise BenchFault(self.failure)
        if self.age > age:
            raise BenchFault(
                f"no state arrived from the arm for {self.age:.1f} s (limit {age:g} s); "
                + name_cause("check the network cable of the control box", self.changed)
            )

    @property
    def safety(self) -> str:
        """The controller's safety state in words; ``"normal"`` before the first packet."""
        return "normal" if self.packets == 0 else ur_words.safety_words(int(self._field("safety_bits")[0]))

    @property
    def at_rest(self) -> bool:
        """Whether the last three packets say that no joint turns."""
        return self.still >= 3

    @property
    def force(self) -> float:
        """N, of the newest packet."""
        return float(np.linalg.norm(self._field("wrench")[:3]))

    def watch(self, guard: Guard | None) -> None:
        """Set or end the watch on the force."""
        self.guard = None
        self.trip = None
        self._contact_count = 0
        self.guard = guard

    def _field(self, name: str) -> FloatArray:
        return self.newest[pipe.FIELDS[name]]

    def _run(self) -> None:
        period = 1.0 / self._source.rate
        try:
            for packet in self._source.packets():
                if self._closed.is_set():
                    return
                if packet is not None:
                    self._accept(packet, period)
        except (BenchFault, pipe.PipeBroken) as error:
            self.failure = str(error) or "the state stream ended"
            self._wake()

    def _accept(self, packet: FloatArray, period: float) -> None:
        fields = pipe.FIELDS
        if self.packets:
            step = packet[fields["controller_time"]][0] - self._field("controller_time")[0]
            self.drops += max(0, round(step / period) - 1)
        packet[fields["moving"]] = self.moving
        packet[fields["drops"]] = self.drops
        packet[fields["restarts"]] = self.restarts
        turning = float(np.abs(packet[fields["joint_speeds"]]).max())
        self.still = self.still + 1 if turning < AT_REST else 0
        self.newest = packet
        self.changed = float(packet[fields["time"]][0])
        self.packets += 1
        self._watch_force(packet[fields["wrench"]][:3])
        self._send(packet)

    def _watch_force(self, force: FloatArray) -> None:
        guard = self.guard
        if guard is None or (self.trip is not None and self.trip.kind == "hard"):
            return
        total = float(np.linalg.norm(force))
        along = abs(float(force @ guard.direction))
        touching = guard.contact is not None and along >= guard.contact
        self._contact_count = self._contact_count + 1 if touching else 0
        if total > guard.hard:
            self.trip = Trip("hard", total)
        elif self.trip is not None:
            return
        elif total > guard.press:
            self.trip = Trip("press", total)
        elif self._contact_count >= CONTACT_PACKETS:
            self.trip = Trip("contact", along)
        else:
            return
        self._wake()
