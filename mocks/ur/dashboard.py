"""Port 29999: one line asks, one line answers (Universal Robots, Dashboard Server e-Series)."""

import asyncio
from collections.abc import Callable
from typing import Final

from mocks.ur.connection import Connection
from mocks.ur.controller import Controller
from mocks.ur.player import RuntimeState
from mocks.ur.safety import SafetyMode

GREETING: Final = b"Connected: Universal Robots Dashboard Server\n"
LONGEST_LINE: Final = 4096
LOCAL: Final = (
    "Command is not allowed due to safety reasons, please switch robot to Remote Control mode "
    "and reconnect to port 29999"
)
TOO_EARLY: Final = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)
_PROGRAM_STATES: Final = {
    RuntimeState.STOPPED: "STOPPED",
    RuntimeState.PLAYING: "PLAYING",
    RuntimeState.PAUSED: "PAUSED",
}


class Dashboard:
    """What it answers; no sockets here."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._robot = controller.robot
        self._player = controller.player
        self._asked = self._questions()
        self._done = self._commands()

    def reply(self, line: str) -> str:
        """The answer to one line; commands are refused in local control."""
        command = line.strip()
        words = command.lower()
        if words in self._asked:
            return self._asked[words]()
        if words in self._done:
            return self._done[words]() if self._robot.remote else LOCAL
        return f"could not understand: {command}"

    def _questions(self) -> dict[str, Callable[[], str]]:
        robot, player = self._robot, self._player
        version = ".".join(map(str, robot.config.polyscope))
        return {
            "polyscopeversion": lambda: f"URSoftware {version} (Mar 22 2022)",
            "get serial number": lambda: robot.config.serial,
            "get robot model": lambda: robot.arm.name,
            "is in remote control": lambda: str(robot.remote).lower(),
            "robotmode": lambda: f"Robotmode: {robot.safety.power.name}",
            "safetymode": lambda: f"Safetymode: {robot.safety.mode.name}",
            "safetystatus": lambda: f"Safetystatus: {robot.safety.mode.name}",
            "running": lambda: f"Program running: {str(player.state is RuntimeState.PLAYING).lower()}",
            "programstate": lambda: f"{_PROGRAM_STATES[player.state]} {player.name or 'unnamed'}",
            "quit": lambda: "Disconnected",
        }

    def _commands(self) -> dict[str, Callable[[], str]]:
        return {
            "play": self._play,
            "stop": self._stop,
            "pause": self._pause,
            "power on": self._power_on,
            "power off": self._power_off,
            "brake release": self._release_brakes,
            "unlock protective stop": self._unlock,
            "close safety popup": lambda: "closing safety popup",
        }

    def _play(self) -> str:
        if self._robot.safety.may_move and self._player.resume():
            return "Starting program"
        return "Failed to execute: play"

    def _stop(self) -> str:
        self._player.stop()
        return "Stopped"

    def _pause(self) -> str:
        if self._player.state is not RuntimeState.PLAYING:
            return "Failed to execute: pause"
        self._player.pause()
        return "Pausing program"

    def _power_on(self) -> str:
        return "Powering on" if self._controller.power_on() else "Failed to execute: power on"

    def _power_off(self) -> str:
        self._controller.power_off()
        return "Powering off"

    def _release_brakes(self) -> str:
        return "Brake releasing" if self._controller.release_brakes() else "Failed to execute: brake release"

    def _unlock(self) -> str:
        safety = self._robot.safety
        if safety.mode is SafetyMode.PROTECTIVE_STOP and not safety.may_unlock(self._robot.time):
            return TOO_EARLY
        safety.unlock()
        return "Protective stop releasing"


class DashboardConnection(Connection):
    """One client; it is greeted, and gone after ``quit``."""

    def __init__(self, dashboard: Dashboard, connections: set["DashboardConnection"]) -> None:
        super().__init__()
        self._dashboard = dashboard
        self._connections = connections
        self._waiting = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        super().connection_made(transport)
        self._connections.add(self)
        self.send(GREETING)

    def connection_lost(self, error: Exception | None) -> None:
        """It has gone."""
        super().connection_lost(error)
        self._connections.discard(self)

    def data_received(self, data: bytes) -> None:
        """Answer every whole line; a line that does not end closes the connection."""
        *lines, self._waiting = (self._waiting + data).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            self.send(self._dashboard.reply(text).encode() + b"\n")
            if text.lower() == "quit":
                self.close()
        if len(self._waiting) > LONGEST_LINE:
            self.close()
