"""What can be made to go wrong with a controller, on cue."""

from typing import Final

from mocks.ur.controller import Controller
from mocks.ur.dashboard import DashboardConnection
from mocks.ur.hooks import Cue
from mocks.ur.rtde_server import RtdeServer
from mocks.ur.script_server import ScriptServer

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
)
"""none: every lasting fault ends. drop: connections are reset, and refused for as long as it lasts.
freeze: the real-time exchange neither sends nor reads, as with a loose cable; the arm goes on."""


class Faults:
    """Begins and ends them.

    Args:
        controller: that fails.
        rtde: its port 30004.
        scripts: its ports 30001 to 30003.
        dashboards: connections of its port 29999.
    """

    def __init__(
        self,
        controller: Controller,
        rtde: RtdeServer,
        scripts: ScriptServer,
        dashboards: set[DashboardConnection],
    ) -> None:
        self._controller = controller
        self._rtde = rtde
        self._scripts = scripts
        self._dashboards = dashboards
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
                self._rtde.frozen = True
                self._last(cue.seconds)
            case "local_control" | "remote_control":
                controller.robot.remote = cue.kind == "remote_control"
            case "kill_program":
                controller.complain("program killed")
                controller.player.stop()
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
        for script in list(self._scripts.connections):
            script.abort()
        for dashboard in list(self._dashboards):
            dashboard.abort()
        if seconds is not None:
            self._rtde.refusing = True
            self._last(seconds)

    def _last(self, seconds: float | None) -> None:
        self._until = None if seconds is None else self._controller.robot.time + seconds

    def _clear(self) -> None:
        self._rtde.frozen = False
        self._rtde.refusing = False
        self._until = None
