"""A mocked controller with a springy floor: ``python arm_far_end.py HOST SERIAL``; ends with its input.

It takes ``{"cue": {"kind": ..., "seconds": ...}}`` and ``{"where": true}`` on standard input, a
line each, and answers each with a line.
"""

import json
import os
import queue
import sys
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mocks.ur.hooks import ControllerConfig
from mocks.ur.serve import serve

JOINTS = (0.0, -1.4, 1.7, -1.87, -1.57, 0.0)
FLOOR = 0.15  # m in base
STIFFNESS = 5000.0  # N/m


@dataclass(frozen=True)
class Cue:
    kind: str
    seconds: float | None = None


class Floor:
    def wrench(self, base_from_flange: Sequence[Sequence[float]], time: float) -> Sequence[float]:
        return [0.0, 0.0, STIFFNESS * max(0.0, FLOOR - base_from_flange[2][3]), 0.0, 0.0, 0.0]


class FarEnd:
    def __init__(self) -> None:
        self.closed = False
        self.cues: queue.SimpleQueue[Cue] = queue.SimpleQueue()
        self.where: dict[str, Any] = {}
        self.outputs = 0
        self.has_cycled = threading.Event()

    def switch(self, bits: int, /) -> None:
        self.outputs = bits

    def cycle(self, time: float, joints: Sequence[float], base_from_flange: Any, /) -> None:
        self.where = {"time": time, "joints": list(joints), "pose": [list(row) for row in base_from_flange]}
        self.has_cycled.set()

    def next_cue(self) -> Cue | None:
        return None if self.cues.empty() else self.cues.get()

    def listen(self) -> None:
        for line in sys.stdin:
            request = json.loads(line)
            if "cue" in request:
                self.cues.put(Cue(**request["cue"]))
            self.has_cycled.wait()
            say({**self.where, "outputs": self.outputs})
        self.closed = True


def say(answer: object) -> None:
    os.write(1, json.dumps(answer).encode() + b"\n")


def main() -> None:
    far_end = FarEnd()
    threading.Thread(target=far_end.listen, daemon=True).start()
    serve(
        ControllerConfig(host=sys.argv[1], serial=sys.argv[2], joints=JOINTS, force_bias=2.0),
        contact=Floor(),
        on_cycle=far_end.cycle,
        should_stop=lambda: far_end.closed,
        cues=far_end.next_cue,
        on_ready=lambda: say({"ready": True}),
        on_outputs=far_end.switch,
    )


main()
