"""A mocked UR controller in a process of its own: ``python -m tests.support.ur_controller --host 127.0.0.2``.

It prints ``{"ready": true, ...}`` on standard output when all ports listen. Each line of JSON on
standard input, ``{"kind": "freeze", "seconds": 2}``, begins a fault (``mocks.ur.serve``) and is
answered by one line; end of file ends the process.
"""

import argparse
import json
import os
import select
import sys
from dataclasses import dataclass

from mocks.ur.arm.motions import as_six
from mocks.ur.hooks import HOME, ContactModel, ControllerConfig
from mocks.ur.serve import serve
from tests.support.plane_contact import PlaneContact


@dataclass(frozen=True)
class _Cue:
    kind: str
    seconds: float | None


class StandardInput:
    """Cues from standard input, read without blocking the cycle."""

    def __init__(self) -> None:
        self._waiting = b""
        self._lines: list[bytes] = []
        self.ended = False

    def cue(self) -> _Cue | None:
        """The next one, if a whole line has come; a line that is none is answered with an error."""
        self._read()
        if not self._lines:
            return None
        line = self._lines.pop(0)
        try:
            fields = json.loads(line)
        except ValueError:
            fields = None
        match fields:
            case {"kind": str(kind), "seconds": float() | int() as seconds} if len(fields) == 2:
                return _Cue(kind, float(seconds))
            case {"kind": str(kind)} if len(fields) == 1:
                return _Cue(kind, None)
        say({"error": f"a cue has 'kind' and perhaps 'seconds', not {line.decode('utf-8', 'replace')!r}"})
        return None

    def _read(self) -> None:
        if self.ended or not select.select([0], [], [], 0.0)[0]:
            return
        arrived = os.read(0, 1 << 16)
        self.ended = not arrived
        *lines, self._waiting = (self._waiting + arrived).split(b"\n")
        self._lines += [line for line in lines if line.strip()]


def say(answer: dict[str, object]) -> None:
    """One line on standard output."""
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def main() -> None:
    """Serve until standard input ends."""
    parser = argparse.ArgumentParser(description="A mocked UR controller; ends with its standard input.")
    parser.add_argument("--host", required=True, help="loopback address to serve on, 127.0.0.2 or above")
    parser.add_argument("--model", default="ur5e", help="ur3e, ur5e or ur10e")
    parser.add_argument("--joints", type=float, nargs=6, default=HOME, metavar="RAD")
    parser.add_argument("--seed", type=int, default=0, help="of the force sensor's bias and noise")
    parser.add_argument("--plane", type=float, metavar="Z", help="a horizontal spring to press on, m in base")
    parser.add_argument("--stiffness", type=float, default=20e3, help="of the plane, N/m")
    arguments = parser.parse_args()
    config = ControllerConfig(arguments.host, arguments.model, as_six(arguments.joints), seed=arguments.seed)
    contact: ContactModel | None = None
    if arguments.plane is not None:
        contact = PlaneContact(arguments.plane, arguments.stiffness)
    lines = StandardInput()
    serve(
        config,
        contact,
        None,
        lambda: lines.ended,
        cues=lines.cue,
        on_ready=lambda: say({"ready": True, "host": config.host, "model": config.model}),
        answer=lambda text: say({"cue": text}),
    )


if __name__ == "__main__":
    main()
