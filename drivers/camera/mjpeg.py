"""Motion JPEG over HTTP: a thread that drains the stream, so that the newest frame is new.

A consumer slower than the stream would otherwise read frames seconds old, since the
library's buffer can be neither shortened nor skipped. The library's own frame times are
computed from a nominal rate, so each frame is stamped here on arrival.
"""

import os
import threading
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.bench.reading import Channel, Reading

OPEN_TIMEOUT = 2.0
"""s until a host that does not answer, or sends no frame, is given up."""

READ_TIMEOUT = 0.5
"""s without a byte after which the stream counts as stalled and is opened again."""

_RETRY_PERIOD = 0.1
_KEPT_FRAMES = 64
_RHYTHM_FRAMES = 8
_RHYTHM_GAIN = 0.1
_END_OF_IMAGE = b"\xff\xd9"


@dataclass(frozen=True)
class Frame:
    """One compressed frame and the bench-clock second at which it had arrived."""

    time: float
    jpeg: bytes


class MjpegStream:
    """A camera that sends motion JPEG over HTTP, as mjpg-streamer does.

    Args:
        name: of the instrument, as messages call it.
        url: for example ``http://127.1.2.3:8080/?action=stream``.
        channel: names the readings; its shape is (rows, columns, 3).
    """

    def __init__(self, name: str, url: str, channel: Channel) -> None:
        self.name = name
        self.url = url
        self.channel = channel
        self._frames: deque[Frame] = deque(maxlen=_KEPT_FRAMES)
        self._arrived = threading.Condition()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._damaged = 0
        self._missed = 0
        self._reopened = 0
        self._due = 0.0
        self._stalled = False
        self._whole = 0.0

    def open(self) -> None:
        """Connect and wait for the first whole frame; does nothing if already open.

        Raises:
            BenchFault: nothing answers, no frame comes, or frames have another size.
        """
        if self._thread is not None:
            return
        capture = _capture(self.url)
        if capture is None:
            raise BenchFault(
                f"{self.name}: no video stream at {self.url}; check that the camera is on, "
                "its cable, and the address and port in the station"
            )
        self._closing.clear()
        self._stalled, self._whole = False, now()
        self._thread = threading.Thread(target=self._drain, args=(capture,), name=self.name, daemon=True)
        self._thread.start()
        try:
            self.read(1, OPEN_TIMEOUT)
        except BenchFault:
            self.close()
            raise

    def close(self) -> None:
        """Release the stream; does nothing if already closed."""
        if self._thread is not None:
            self._closing.set()
            self._thread.join()
            self._thread = None
            self._frames.clear()

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames that arrive from now on, decoded to RGB.

        Raises:
            BenchFault: after ``timeout`` s without them, or for frames of another size.
        """
        frames = self._next_frames(count, timeout)
        images = np.stack([self._decode(frame.jpeg) for frame in frames])
        return Reading(
            self.channel, np.array([frame.time for frame in frames]), images, tuple(f.jpeg for f in frames)
        )

    @property
    def rate(self) -> float:
        """Frames a second over the newest frames; zero before two have arrived."""
        times = self._recent_times()
        return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0

    @property
    def drops(self) -> int:
        """Frames lost since opening: damaged on arrival, or missing from the rhythm."""
        return self._damaged + max(0, self._missed)

    @property
    def detail(self) -> str:
        """What happened to the stream since opening, in words."""
        return f"stalled and opened again {self._reopened} times" if self._reopened else ""

    @property
    def failure(self) -> str:
        """Why no frame comes at present, in words; empty while frames come."""
        if not self._stalled:
            return ""
        return (
            f"{self.name} sent no whole frame for {now() - self._whole:.1f} s (limit {READ_TIMEOUT:g} s); "
            f"the stream at {self.url} has stalled: check the camera's power and cable"
        )

    def _recent_times(self) -> list[float]:
        with self._arrived:
            return [frame.time for frame in self._frames]

    def _next_frames(self, count: int, timeout: float) -> list[Frame]:
        if self._thread is None:
            raise BenchFault(f"{self.name} was read before it was opened; open the bench first")
        if not 1 <= count <= _KEPT_FRAMES:
            raise ValueError(f"{count} frames asked for; between 1 and {_KEPT_FRAMES} can be kept")
        asked = now()

        def fresh() -> list[Frame]:
            return [frame for frame in self._frames if frame.time > asked]

        with self._arrived:
            if not self._arrived.wait_for(lambda: len(fresh()) >= count, timeout):
                raise BenchFault(
                    f"{self.name} sent {len(fresh())} of {count} frames in {timeout:g} s; "
                    f"the stream at {self.url} has stalled: check the camera's power and cable"
                )
            return fresh()[:count]

    def _decode(self, jpeg: bytes) -> ByteArray:
        import cv2

        image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise BenchFault(f"{self.name}: {self.url} sends something that is not JPEG; check the address")
        if image.shape != self.channel.shape:
            rows, columns = self.channel.shape[:2]
            raise BenchFault(
                f"{self.name}: {self.url} sends {image.shape[1]} x {image.shape[0]} pixels and the station "
                f"expects {columns} x {rows}; set the stream's size or name the right sensor"
            )
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), np.uint8)

    def _drain(self, capture: Any) -> None:
        while not self._closing.is_set():
            arrived, packet = capture.read()
            if arrived:
                self._keep(Frame(now(), packet.tobytes()))
                continue
            # After one timeout a capture is dead for good, although it calls itself open.
            capture.release()
            self._stalled = True
            self._reopened += 1
            capture = self._reconnect()
            if capture is None:
                return
        capture.release()

    def _reconnect(self) -> Any:
        while not self._closing.wait(_RETRY_PERIOD):
            capture = _capture(self.url)
            if capture is not None:
                return capture
        return None

    def _keep(self, frame: Frame) -> None:
        if _END_OF_IMAGE not in frame.jpeg[-16:]:
            self._damaged += 1
            self._stalled = self._stalled or frame.time - self._whole > READ_TIMEOUT
            return
        self._whole = frame.time
        with self._arrived:
            self._missed += self._missing_before(frame)
            self._frames.append(frame)
            self._stalled = False
            self._arrived.notify_all()

    def _missing_before(self, frame: Frame) -> int:
        """Frames due before this one by the stream's rhythm; negative where late ones catch up."""
        times = [kept.time for kept in self._frames]
        if len(times) < _RHYTHM_FRAMES:
            self._due = frame.time
            return 0
        period = median(later - earlier for earlier, later in pairwise(times))
        late = frame.time - (self._due + period)
        missing = round(late / period) if period > 0.0 else 0
        self._due += (1 + missing) * period + _RHYTHM_GAIN * (late - missing * period)
        return missing


def _capture(url: str) -> Any:
    """An OpenCV capture that hands on the JPEG bytes as they came; None where nothing answers."""
    # FFMPEG would print its own account of a failure that the caller reports in one sentence.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    import cv2

    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    options = {
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC: round(OPEN_TIMEOUT * 1e3),
        cv2.CAP_PROP_READ_TIMEOUT_MSEC: round(READ_TIMEOUT * 1e3),
        cv2.CAP_PROP_FORMAT: -1,
    }
    capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, [value for pair in options.items() for value in pair])
    if not capture.isOpened():
        capture.release()
        return None
    return capture
