"""Cameras that stream motion JPEG over HTTP: the GelSight, filmed from behind, and the scene camera.

A thread drains the stream, so that the newest frame is new: a consumer slower than the stream would
otherwise read frames seconds old, since the library's buffer can be neither shortened nor skipped. The
library's own frame times are computed from a nominal rate, so each frame is stamped here on arrival.
"""

import os
import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.starvation import LATE, WATCH, name_cause
from harness.bench.device import Channel, Health, Reading
from harness.bench.instruments.cameras import USB_CAMERA
from harness.bench.sensor import TactileSensor
from harness.picture.image_file import decode_jpeg

OPEN_TIMEOUT = 2.0
"""s until a host that does not answer, or sends no frame, is given up."""

READ_TIMEOUT = 0.5
"""s without a byte after which the stream counts as stalled and is opened again."""

_PATIENCE = 4.0
"""Times a timeout that is waited where this computer was late itself."""

_CHECK_CAMERA = "check the camera's power and cable"
_RETRY_PERIOD = 0.1
_KEPT_FRAMES = 64
_RHYTHM_FRAMES = 8
_SHORTEST = 0.12
"""s of frames that show a rhythm: fewer may be one group."""

_EVEN, _ALIKE = 0.6, 0.25
"""Fraction of the gaps that are within a quarter of their median where a stream has a rhythm."""

_MOST_OF_TIME = 0.25
"""Share of the time that as many usual gaps fill where a stream has a rhythm: the rest may be stalls."""

_VARIABLE = 1.5
"""Times the median gap: where a quarter of the gaps are longer, the rate varies and no frame is due."""

FROZEN_AFTER = 1.5
"""Seconds of one picture after which a stream is frozen: a real sensor's noise changes every picture."""

FROZEN_FRAMES = 5
"""Pictures that are the same, at least."""

_FIRST_CHANGE = 3.0
"""Seconds that opening waits for a second picture, unlike the first."""

_BLACK, _MIN_TONED = 15, 0.01
"""Grey levels from black and from white that have no colour, and the fraction of the other pixels that a
judgement needs."""

_MIN_CONTRAST = 8
"""Grey levels: a picture with less shows nothing whose colour could be judged."""

_END_OF_IMAGE, _START_OF_SCAN = b"\xff\xd9", b"\xff\xda"


@dataclass(frozen=True)
class Frame:
    """One compressed frame and the bench-clock second at which it had arrived."""

    time: float
    jpeg: bytes


