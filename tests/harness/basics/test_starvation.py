"""A process that was late is named; hardware is named only where this computer was in time."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from harness.basics import starvation
from harness.basics.arrays import ByteArray
from harness.basics.starvation import PERIOD, WakeWatch, name_cause
from mocks.camera.gelsight_stream import MjpegServer

CABLE = "check the camera's power and cable"


class Clock:
    """A clock of its own, on which a sleep takes longer than asked by ``delays``."""

    def __init__(self, *delays: float) -> None:
        self.time = 100.0
        self._delays = list(delays)

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds + self._delays.pop(0)


def watched(*delays: float) -> WakeWatch:
    clock = Clock(*delays)
    watch = WakeWatch(clock.now, clock.sleep)
    for _ in delays:
        watch.wake()
    return watch


def set_busy(monkeypatch: pytest.MonkeyPatch, busy: bool) -> None:
    monkeypatch.setattr(starvation, "is_busy", lambda: busy)


def test_a_late_process_is_named_and_no_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    set_busy(monkeypatch, busy=False)
    said = name_cause(CABLE, 100.0, watched(0.0, 0.43, 0.001))
    assert " ms " in said
    assert "430 ms" in said
    assert "load" in said
    assert "cable" not in said


def test_a_process_that_was_in_time_names_the_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    set_busy(monkeypatch, busy=False)
    assert name_cause(CABLE, 100.0, watched(0.0, 0.03, 0.05)) == CABLE


def test_a_delay_before_the_silence_is_no_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    set_busy(monkeypatch, busy=False)
    watch = watched(0.43, 0.0, 0.0)
    assert watch.delay_since(0.0) == pytest.approx(0.43, abs=1e-9)
    assert name_cause(CABLE, 100.0 + PERIOD + 0.44, watch) == CABLE


def test_a_busy_computer_is_named_before_the_hardware(monkeypatch: pytest.MonkeyPatch) -> None:
    set_busy(monkeypatch, busy=True)
    said = name_cause(CABLE, 100.0, watched(0.0))
    assert said.index("this computer is busy") < said.index("on an idle computer, check the camera's power")


@pytest.mark.parametrize(("load", "busy"), [(0.5, False), (50000.0, True)])
def test_the_load_tells_a_busy_computer(load: float, busy: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.getloadavg", lambda: (load, load, load))
    monkeypatch.setattr(starvation, "BUSY_PRESSURE", 1e9)
    assert starvation.is_busy() == busy


READER = """
import sys
from drivers.camera.http_camera import scene_camera

camera = scene_camera(sys.argv[1], 12, 16)
camera.open()
print("open", flush=True)
while True:
    camera.read(3, 0.4)
    print("read", flush=True)
"""


class Lit:
    """A picture of one colour."""

    def state(self) -> int:
        return 0

    def picture(self) -> ByteArray:
        return np.full((12, 16, 3), (200, 90, 30), np.uint8)

    def sent(self) -> None:
        """Nobody waits for it."""


@pytest.mark.skipif(sys.platform == "win32", reason="processes are stopped by signals")
def test_a_reader_that_was_stopped_for_longer_than_its_timeout_goes_on_reading() -> None:
    """Stopped for 1 s, with a timeout of 0.4 s: the wait is extended, and no camera is blamed."""
    server, stop = MjpegServer("127.0.0.1", 0, Lit(), 50.0), threading.Event()
    thread = threading.Thread(target=server.serve, args=(stop.is_set,))
    thread.start()
    url = f"http://127.0.0.1:{server.port}/?action=stream"
    reader = subprocess.Popen([sys.executable, "-c", READER, url], stdout=subprocess.PIPE, text=True)
    try:
        assert reader.stdout is not None
        assert reader.stdout.readline() == "open\n"
        for _ in range(3):
            assert reader.stdout.readline() == "read\n"
            reader.send_signal(signal.SIGSTOP)
            time.sleep(1.0)
            reader.send_signal(signal.SIGCONT)
        for _ in range(10):
            assert reader.stdout.readline() == "read\n"
    finally:
        reader.kill()
        reader.communicate()
        stop.set()
        thread.join()
