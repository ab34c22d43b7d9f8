"""Ports 29999, 30001 to 30003 and 30011 of the controller: dashboard, programs, messages.

From the manuals of the Dashboard Server e-Series and of the primary client interface (Universal Robots).
Of the primary interface's messages only the key messages are sent, at the start and at the end of each main
program; they carry the program's name. The state that a real controller sends ten times a second is not:
clients that want it use the real-time data exchange.
"""

import asyncio
import struct
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final

from mocks.ur.controller import Controller, RuntimeState
from mocks.ur.robot import SafetyMode
from mocks.ur.urscript.program import whole_length
from mocks.ur.urscript.values import ScriptError


class Connection(asyncio.Protocol):
    """One client, whose transport is at hand for as long as it is there.

    Args:
        members: all clients of the port; this one is among them while it is connected.
    """

    def __init__(self, members: set[Any]) -> None:
        self._members = members
        self._transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        assert isinstance(transport, asyncio.Transport), "a stream server makes stream transports"
        self._transport = transport
        self._members.add(self)

    def connection_lost(self, _error: Exception | None) -> None:
        """It has gone."""
        self._transport = None
        self._members.discard(self)

    def send(self, data: bytes) -> None:
        """To the client, if it is still there."""
        if self._transport is not None:
            self._transport.write(data)

    def close(self) -> None:
        """Hang up."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """Reset the connection."""
        if self._transport is not None:
            self._transport.abort()


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
_COMMANDS: Final = (
    *("play", "stop", "pause", "power on", "power off", "brake release", "unlock protective stop"),
    "close safety popup",
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
        self._robot = robot = controller.robot
        self._player = player = controller.player
        version = ".".join(map(str, robot.config.polyscope))
        self._questions: dict[str, Callable[[], str]] = {
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

    def reply(self, line: str) -> str:
        """The answer to one line; commands are refused in local control."""
        command = line.strip()
        words = command.lower()
        question = self._questions.get(words)
        if question is not None:
            return question()
        if words not in _COMMANDS:
            return f"could not understand: {command}"
        return self._obey(words) if self._robot.remote else LOCAL

    def _obey(self, command: str) -> str:
        controller, player, safety = self._controller, self._player, self._robot.safety
        match command:
            case "play":
                begun = safety.may_move and player.resume()
                return "Starting program" if begun else "Failed to execute: play"
            case "stop":
                player.stop()
                return "Stopped"
            case "pause":
                if player.state is not RuntimeState.PLAYING:
                    return "Failed to execute: pause"
                player.pause()
                return "Pausing program"
            case "power on":
                return "Powering on" if controller.power_on() else "Failed to execute: power on"
            case "power off":
                controller.power_off()
                return "Powering off"
            case "brake release":
                released = controller.release_brakes()
                return "Brake releasing" if released else "Failed to execute: brake release"
            case "unlock protective stop":
                if safety.mode is SafetyMode.PROTECTIVE_STOP and not safety.may_unlock(self._robot.time):
                    return TOO_EARLY
                safety.unlock()
                return "Protective stop releasing"
        return "closing safety popup"


class DashboardConnection(Connection):
    """One client; it is greeted, and gone after ``quit``."""

    def __init__(self, dashboard: Dashboard, members: "set[DashboardConnection]") -> None:
        super().__init__(members)
        self._dashboard = dashboard
        self._waiting = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        super().connection_made(transport)
        self.send(GREETING)

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


LONGEST_PROGRAM: Final = 1 << 20


class ScriptServer:
    """Runs the programs that arrive as text, in order of arrival.

    Translation takes some tens of milliseconds and happens in a worker thread, so that the cycle goes on.
    """

    def __init__(self, controller: Controller) -> None:
        self.connections: set[ScriptConnection] = set()  #: open ones.
        self._controller = controller
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="translate")
        self._tasks: set[asyncio.Task[None]] = set()

    def submit(self, text: str) -> None:
        """Translate a program, then start it."""
        task = asyncio.get_running_loop().create_task(self._run(text))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End the worker; what was not translated yet is not run."""
        self._worker.shutdown(wait=False, cancel_futures=True)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _run(self, text: str) -> None:
        controller = self._controller
        try:
            program = await asyncio.get_running_loop().run_in_executor(
                self._worker, controller.player.translate, text
            )
        except ScriptError as error:
            controller.complain(f"a program was refused: {error}")
            return
        if controller.robot.remote:
            controller.player.start(program)
        else:
            controller.complain("a program was refused: the pendant is in local control")


class ScriptConnection(Connection):
    """One client; what it leaves unfinished is not run."""

    def __init__(self, server: ScriptServer) -> None:
        super().__init__(server.connections)
        self._server = server
        self._waiting = ""

    def data_received(self, data: bytes) -> None:
        """Run every whole program."""
        self._waiting += data.decode("utf-8", "replace")
        while length := whole_length(self._waiting):
            text, self._waiting = self._waiting[:length], self._waiting[length:]
            if text.strip():
                self._server.submit(text)
        if len(self._waiting) > LONGEST_PROGRAM:
            self.abort()


_ROBOT_MESSAGE: Final = 20
_SOURCE: Final = -3
_KEY_MESSAGE: Final = 7
_LENGTH: Final = struct.Struct(">i")
_HEAD: Final = struct.Struct(">BQbBiiB")
"""Package type, time stamp in us, source, message type, code, argument, length of the title."""


def announce_programs(controller: Controller, members: set[Connection]) -> None:
    """Send the key message of every start and end of a main program to all clients of the primary port."""

    def publish(event: str, program: str) -> None:
        title = f"PROGRAM_XXX_{event}".encode()
        time = round(1e6 * controller.robot.time)
        head = _HEAD.pack(_ROBOT_MESSAGE, time, _SOURCE, _KEY_MESSAGE, 0, 0, len(title))
        body = head + title + program.encode()
        for connection in members:
            connection.send(_LENGTH.pack(_LENGTH.size + len(body)) + body)

    controller.player.listeners.append(publish)
