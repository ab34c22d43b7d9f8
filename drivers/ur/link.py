"""All that touches ur_rtde; lives in the child process, because the library crashes and hangs.

Each call's result is checked: where ur_rtde says False, the controller's own state says why.
"""

import itertools
import time
from collections import deque
from collections.abc import Iterator
from typing import Any, Final

from drivers.ur import dashboard, pipe
from drivers.ur import state as ur_state
from drivers.ur.dashboard import ControllerLink, checked_controller
from drivers.ur.program_watch import OWN, ProgramWatch, foreign_program_text
from drivers.ur.stream import RtdeStream
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, ProtectiveStop, SafetyStop, TouchstoneError

PATIENCE: Final = 0.1  # s that the watchdog waits for a kick
LATELY: Final = 0.2  # s before the script's end in which a late kick may be what ended it
DECELERATION: Final = 10.0  # m/s^2; 25 ms from the free speed of 0.25 m/s
NO_OFFSET: Final = [0.0] * 6
START_WITHIN: Final = 5.0  # s for the uploaded script to run, and to be named


class Link:
    """ur_rtde's interfaces to one controller; ``control`` and ``io`` only from one thread."""

    def __init__(self, address: str, rate: float, patience: float = PATIENCE) -> None:
        self.address = address
        self.rate = rate
        self.patience = patience
        self._stream: Any = None
        self._newest: FloatArray | None = None
        self._halted = False
        self._ended: float | None = None  # s on the bench clock, of the first packet without the script
        self._programs: ProgramWatch | None = None
        self._kicks: deque[float] = deque([now()], maxlen=50)
        self._control: Any = None
        self._io: Any = None

    def connect(self, model: str) -> ControllerLink:
        """Check the controller, end what runs on it, upload the script, begin to receive.

        The packets must be read from then on; ``arm`` comes next.
        """
        identity = checked_controller(self.address, model)
        self._programs = ProgramWatch(self.address, self.halt)
        self._programs.expect()
        self._programs.start()
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
        self._kicks.clear()  # nothing waited for a kick before
        self._kicks.append(now())

    def packets(self) -> Iterator[FloatArray | None]:
        """Each packet as it arrives; None whenever there was none for a moment."""
        for packet in self._stream.packets():
            if packet is not None:
                self._note_the_end(packet)
                self._newest = packet
            yield packet

    def _note_the_end(self, packet: FloatArray) -> None:
        """When the program ended: a kick that it met hangs in the library, and says nothing of that."""
        if int(packet[pipe.FIELDS["runtime_state"]][0]) == ur_state.PLAYING:
            self._ended = None
        elif self._ended is None:
            self._ended = float(packet[pipe.FIELDS["time"]][0])

    def kick(self) -> None:
        """Tell the watchdog that this program is well.

        Nothing is sent to a script that does not run: ur_rtde would wait seconds for its answer.
        """
        if self._halted or not self.program_running():
            return
        self._kicks.append(now())
        self._control.kickWatchdog()

    def longest_silence(self) -> float:
        """Seconds, the longest that the watchdog had to wait in the last moments of the program."""
        end = now() if self._ended is None else self._ended
        gaps = itertools.pairwise([*(kick for kick in self._kicks if kick < end), end])
        return max(later - earlier for earlier, later in gaps if later > end - LATELY)

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
        return self._newest is None or int(self._newest[pipe.FIELDS["runtime_state"]][0]) == ur_state.PLAYING

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

    def foreign_program(self) -> str:
        """The program that somebody else started, which is stopped already; empty where nobody did.

        Raises:
            BenchFault: the controller does not name its programs any more.
        """
        programs = self._watched
        if programs.failure and not programs.foreign:
            raise BenchFault(programs.failure)
        return programs.foreign

    @property
    def _watched(self) -> ProgramWatch:
        assert self._programs is not None, "set by connect"
        return self._programs

    def revive(self) -> None:
        """Upload the script again; only for an arm at rest whose script this program let die."""
        self._watched.expect()
        self._check(self._control.reuploadScript(), "upload the control script again")
        self.arm()

    def why(self) -> TouchstoneError:
        """What the controller's state says about a call that failed."""
        if self._newest is None:
            return BenchFault("the controller has sent no state; check the network cable of the control box")
        safety, state, mode = (
            int(self._newest[pipe.FIELDS[name]][0]) for name in ("safety_bits", "runtime_state", "robot_mode")
        )
        words = ur_state.safety_words(safety)
        text = (
            f"the controller says: safety {words}, program {ur_state.RUNTIME_STATES.get(state, 'unknown')}, "
            f"robot {ur_state.ROBOT_MODES.get(mode, 'unknown')}"
        )
        if words not in ur_state.MAY_MOVE:
            return ProtectiveStop(text)
        return BenchFault(text + self._who_ended_it(state))

    def _who_ended_it(self, state: int) -> str:
        """Why the program does not run, in words; empty where it does and was always fed in time."""
        silence = self.longest_silence()
        # Also of a program that plays: it may have been started again, or its last packet be old.
        if silence > 0.8 * self.patience:
            return (
                f"; this computer was too busy: the watchdog waited for {1e3 * silence:.0f} ms (limit "
                f"{1e3 * self.patience:.0f} ms): close what else runs on it, then open the arm again"
            )
        if state in ur_state.ENDED:
            done = "paused" if state in ur_state.PAUSED else "stopped"
            return (
                f"; somebody {done} the program, at the pendant or through the dashboard: ask who, then open "
                "the arm again"
            )
        return ""

    def _check(self, accepted: object, what: str) -> None:
        if accepted is not True:
            cause = self.why()
            raise type(cause)(f"could not {what}: {cause}")

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
        """Until the script runs, and the controller has named it as started."""
        end = now() + START_WITHIN
        while self._watched.awaits or not self.program_running():
            if self.foreign_program():
                raise SafetyStop(
                    foreign_program_text(self.address, self.foreign_program(), "as it was opened")
                )
            if now() > end:
                raise self._not_started()
            time.sleep(0.01)

    def _not_started(self) -> TouchstoneError:
        if self.program_running():
            return BenchFault(
                f"the controller at {self.address} did not name its program '{OWN}' as it started (limit "
                f"{START_WITHIN:g} s), so one of somebody else would go unnoticed; update PolyScope"
            )
        cause = self.why()
        return type(cause)(f"the control script does not run on the controller: {cause}")


KICK_PERIOD: Final = 0.02  # s; five kicks in the 0.1 s that the watchdog waits at a real bench
LATE: Final = 0.8  # of the watchdog's patience between two kicks: it may have ended the script


class Watchdog:
    """Kicks for one link, and a memory of the kicks that came late."""

    def __init__(self, link: Link) -> None:
        self._link = link
        self._kicked = now()
        self._late = -LATELY
        self._script_ran = True
        self.bit = False

    def start(self) -> None:
        """The watchdog has just been armed; the script runs."""
        self._link.kick()
        self._kicked = now()
        self._script_ran = True
        self.bit = False

    def kick(self) -> None:
        """Kick, if it is time to."""
        if now() - self._kicked < KICK_PERIOD:
            return
        if self._is_late():
            self._late = now()
        self._link.kick()
        self._kicked = now()

    def look(self) -> None:
        """Notice the end of the script; ``bit`` tells whether a late kick is to blame.

        A script that ended for any other reason (the stop button at the pendant) stays ended.
        """
        ran, self._script_ran = self._script_ran, self._link.program_running()
        if ran and not self._script_ran:
            self.bit = self._is_late() or now() - self._late < LATELY

    def _is_late(self) -> bool:
        return now() - self._kicked > LATE * self._link.patience
