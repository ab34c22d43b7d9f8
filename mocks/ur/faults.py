"""What can be made to go wrong with a controller, on cue."""

from collections.abc import Callable, Iterable
from typing import Final

from mocks.ur.controller import Controller
from mocks.ur.hooks import Cue
from mocks.ur.ports import Connection
from mocks.ur.rtde_server import RtdeServer

KINDS: Final = (
    "none",
    "protective_stop",
    "emergency_stop",
    "release_emergency_stop",
    "drop",
    "freeze",
    "local_control",
    "remote_control",
    "kill_program",
    "broken_force_sensor",
)
"""none: every lasting fault ends. drop: connections are reset, and refused for as long as it lasts.
freeze: the real-time exchange neither sends nor reads, as with a loose cable; the arm goes on.
broken_force_sensor: its readings are no numbers."""


class Faults:
    """Begins and ends them.

    Args:
        controller: that fails.
        rtde: its port 30004.
        others: open connections of its other ports.
    """

    def __init__(
        self,
        controller: Controller,
        rtde: RtdeServer,
        others: Callable[[], Iterable[Connection]],
    ) -> None:
        self._controller = controller
        self._rtde = rtde
        self._others = others
        self._until: float | None = None

    def begin(self, cue: Cue) -> str:
        """What was begun, or why not, in words."""
        controller = self._controller
        match cue.kind:
            case "none":
                self._clear()
            case "protective_stop":
                controller.protective_stop("a fault was cued")
            case "emergency_stop":
                controller.emergency_stop()
            case "release_emergency_stop":
                controller.robot.safety.release_button()
            case "drop":
                self._drop(cue.seconds)
            case "freeze":
                self._rtde.freeze(True)
                self._last(cue.seconds)
            case "local_control" | "remote_control":
                controller.robot.remote = cue.kind == "remote_control"
            case "kill_program":
                controller.complain("program killed")
                controller.player.stop()
            case "broken_force_sensor":
                controller.robot.force.broken = True
                self._last(cue.seconds)
            case _:
                return f"a controller has no fault {cue.kind!r}; it has {', '.join(KINDS)}"
        return f"begun: {cue.kind}"

    def tick(self) -> None:
        """End what has lasted long enough."""
        if self._until is not None and self._controller.robot.time >= self._until:
            self._clear()

    def _drop(self, seconds: float | None) -> None:
        """Without a duration connections may come back at once: a cable that was pulled and put back."""
        self._rtde.drop()
        for connection in self._others():
            connection.abort()
        if seconds is not None:
            self._rtde.refusing = True
            self._last(seconds)

    def _last(self, seconds: float | None) -> None:
        self._until = None if seconds is None else self._controller.robot.time + seconds

    def _clear(self) -> None:
        self._rtde.freeze(False)
        self._rtde.refusing = False
        self._controller.robot.force.broken = False
        self._until = None