class HttpCamera:
    """A camera that sends motion JPEG over HTTP, as mjpg-streamer does; a ``TactileCamera``.

    Args:
        name: of the instrument, as messages call it.
        url: for example ``http://127.1.2.3:8080/?action=stream``.
        channel: names the readings; its shape is (rows, columns, 3).
        identity: make, and serial number as the station states it.
        colour: whether pictures without colour are refused.
    """

    def __init__(self, name: str, url: str, channel: Channel, identity: str, colour: bool = False) -> None:
        self.name = name
        self.url = url
        self.channel = channel
        self._identity = identity
        self._frames: deque[Frame] = deque(maxlen=_KEPT_FRAMES)
        self._arrived = threading.Condition()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._colour = colour
        self._grey = False
        self._damaged = 0
        self._missed = 0
        self._newly_missed: deque[int] = deque(maxlen=_KEPT_FRAMES)
        self._scan = b""
        self._same_since = 0.0
        self._same_frames = 0
        self._same_until = 0.0
        self._changes = 0
        self._reopened = 0
        self._opened = 0.0
        self._stalled = False
        self._whole = 0.0

    def open(self) -> None:
        """Connect and wait for two whole frames that differ; does nothing if already open.

        Raises:
            BenchFault: nothing answers, no frame comes, frames have another size or no colour, or all frames
                are one picture.
        """
        if self._thread is not None:
            return
        WATCH.start()
        capture = _capture(self.url)
        if capture is None:
            raise BenchFault(
                f"{self.name}: no video stream at {self.url}; check that the camera is on, "
                f"its cable, and the address and port in the station; {USB_CAMERA}"
            )
        self._closing.clear()
        self._stalled, self._whole = False, now()
        self._scan, self._same_frames, self._changes = b"", 0, 0
        self._thread = threading.Thread(target=self._drain, args=(capture,), name=self.name, daemon=True)
        self._thread.start()
        try:
            self.read(1, OPEN_TIMEOUT)
            with self._arrived:
                self._arrived.wait_for(lambda: self._changes > 1 or bool(self._frozen), _FIRST_CHANGE)
            self._require_new()
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
            BenchFault: after ``timeout`` s without them, for frames of another size, without colour, or of a
                frozen stream. Frames of which bytes were lost are none.
        """
        if self._thread is None:
            raise BenchFault(f"{self.name} was read before it was opened; open the bench first")
        if not 1 <= count <= _KEPT_FRAMES:
            raise ValueError(f"{count} frames asked for; between 1 and {_KEPT_FRAMES} can be kept")
        after, damaged = now(), self._damaged
        began, until = after, after + timeout
        read: list[tuple[Frame, ByteArray]] = []
        while len(read) < count:
            frames = self._next_frames(count - len(read), after, until)
            read += [(frame, image) for frame in frames if (image := self._decode(frame.jpeg)) is not None]
            if now() >= until and len(read) < count:
                delay = WATCH.delay_since(began)
                if delay >= LATE and now() < began + _PATIENCE * timeout:
                    until = now() + timeout
                    after = frames[-1].time if frames else after
                    continue
                lost = f", {self._damaged - damaged} damaged ones beside" if self._damaged > damaged else ""
                raise BenchFault(
                    f"{self.name} sent {len(read)} of {count} frames in {timeout:g} s{lost}; "
                    f"the stream at {self.url} has stalled: {name_cause(_CHECK_CAMERA, began)}"
                )
            after = frames[-1].time if frames else after
        self._require_new()
        times = np.array([frame.time for frame, _ in read])
        images = np.stack([image for _, image in read])
        return Reading(self.channel, times, images, tuple(frame.jpeg for frame, _ in read))

    def health(self) -> Health:
        """Rate and drops since opening, and a failure at present; how old frames arrive cannot be known."""
        reopened = f"stalled and opened again {self._reopened} times" if self._reopened else ""
        grey = "pictures without colour (red, green and blue are equal)" if self._grey else ""
        return Health(
            self.name,
            f"{self._identity} at {self.url}",
            self.rate,
            self.drops,
            None,
            "; ".join(each for each in (reopened, grey) if each),
            failure=self.failure,
        )

    @property
    def rate(self) -> float:
        """Frames a second over the newest frames of this connection; zero before two have arrived."""
        with self._arrived:
            times = [frame.time for frame in self._frames if frame.time > self._opened]
        return (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0

    @property
    def drops(self) -> int:
        """Frames lost since opening: damaged on arrival, or missing from the rhythm."""
        return self._damaged + max(0, self._missed)

    @property
    def failure(self) -> str:
        """Why no new picture comes at present, in words; empty while pictures come."""
        if not self._stalled:
            return self._frozen
        return (
            f"{self.name} sent no whole frame for {now() - self._whole:.1f} s (limit {READ_TIMEOUT:g} s); "
            f"the stream at {self.url} has stalled: {name_cause(_CHECK_CAMERA, self._whole)}"
        )

    def _require_new(self) -> None:
        if self._frozen:
            raise BenchFault(self._frozen)

    @property
    def _frozen(self) -> str:
        """Why the stream's pictures are not new, in words; empty while they change."""
        lasted = self._same_until - self._same_since
        if self._same_frames < FROZEN_FRAMES or lasted < FROZEN_AFTER:
            return ""
        return (
            f"{self.name} is frozen: {self._same_frames} frames in {lasted:.1f} s are one and the same "
            f"picture; restart the camera or the program that serves {self.url}"
        )

    def _next_frames(self, count: int, after: float, until: float) -> list[Frame]:
        """The first ``count`` frames after ``after`` on the bench clock; fewer where it reaches ``until``."""

        def fresh() -> list[Frame]:
            return [frame for frame in self._frames if frame.time > after]

        with self._arrived:
            self._arrived.wait_for(lambda: len(fresh()) >= count, max(0.0, until - now()))
            return fresh()[:count]

    def _decode(self, jpeg: bytes) -> ByteArray | None:
        """``(rows, columns, 3)`` RGB; None of a frame that lost bytes, which a plain decoder fills up."""
        import simplejpeg

        try:
            # By its head alone: a head that states a larger picture takes no memory.
            rows, columns = simplejpeg.decode_jpeg_header(jpeg)[:2]
        except ValueError as error:
            raise BenchFault(
                f"{self.name}: {self.url} sends something that is not JPEG; check the address"
            ) from error
        if (rows, columns) != self.channel.shape[:2]:
            high, wide = self.channel.shape[:2]
            raise BenchFault(
                f"{self.name}: {self.url} sends {columns} x {rows} pixels and the station expects "
                f"{wide} x {high}; set the stream's size or name the right sensor"
            )
        try:
            simplejpeg.decode_jpeg(jpeg, strict=True)
        except ValueError:
            self._damaged += 1
            return None
        image = decode_jpeg(jpeg)
        self._grey = _is_grey(image)
        if self._grey and self._colour:
            raise BenchFault(
                f"{self.name}: {self.url} sends pictures without colour (red, green and blue are equal), and "
                "this camera is read by its colours; switch the camera to colour"
            )
        return image

    def _drain(self, capture: Any) -> None:
        while not self._closing.is_set():
            arrived, packet = capture.read()
            if arrived:
                self._keep(now(), packet.tobytes())
                continue
            # After one timeout a capture is dead for good, although it calls itself open.
            capture.release()
            self._stalled = True
            self._reopened += 1
            capture = self._reconnect()
            if capture is None:
                return
            self._opened = now()
        capture.release()

    def _reconnect(self) -> Any:
        while not self._closing.wait(_RETRY_PERIOD):
            capture = _capture(self.url)
            if capture is not None:
                return capture
        return None

    def _keep(self, time: float, packet: bytes) -> None:
        end = packet.rfind(_END_OF_IMAGE)
        if end < 0:
            self._damaged += 1
            self._stalled = self._stalled or time - self._whole > READ_TIMEOUT
            return
        # Cameras pad their frames after the end of the image.
        frame = Frame(time, packet[: end + len(_END_OF_IMAGE)])
        self._whole = frame.time
        # Equal scans are equal pictures, whatever the heads around them say (time stamps, comments).
        scan = frame.jpeg[frame.jpeg.rfind(_START_OF_SCAN) :]
        with self._arrived:
            if scan != self._scan:
                self._scan, self._same_since, self._same_frames = scan, time, 0
                self._changes += 1
            self._same_frames += 1
            self._same_until = time
            missing = self._missing_before(frame)
            self._missed += missing
            self._newly_missed.append(missing)
            self._frames.append(frame)
            self._stalled = False
            self._arrived.notify_all()

    def _missing_before(self, frame: Frame) -> int:
        """Frames due before this one by the stream's rhythm; negative where late ones catch up."""
        times = [kept.time for kept in self._frames]
        period = _rhythm(times)
        if period is None and self._stalled and len(times) >= _RHYTHM_FRAMES:
            period = float(np.median(np.diff(times)))  # a stall is a loss, however uneven the stream is
        if period is None:
            if _varies(times):  # what was counted lately was the stream's own change of rate
                self._missed -= sum(self._newly_missed)
                self._newly_missed.clear()
            return 0
        return round((frame.time - times[-1] - period) / period)


