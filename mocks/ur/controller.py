"""One UR controller in simulated time: every 2 ms its program, its arm, its sensors, its safety.

It has no sockets and no clock of its own; ``cycle`` is called once for each 2 ms, on time or late.
"""

import sys
from collections.abc import Callable

from mocks.ur.arm.force_sensor import NO_WRENCH
from mocks.ur.arm.mover import MotionFault
from mocks.ur.geometry_functions import FUNCTIONS
from mocks.ur.hooks import CYCLE, ContactModel, ControllerConfig, OnCycle, OnOutputs
from mocks.ur.move_functions import MoveFunctions
from mocks.ur.player import Player, RuntimeState
from mocks.ur.robot import Robot
from mocks.ur.safety import FORCE_LIMIT, RobotMode, SafetyMode
from mocks.ur.state_functions import StateFunctions
from mocks.ur.system_functions import SystemFunctions


class Controller:
    """Everything but the ports.

    Args:
        config: of the controller.
        contact: what the tool feels; nothing where None.
        on_cycle: is told where the arm is, once a cycle.
        step: of the run, asked where a motion starts; keys the force sensor's noise.
        on_outputs: is told when a digital output changes.

    Attributes:
        robot: its state.
        player: its program.
    """

    def __init__(
        self,
        config: ControllerConfig,
        contact: ContactModel | None = None,
        on_cycle: OnCycle | None = None,
        step: Callable[[], int] = lambda: 0,
        on_outputs: OnOutputs | None = None,
    ) -> None:
        self.robot = Robot(config)
        builtins = {
            **FUNCTIONS,
            **MoveFunctions(self.robot).table(),
            **StateFunctions(self.robot).table(),
            **SystemFunctions(self.robot, self.protective_stop).table(),
        }
        self.player = Player(self.robot, builtins, self.complain)
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
