"""One UR controller in simulated time: every 2 ms its program, its arm, its sensors, its safety.

It has no sockets and no clock of its own; ``cycle`` is called once for each 2 ms, on time or late.
"""

import sys
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, Final

from mocks.ur.arm.mover import PROGRAM_STOP, MotionFault
from mocks.ur.functions import Functions
from mocks.ur.hooks import CYCLE, ContactModel, ControllerConfig, OnCycle, OnOutputs
from mocks.ur.robot import FORCE_LIMIT, NO_WRENCH, Robot, RobotMode, SafetyMode
from mocks.ur.urscript.process import Process
from mocks.ur.urscript.program import Program, translate
from mocks.ur.urscript.values import ScriptError

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
        self.state = RuntimeState.STOPPED  #: of the main program.
        self.name = ""  #: of the main program, the last one where none runs.
        self.listeners: list[Callable[[str, str], None]] = []
        """are called with ``"STARTED"`` or ``"STOPPED"`` and the name of a main program."""

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


class Controller:
    """Everything but the ports.

    Args:
        config: of the controller.
        contact: what the tool feels; nothing where None.
        on_cycle: is told where the arm is, once a cycle.
        step: of the run, asked where a motion starts; keys the force sensor's noise.
        on_outputs: is told when a digital output changes.
    """

    def __init__(
        self,
        config: ControllerConfig,
        contact: ContactModel | None = None,
        on_cycle: OnCycle | None = None,
        step: Callable[[], int] = lambda: 0,
        on_outputs: OnOutputs | None = None,
    ) -> None:
        self.robot = Robot(config)  #: its state.
        builtins = Functions(self.robot, self.protective_stop).table()
        self.player = Player(self.robot, builtins, self.complain)  #: its program.
        self._contact = contact
        self._on_cycle = on_cycle
        self._on_outputs = on_outputs
        self._outputs = self.robot.outputs.digital
        self._step = step
        self._motions = 0
        self._feel()

    def cycle(self) -> None:
        """2 ms of the controller's time."""
        robot = self.robot
        robot.cycles += 1
        self._check_watchdog()
        self.player.step()
        self._move()
        self._feel()
        if self._on_cycle is not None:
            self._on_cycle(robot.time, robot.mover.joints, robot.mover.base_from_flange)
        if robot.outputs.digital != self._outputs:
            self._outputs = robot.outputs.digital
            if self._on_outputs is not None:
                self._on_outputs(self._outputs)

    def complain(self, text: str) -> None:
        """Into the log, and to whoever started the mock."""
        self.robot.log.append(text)
        sys.stderr.write(f"controller {self.robot.config.host}: {text}\n")

    # Safety

    def protective_stop(self, cause: str) -> None:
        """Stop the arm and pause the program, until it is unlocked."""
        if self.robot.safety.protective_stop(cause, self.robot.time):
            self.complain(f"protective stop: {cause}")
            self.player.pause()
            self.robot.mover.suspend()

    def emergency_stop(self) -> None:
        """End the program, take the power away, close the brakes."""
        self.robot.safety.emergency_stop(self.robot.time)
        self.player.stop()
        self.robot.mover.hold()
        self.complain("emergency stop")

    def power_on(self) -> bool:
        """Power without brakes released; False while an emergency stop is pressed."""
        safety = self.robot.safety
        if safety.mode is SafetyMode.ROBOT_EMERGENCY_STOP:
            return False
        if safety.power is RobotMode.POWER_OFF:
            safety.power = RobotMode.IDLE
        return True

    def power_off(self) -> None:
        """End the program and take the power away."""
        self.player.stop()
        self.robot.mover.hold()
        self.robot.safety.power = RobotMode.POWER_OFF

    def release_brakes(self) -> bool:
        """Ready to move; powers on first. False while an emergency stop is pressed."""
        if not self.power_on():
            return False
        self.robot.safety.power = RobotMode.RUNNING
        return True

    @property
    def status_bits(self) -> int:
        """``robot_status_bits``: power, program running."""
        powered = self.robot.safety.power is not RobotMode.POWER_OFF
        return int(powered) | int(self.player.state is RuntimeState.PLAYING) << 1

    # One cycle's parts

    def _check_watchdog(self) -> None:
        robot = self.robot
        watchdog = robot.watchdog
        if watchdog is None or self.player.state is not RuntimeState.PLAYING:
            return
        silent = CYCLE * (robot.cycles - robot.written.get(watchdog.variable, 0))
        if silent > watchdog.period:
            self.complain(
                f"watchdog: {watchdog.variable} was not written for {silent:.3f} s: {watchdog.action}"
            )
            robot.watchdog = None
            (self.player.stop if watchdog.action == "stop" else self.player.pause)()

    def _move(self) -> None:
        robot, mover = self.robot, self.robot.mover
        scaling = robot.outputs.slider if self.player.state is RuntimeState.PLAYING else 1.0
        try:
            mover.advance(CYCLE * scaling)
        except MotionFault as fault:
            if robot.safety.mode is SafetyMode.NORMAL:
                self.protective_stop(str(fault))
            else:
                mover.hold()  # there is no room to brake in

    def _feel(self) -> None:
        robot = self.robot
        if robot.mover.motions != self._motions:
            self._motions = robot.mover.motions
            robot.force.begin_motion(self._step())
        pose = robot.mover.base_from_flange
        wrench = NO_WRENCH if self._contact is None else self._contact.wrench(pose, robot.time)
        robot.force.read(wrench, pose)
        x, y, z = robot.force.base[:3]
        if x * x + y * y + z * z > FORCE_LIMIT * FORCE_LIMIT:
            self.protective_stop(f"the force at the tool exceeds {FORCE_LIMIT:g} N")
