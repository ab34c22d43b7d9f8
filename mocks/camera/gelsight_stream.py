"""A motion-JPEG server that answers as mjpg-streamer's ``output_http`` does.

``/?action=stream`` is an endless multipart answer with the boundary ``boundarydonotcross``,
``/?action=snapshot`` one picture (mjpg-streamer, plugins/output_http/httpd.c). A client
slower than the camera is sent the newest frame, never a queue of old ones.
"""

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable, Hashable
from typing import Protocol

import cv2
import numpy as np

from harness.basics.arrays import ByteArray
from harness.basics.clock import now
from mocks.faults import ActiveFault
from mocks.loopback import require_own_address

BOUNDARY = b"boundarydonotcross"
_HEAD = (
    b"HTTP/1.0 200 OK\r\nAccess-Control-Allow-Origin: *\r\nConnection: close\r\nServer: MJPG-Streamer/0.2\r\n"
    b"Cache-Control: no-store, no-cache, must-revalidate, pre-check=0, post-check=0, max-age=0\r\n"
    b"Pragma: no-cache\r\nExpires: Mon, 3 Jan 2000 12:34:56 GMT\r\n"
)
_NOT_FOUND = b"HTTP/1.0 404 Not Found\r\nConnection: close\r\nServer: MJPG-Streamer/0.2\r\n\r\n"
_REQUEST_TIMEOUT = 5.0

_NOISE_PERIOD = 6
"""Frames of one picture, of which the last has noise: no real sensor sends one picture for ever, and a driver
reports a stream that does as frozen."""

_NOISE_SIZE = 8
"""Pixels: side of the corner that the noise is in."""


class StreamedView(Protocol):
    """What a camera sees."""

    def state(self) -> Hashable:
        """All that decides the picture; equal states have equal pictures."""

    def picture(self) -> ByteArray:
        """``(rows, columns, 3)`` uint8, RGB, of the newest ``state()``."""

    def sent(self) -> None:
        """A frame of the newest ``state()`` has left for every client."""


def saturated(image: ByteArray) -> ByteArray:
    """An overexposed ``(rows, columns, 3)`` picture: four times the light, clipped by the sensor."""
    bright: ByteArray = np.minimum(image.astype(np.uint16) * 4, 255).astype(np.uint8)
    return bright


def encode(image: ByteArray) -> bytes:
    """JPEG of an ``(rows, columns, 3)`` RGB picture, as the sensor's computer sends it.

    Quality 100, and colour at full resolution: the real stream is larger than the picture it
    is reduced to, so that reduction leaves no trace of the halved colour.
    """
    quality = [cv2.IMWRITE_JPEG_QUALITY, 100, cv2.IMWRITE_JPEG_SAMPLING_FACTOR]
    done, jpeg = cv2.imencode(".jpg", image[..., ::-1], [*quality, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444])
    if not done:
        raise RuntimeError(f"OpenCV could not encode a picture of shape {image.shape}")
    return jpeg.tobytes()


class MjpegServer:
    """Sends ``view`` at a fixed rate to whoever asks.

    Args:
        host: loopback address.
        port: 0 for any that is free.
        view: what to show.
        rate: frames a second.

    Raises:
        WrongUse: another computer could reach ``host``.
    """

    def __init__(self, host: str, port: int, view: StreamedView, rate: float = 25.0) -> None:
        self._listener = socket.create_server((require_own_address(host), port))
        self.port: int = self._listener.getsockname()[1]
        self.fault = ActiveFault()
        self._view = view
        self._period = 1.0 / rate
        self._frame = b""
        self._number = 0
        self._changed = threading.Condition()
        self._state: Hashable = object()
        self._encoded = b""
        self._picture: ByteArray = np.zeros((0, 0, 3), np.uint8)
        self._repeated = 0
        self._clean = b""
        self._noisy = b""
        self._stopped = False
        self._clients: set[socket.socket] = set()

    def serve(self, should_stop: Callable[[], bool]) -> None:
        """Send frames until ``should_stop()``, then close every connection."""
        threading.Thread(target=self._accept, daemon=True).start()
        due = now()
        try:
            while not should_stop():
                self._publish(self.fault.kind)
                due = max(due + self._period, now() - self._period)
                time.sleep(max(0.0, due - now()))
        finally:
            self._stopped = True
            self._listener.close()
            self._hang_up()

    def _publish(self, fault: str) -> None:
        """Put the frame of this period in place of the last one."""
        if fault == "drop":
            self._hang_up()
        if fault in ("drop", "stall"):
            return
        if fault != "freeze" or not self._encoded:
            self._render()
        frame = self._encoded
        if fault == "saturate":
            frame = encode(saturated(self._view.picture()))
        if fault == "truncate":
            frame = frame[: len(frame) // 2]
        with self._changed:
            self._frame = frame
            self._number += 1
            self._changed.notify_all()
        self._view.sent()

    def _render(self) -> None:
        state = self._view.state()
        if state != self._state:
            picture = self._view.picture()
            self._state = state
            if not np.array_equal(picture, self._picture):
                self._picture, self._clean, self._noisy = picture, encode(picture), b""
                self._repeated = 0
        self._repeated += 1
        if self._repeated % _NOISE_PERIOD:
            self._encoded = self._clean
            return
        if not self._noisy:
            picture = self._picture.copy()
            picture[:_NOISE_SIZE, :_NOISE_SIZE] ^= 1
            self._noisy = encode(picture)
        self._encoded = self._noisy

    def _hang_up(self) -> None:
        """Reset every connection: a zero linger sends RST in place of FIN."""
        for client in list(self._clients):
            with contextlib.suppress(OSError):
                client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                client.shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        while not self._stopped:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if self.fault.kind == "drop":
                client.close()
                continue
            threading.Thread(target=self._answer, args=(client,), daemon=True).start()

    def _answer(self, client: socket.socket) -> None:
        self._clients.add(client)
        with contextlib.suppress(OSError), client:
            client.settimeout(_REQUEST_TIMEOUT)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            received = b""
            while b"\r\n\r\n" not in received and len(received) < 8192:
                more = client.recv(4096)
                if not more:
                    break
                received += more
            request = received.split(b"\r\n", 1)[0].decode("ascii", "replace")
            if "action=stream" in request:
                self._stream(client)
            elif "action=snapshot" in request:
                frame, _ = self._next(self._number)
                client.sendall(_HEAD + b"Content-type: image/jpeg\r\n\r\n" + frame)
            else:
                client.sendall(_NOT_FOUND)
        self._clients.discard(client)

    def _stream(self, client: socket.socket) -> None:
        client.sendall(_HEAD + b"Content-Type: multipart/x-mixed-replace;boundary=" + BOUNDARY)
        client.sendall(b"\r\n\r\n--" + BOUNDARY + b"\r\n")
        number = self._number  # a new client waits for a new frame, as mjpg-streamer's do
        while not self._stopped:
            frame, number = self._next(number)
            head = b"Content-Type: image/jpeg\r\nContent-Length: %d\r\nX-Timestamp: %.6f\r\n\r\n"
            client.sendall(head % (len(frame), time.time()) + frame + b"\r\n--" + BOUNDARY + b"\r\n")

    def _next(self, last: int) -> tuple[bytes, int]:
        with self._changed:
            while self._number <= last and not self._stopped:
                self._changed.wait(1.0)
            return self._frame, self._number
