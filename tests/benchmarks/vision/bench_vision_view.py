"""What a frame of the page that turns an object takes, asked for over its own wire, one after another.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_view.py OBJECT --frames 40``; CPU is of server and
client together, so that it says something on a busy machine, where the clock says nothing.
"""

import argparse
import time
from http.client import HTTPConnection
from pathlib import Path

import numpy as np

from harness.commands.output import ANSWERS
from harness.live_view.server import LiveFrames
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.render import open_vision
from tests.support.served_look import served

_SIZES = (128, 256, 400)


def main() -> None:
    """Print a line for each size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--threads", type=int, default=1)
    asked = parser.parse_args()
    of = ObjectFile.open(asked.folder)
    with served(LiveFrames(of.description.name, open_vision(of, asked.threads))) as server:
        wire = HTTPConnection("127.0.0.1", server.server_port)
        _measure(wire, asked.frames)
        wire.close()


def _measure(wire: HTTPConnection, frames: int) -> None:
    for size in _SIZES:
        _turn(wire, size, 2)
        begun, clock = time.process_time(), time.perf_counter()
        _turn(wire, size, frames)
        cpu, took = time.process_time() - begun, time.perf_counter() - clock
        each = 1e3 / frames
        ANSWERS.print(f"{size} a side: {cpu * each:.1f} ms of CPU, {took * each:.1f} on the clock")


def _turn(wire: HTTPConnection, size: int, frames: int) -> None:
    for angle in np.linspace(0.0, 2.0 * np.pi, frames, endpoint=False):
        eye = f"{0.3 * np.cos(angle)},{0.3 * np.sin(angle)},0.2"
        wire.request("GET", f"/frame.png?camera={eye}&width={size}&height={size}")
        answer = wire.getresponse()
        answer.read()
        if answer.status != 200:
            raise RuntimeError(f"{answer.status} for a frame")


if __name__ == "__main__":
    main()
