"""Rate and age of frames from a camera in a process of its own, with the time drawn into its pixels."""

import sys
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from drivers.camera.http_camera import HttpCamera, gelsight
from harness.basics.arrays import ByteArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.bench.sensor import GELSIGHT_R15
from mocks.camera.gelsight_stream import MjpegServer
from mocks.faults import Fault
from mocks.lab_processes import ChildPipe, LabChild, free_address

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux")

BITS, BLOCK = 48, 16
SENSOR = replace(GELSIGHT_R15, rows=6 * BLOCK, columns=8 * BLOCK)
PORT = 8080


class ClockFace:
    """Shows the bench clock in microseconds, a block of 16 x 16 pixels a bit."""

    def state(self) -> int:
        self._microseconds = int(now() * 1e6)
        return self._microseconds

    def picture(self) -> ByteArray:
        bits = (self._microseconds >> np.arange(BITS)) & 1
        face = np.kron(bits.reshape(6, 8), np.ones((BLOCK, BLOCK), np.int64)) * 255
        return np.repeat(face.astype(np.uint8)[..., None], 3, axis=2)

    def sent(self) -> None:
        pass


def shown_time(image: ByteArray) -> float:
    blocks = image[..., 0].reshape(6, BLOCK, 8, BLOCK).mean(axis=(1, 3)).ravel() > 127
    return float(np.sum(blocks.astype(np.int64) << np.arange(BITS))) * 1e-6


def _serve(line: ChildPipe, address: str) -> None:
    server = MjpegServer(address, PORT, ClockFace(), 25.0)
    line.ready()

    def should_stop() -> bool:
        fault = line.fault()
        if fault is not None:
            server.fault.set(fault)
        return line.should_stop()

    server.serve(should_stop)


@pytest.fixture(scope="module")
def camera() -> Iterator[tuple[LabChild, str]]:
    address = free_address()
    child = LabChild("clock", lambda line: _serve(line, address))
    child.wait_ready(5.0)
    yield child, f"http://{address}:{PORT}/?action=stream"
    child.kill()


@pytest.fixture
def gel(camera: tuple[LabChild, str]) -> Iterator[HttpCamera]:
    gel = gelsight(camera[1], SENSOR)
    gel.open()
    yield gel
    gel.close()


def test_the_stated_rate_arrives(gel: HttpCamera) -> None:
    reading = gel.read(50, 4.0)
    drawn = np.array([shown_time(image) for image in reading.values])
    assert np.all(np.diff(drawn) > 0.0)
    # The median: single frames may be late on a machine with other work.
    assert np.median(np.diff(drawn)) == pytest.approx(0.04, rel=0.1)
    assert np.median(reading.times - drawn) < 0.02
    assert gel.health().rate == pytest.approx(25.0, rel=0.15)


def test_the_newest_frame_is_new_however_slow_the_consumer(gel: HttpCamera) -> None:
    ages = []
    for _ in range(8):
        time.sleep(0.15)  # the stream sends four frames meanwhile
        asked = now()
        reading = gel.read(1, 2.0)
        ages.append(reading.times[0] - shown_time(reading.values[0]))
        assert (
            shown_time(reading.values[0]) > asked - 0.08
        )  # drawn at most two periods before it was asked for
    assert np.median(ages) < 0.02


def test_a_stalled_camera_is_named_and_read_again(camera: tuple[LabChild, str], gel: HttpCamera) -> None:
    camera[0].cue(Fault("gel", "stall", 1.0))
    with pytest.raises(BenchFault) as stalled:
        gel.read(10, 0.5)
    assert "stalled" in str(stalled.value)
    assert "\n" not in str(stalled.value)
    asked = now()
    reading = gel.read(3, 5.0)
    assert shown_time(reading.values[0]) > asked - 0.08
    assert "opened again" in gel.health().detail
