"""All that touches ur_rtde; lives in the child process, because the library crashes and hangs.

Each call's result is checked: where ur_rtde says False, the controller's own state says why.
"""

import itertools
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from drivers.ur import dashboard, pipe
from drivers.ur import words as ur_words
from drivers.ur.rtde_stream import RtdeStream
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, ProtectiveStop, TouchstoneError

PATIENCE: Final = 0.1  # s that the watchdog waits for a kick
DECELERATION: Final = 10.0  # m/s^2; 25 ms from the free speed of 0.25 m/s
NO_OFFSET: Final = [0.0] * 6


@dataclass(frozen=True)
class ControllerLink:
    """What the controller says it is."""

    model: str
    serial: str
    version: str


class Link:
    """ur_rtde's interfaces to one controller; ``control`` and ``io`` only from one thread."""

    def __init__(self, address: str, rate: float, patience: float = PATIENCE) -> None:
        self.address = address
        self.rate = rate
        self.patience = patience
        self._stream: Any = None
        self._newest: FloatArray | None = None
        self._halted = False
        self._kicks: deque[float] = deque([now()], maxlen=50)
        self._control: Any = None
        self._io: Any = None

    def connect(self, model: str) -> ControllerLink:
        """Check the controller, end what runs on it, upload the script, begin to receive.

        The packets must be read from then on; ``arm`` comes next.
        """
        identity = self._check_controller(model)
        from rtde_io import RTDEIOInterface

        self._control = self._constructed("control", self._make_control)
        self._io = self._constructed("digital outputs", lambda: RTDEIOInterface(self.address))
        self._stream = RtdeStream(self.address, self.rate)
        return identity

    def arm(self) -> None:
        """Poses are the flange's: no tool offset, read back; then the watchdog."""
        self._wait_until_running()
        self._check(self._control.setTcp(NO_OFFSET), "set the tool offset to zero")
        offset = list(self._control.getTCPOffset())
        if any(abs(value) > 1e-9 for value in offset):
            raise BenchFault(
                f"the controller keeps a tool offset of {offset} after it was set to zero; "
                "remove it in the pendant's installation"
            )
        hertz = 1.0 / self.patience
        self._check(self._control.setWatchdog(hertz), f"arm the watchdog at {hertz:g} Hz")

    def packets(self) -> Iterator[FloatArray | None]:
        """Each packet as it arrives; None whenever there was none for a moment."""
        for packet in self._stream.packets():
            self._newest = self._newest if packet is None else packet
            yield packet

    def kick(self) -> None:
        """Tell the watchdog that this program is well.

        Nothing is sent to a script that does not run: ur_rtde would wait seconds for its answer.
        """
        if self._halted or not self.program_running():
            return
        self._kicks.append(now())
        self._control.kickWatchdog()

    def longest_silence(self) -> float:
        """Seconds, the longest that the watchdog had to wait of late."""
        times = [*self._kicks, now()]
        return max(later - earlier for earlier, later in itertools.pairwise(times))

    def start_joints(self, joints: list[float], speed: float, acceleration: float) -> None:
        """Start a joint motion and return."""
        self._check(self._control.moveJ(joints, speed, acceleration, True), "start a joint motion")

    def start_line(self, pose: list[float], speed: float, acceleration: float) -> None:
        """Start a straight line of the flange and return."""
        self._check(self._control.moveL(pose, speed, acceleration, True), "start a straight line")

    def reachable(self, pose: list[float], near: list[float]) -> bool:
        """Whether the controller itself has joints for a pose close to ``near``."""
        return bool(self._control.getInverseKinematicsHasSolution(pose, near))

    def brake(self) -> None:
        """Start to decelerate and return."""
        if not self._halted:
            self._control.stopL(DECELERATION, True)

    def halt(self) -> None:
        """End the controller's program through its dashboard; nothing is sent to it after that."""
        self._halted = True
        dashboard.stop(self.address)

    def progress(self) -> tuple[int, bool]:
        """(change count, whether an asynchronous motion or stop is running)."""
        status = self._control.getAsyncOperationProgressEx()
        return int(status.changeCount()), bool(status.isAsyncOperationRunning())

    def program_running(self) -> bool:
        """Whether the uploaded script is alive."""
        return bool(self._control.isProgramRunning())

    def state_is_older(self) -> bool:
        """Whether the newest state is of before the program ended: it does not say yet what ended it."""
        return self._newest is None or int(self._newest[pipe.FIELDS["runtime_state"]][0]) == ur_words.PLAYING

    def zero_force(self) -> None:
        """Take the present reading of the force sensor as zero."""
        self._check(self._control.zeroFtSensor(), "zero the force sensor")

    def set_tool_output(self, index: int, on: bool) -> None:
        """Switch a digital output at the tool."""
        self._check(self._io.setToolDigitalOut(index, on), f"switch tool output {index}")

    def end_script(self) -> None:
        """End the uploaded script, which disarms nothing it leaves running."""
        if self.program_running() and not self._halted:
            self._control.stopScript()

    def revive(self) -> None:
        """Upload the script again; only for an arm at rest whose script this program let die."""
        self._check(self._control.reuploadScript(), "upload the control script again")
        self.arm()

    def why(self) -> TouchstoneError:
        """What the controller's state says about a call that failed."""
        if self._newest is None:
            return BenchFault("the controller has sent no state; check the network cable of the control box")
        safety, state, mode = (
            int(self._newest[pipe.FIELDS[name]][0]) for name in ("safety_bits", "runtime_state", "robot_mode")
        )
        words = ur_words.safety_words(safety)
        text = (
            f"the controller says: safety {words}, program {ur_words.RUNTIME_STATES.get(state, 'unknown')}, "
            f"robot {ur_words.ROBOT_MODES.get(mode, 'unknown')}"
        )
        # Also of a program that plays: it may have been started again, or its last packet be old.
        if self.longest_silence() > 0.8 * self.patience:
            silence = 1e3 * self.longest_silence()
            text += f", its watchdog kept waiting for {silence:.0f} ms (limit {1e3 * self.patience:.0f} ms)"
        return BenchFault(text) if words in ur_words.MAY_MOVE else ProtectiveStop(text)

    def _check(self, accepted: object, what: str) -> None:
        if accepted is not True:
            cause = self.why()
            raise type(cause)(f"could not {what}: {cause}")

    def _check_controller(self, model: str) -> ControllerLink:
        """Model, remote control, power and safety; then end whatever program runs there.

        A script left by a client that died keeps RTDEControlInterface's constructor waiting for
        minutes; the dashboard ends it at once.
        """
        from dashboard_client import DashboardClient

        board = DashboardClient(self.address)
        try:
            board.connect(2000)
            identity = ControllerLink(
                board.getRobotModel().strip(),
                board.getSerialNumber().strip(),
                board.polyscopeVersion().strip(),
            )
            remote, mode, safety = board.isInRemoteControl(), board.robotmode(), board.safetystatus()
            _check_model(identity, model, self.address)
            _check_ready(remote, mode, safety, self.address)
            board.stop()
        except RuntimeError as error:
            raise BenchFault(
                f"the dashboard of the arm at {self.address} does not answer as a UR controller's should "
                f"({error}); check the address and the network cable of the control box"
            ) from error
        return identity

    def _make_control(self) -> object:
        from rtde_control import RTDEControlInterface

        return RTDEControlInterface(self.address, self.rate)

    def _constructed(self, what: str, make: Any) -> Any:
        """An ur_rtde interface; once more after a second where an old socket still holds registers."""
        for attempt in (1, 2):
            try:
                return make()
            except RuntimeError as error:
                if "already in use" in str(error) and attempt == 1:
                    time.sleep(1.0)
                    continue
                raise BenchFault(self._connect_failure(what, str(error))) from error
        raise AssertionError("both attempts return or raise")

    def _connect_failure(self, what: str, text: str) -> str:
        if "already in use" in text:
            return (
                f"the arm at {self.address}: another client holds the controller's input registers ({what}): "
                "end it, or disable EtherNet/IP, PROFINET and MODBUS in the pendant's installation"
            )
        return (
            f"the arm at {self.address}: ur_rtde could not open its {what} ({text}); "
            "check the network cable of the control box and that it is in remote control"
        )

    def _wait_until_running(self) -> None:
        end = now() + 2.0
        while not self.program_running():
            if now() > end:
                cause = self.why()
                raise type(cause)(f"the control script does not run on the controller: {cause}")
            time.sleep(0.01)


def _check_model(identity: ControllerLink, model: str, address: str) -> None:
    """The dashboard names an e-Series arm without its e."""
    if identity.model.lower().rstrip("e") != model.lower().rstrip("e"):
        raise BenchFault(
            f"the station says {model}; the controller at {address} is a {identity.model} "
            f"(serial {identity.serial}): correct the station file or the address"
        )


def _check_ready(remote: bool, mode: str, safety: str, address: str) -> None:
    if not remote:
        raise BenchFault(
            f"the arm at {address} is in local control; switch it to remote control at the top right "
            "of the pendant"
        )
    if not any(word in safety.upper() for word in ("NORMAL", "REDUCED")):
        raise ProtectiveStop(
            f"the arm at {address} is stopped ({safety}); look at the pendant for the cause, clear it "
            "and release the stop there"
        )
    if "RUNNING" not in mode.upper():
        raise BenchFault(
            f"the arm at {address} is not powered ({mode}); switch it on and release the brakes "
            "at the pendant"
        )