def gelsight(
    url: str, sensor: TactileSensor, name: str = "gel", serial: str = "", nominal_rate: float | None = 25.0
) -> HttpCamera:
    """A GelSight R1.5 or any gel camera that streams motion JPEG; reads ``gel.image``.

    Args:
        url: of the stream, for example ``http://gsr15001.local:8080/?action=stream``.
        sensor: its make; frames of another size are refused.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """
    shape = (sensor.rows, sensor.columns, 3)
    channel = Channel("gel.image", "count", shape, "uint8", "gel", nominal_rate)
    return HttpCamera(name, url, channel, f"{sensor.name} {serial}".strip(), colour=True)


def scene_camera(
    url: str,
    rows: int,
    columns: int,
    name: str = "camera",
    serial: str = "",
    nominal_rate: float | None = None,
) -> HttpCamera:
    """A camera that looks at the bench; reads ``camera.image``.

    Args:
        url: of the stream, for example ``http://127.1.2.3:8081/?action=stream``.
        rows: pixels; frames of another size are refused.
        columns: pixels.
        name: of the instrument, as messages call it.
        serial: its serial number, as the station states it.
        nominal_rate: Hz, as the maker states it; the real rate is measured.
    """
    channel = Channel("camera.image", "count", (rows, columns, 3), "uint8", "camera", nominal_rate)
    return HttpCamera(name, url, channel, f"scene camera {serial}".strip())


def _rhythm(times: Sequence[float]) -> float | None:
    """Seconds from frame to frame; None where they come in groups, so that none of them is due."""
    if len(times) < _RHYTHM_FRAMES or times[-1] - times[0] < _SHORTEST:
        return None
    gaps = np.diff(times)
    period = float(np.median(gaps))
    even = float(np.mean(np.abs(gaps - period) <= _ALIKE * period))
    steady = even >= _EVEN and period * len(gaps) >= _MOST_OF_TIME * float(gaps.sum())
    return period if steady and period > 0.0 and not _varies(times) else None


def _varies(times: Sequence[float]) -> bool:
    """Return whether long gaps are as common as in a stream whose frame rate follows the light."""
    if len(times) < _RHYTHM_FRAMES:
        return False
    gaps = np.diff(times)
    return bool(np.quantile(gaps, 0.75) > _VARIABLE * np.median(gaps))


def _is_grey(image: ByteArray) -> bool:
    """Return whether a picture with contrast has no colour at all, as a monochrome camera's.

    Black and white have no colour in any picture and do not count.
    """
    dark, bright = image.min(axis=2), image.max(axis=2)
    toned = image[(dark > _BLACK) & (bright < 255 - _BLACK)]
    if len(toned) < _MIN_TONED * dark.size or int(np.ptp(toned)) < _MIN_CONTRAST:
        return False
    red, green, blue = (toned[:, k].astype(np.int16) for k in range(3))
    return bool(np.abs(red - green).max() <= 1 and np.abs(green - blue).max() <= 1)


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
