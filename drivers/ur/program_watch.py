"""Which programs start on the controller, by its own messages (Universal Robots, primary client interface).

A program that somebody else sends takes the arm from this driver's, and nothing in the state stream tells
the two apart. The read-only primary port names each program as it starts: one that was not uploaded from
here is stopped at once, through the dashboard.
"""

import contextlib
import socket
import struct
import threading
from collections.abc import Callable, Iterator
from typing import Final

from harness.basics.errors import BenchFault

PORT: Final = 30011
OWN: Final = "rtde_control"  # the name of ur_rtde's script
CONNECT_WITHIN: Final = 2.0  # s

_LENGTH: Final = struct.Struct(">i")
_HEAD: Final = struct.Struct(">BQbBiiB")
"""Type, time stamp, source, message type, code, argument, length of the title."""
_ROBOT_MESSAGE, _KEY_MESSAGE = 20, 7
_STARTED: Final = b"PROGRAM_XXX_STARTED"
_LONGEST: Final = 1 << 20  # bytes of a package; the controller's own state has a few thousand


class ProgramWatch:
    """Reads the messages in a thread of its own.

    Args:
        address: of the controller.
        stop: ends the program on the controller; called in the thread.

    Raises:
        BenchFault: the port does not answer.
    """

    def __init__(self, address: str, stop: Callable[[], None]) -> None:
        self.foreign = ""  #: the first program that was not expected, in words; empty where there was none.
        self.failure = ""  #: why no messages come any more; empty while they may.
        self._address = address
        self._stop = stop
        self._expected = False
        try:
            self._socket = socket.create_connection((address, PORT), timeout=CONNECT_WITHIN)
        except OSError as error:
            raise BenchFault(
                f"the arm at {address}: its messages on port {PORT} do not come ({error}); without them a "
                "program of somebody else would go unnoticed: check the network cable of the control box"
            ) from error
        self._socket.settimeout(None)

    def start(self) -> None:
        """Begin to read."""
        threading.Thread(target=self._run, name="arm programs", daemon=True).start()

    def expect(self) -> None:
        """The next start of a program of this driver's name is its own."""
        self._expected = True

    @property
    def awaits(self) -> bool:
        """Whether the expected program has not started yet."""
        return self._expected

    def _run(self) -> None:
        try:
            with self._socket:
                for program in started_programs(self._chunks()):
                    self._judge(program)
        except (BenchFault, OSError) as error:
            self.failure = (
                f"the arm at {self._address}: its messages on port {PORT} ended ({error}); "
                "check the network cable of the control box"
            )

    def _judge(self, program: str) -> None:
        if program == OWN and self._expected:
            self._expected = False
            return
        self.foreign = self.foreign or (f"'{program}'" if program else "without a name")
        with contextlib.suppress(BenchFault):
            self._stop()

    def _chunks(self) -> Iterator[bytes]:
        while arrived := self._socket.recv(1 << 16):
            yield arrived
        raise BenchFault("end of file")


def started_programs(chunks: Iterator[bytes]) -> Iterator[str]:
    """The name of each program that starts, from the bytes of the primary port however they are cut.

    Names are shortened to 80 characters; what is not printable becomes a question mark.

    Raises:
        BenchFault: a package of an impossible size.
    """
    waiting = b""
    for chunk in chunks:
        waiting += chunk
        while len(waiting) >= _LENGTH.size:
            (size,) = _LENGTH.unpack_from(waiting)
            if not _LENGTH.size < size <= _LONGEST:
                raise BenchFault(f"a package of {size} bytes; 5 to {_LONGEST} are possible")
            if len(waiting) < size:
                break
            body, waiting = waiting[_LENGTH.size : size], waiting[size:]
            name = _started(body)
            if name is not None:
                yield name


def _started(body: bytes) -> str | None:
    """The program's name if this is the message that one started."""
    if body[0] != _ROBOT_MESSAGE or len(body) < _HEAD.size:
        return None
    *_, kind, _, _, length = _HEAD.unpack_from(body)
    title, text = body[_HEAD.size : _HEAD.size + length], body[_HEAD.size + length :]
    if kind != _KEY_MESSAGE or title != _STARTED:
        return None
    shown = text.decode("utf-8", "replace")[:80]
    return "".join(letter if letter.isprintable() else "?" for letter in shown)


def foreign_program_text(address: str, program: str, during: str) -> str:
    """What an operator must know of a program that somebody else sent."""
    return (
        f"the arm at {address} was stopped through its dashboard {during}: a program {program} was started "
        "on its controller by somebody else; find who sent it (the pendant, another computer) and end that, "
        "look at where the arm is, then open it again to move it"
    )
