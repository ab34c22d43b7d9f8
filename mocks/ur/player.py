"""The program on the controller: started by an upload, paused and ended by the dashboard or by safety."""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, Final

from mocks.ur.arm.mover import PROGRAM_STOP
from mocks.ur.robot import Robot
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import Process
from mocks.ur.urscript.program import Program, translate

_SECONDARY: Final = -2
_CACHED: Final = 32


class RuntimeState(IntEnum):
    """``runtime_state`` (Universal Robots, RTDE guide)."""

    STOPPED = 1
    PLAYING = 2
    PAUSED = 4


class Player:
    """Runs programs on one robot.

    Args:
        robot: what they act on.
        builtins: what they may call.
        complain: is told in words why a program ended.

    Attributes:
        state: of the main program.
        name: of the main program, the last one where none runs.
        listeners: are called with ``"STARTED"`` or ``"STOPPED"`` and the name of a main program.
    """

    def __init__(
        self, robot: Robot, builtins: Mapping[str, Callable[..., Any]], complain: Callable[[str], None]
    ) -> None:
        self._robot = robot
        self._builtins = builtins
        self._complain = complain
        self._cache: dict[str, Program] = {}
        self._main: Process | None = None
        self._secondary: list[Process] = []
        self.state = RuntimeState.STOPPED
        self.name = ""
        self.listeners: list[Callable[[str, str], None]] = []

    def translate(self, text: str) -> Program:
        """A program's functions; slow, so not for the controller's cycle. The newest texts are remembered.

        Raises:
            ScriptError: it is not URScript, or names what is not there.
        """
        if text not in self._cache:
            program = translate(text, self._builtins)
            while len(self._cache) >= _CACHED:
                self._cache.pop(next(iter(self._cache)))
            self._cache[text] = program
        return self._cache[text]

    def start(self, program: Program) -> None:
        """Run it from its first line; a main program replaces the one that runs."""
        if program.secondary:
            self._secondary.append(Process(program.main, self._enter_secondary, lambda _: None))
            return
        self.stop()
        if not self._robot.safety.may_move:
            self._complain(
                f"program '{program.name}' was not started: {self._robot.safety.mode.name.lower()}"
            )
            return
        self._main = Process(program.main, self._enter, self._robot.mover.release)
        self.name = program.name
        self.state = RuntimeState.PLAYING
        self._announce("STARTED")

    def step(self) -> None:
        """One cycle of every program."""
        if self._main is not None and self.state is RuntimeState.PLAYING and not self._goes_on(self._main):
            self._end()
        self._secondary = [process for process in self._secondary if self._goes_on(process)]

    def stop(self) -> None:
        """End the main program; a moving arm brakes."""
        if self._main is not None:
            self._main.close()
            self._end()

    def pause(self) -> None:
        """Hold the program and the arm where they are."""
        if self.state is RuntimeState.PLAYING:
            self.state = RuntimeState.PAUSED
            self._robot.mover.suspend()

    def resume(self) -> bool:
        """Go on; an interrupted move is taken up again. False where nothing is paused."""
        if self.state is not RuntimeState.PAUSED:
            return False
        self._robot.mover.resume()
        if self._robot.watchdog is not None:
            self._robot.written[self._robot.watchdog.variable] = self._robot.cycles
        self.state = RuntimeState.PLAYING
        return True

    def _goes_on(self, process: Process) -> bool:
        try:
            return process.step()
        except ScriptError as error:
            self._complain(f"program '{self.name}' stopped: {error}")
            process.close()
            return False

    def _end(self) -> None:
        self._main = None
        self.state = RuntimeState.STOPPED
        self._robot.watchdog = None
        self._robot.mover.brake(PROGRAM_STOP)
        self._announce("STOPPED")

    def _announce(self, event: str) -> None:
        for listener in self.listeners:
            listener(event, self.name)

    def _enter(self, thread: int) -> None:
        self._robot.thread = thread

    def _enter_secondary(self, thread: int) -> None:
        self._robot.thread = _SECONDARY if thread else 0
