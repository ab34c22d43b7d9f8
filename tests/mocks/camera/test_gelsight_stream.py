"""The motion-JPEG server, asked by a plain socket and by the library that drivers use."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import cv2
import numpy as np
import pytest

from harness.basics.arrays import ByteArray
from harness.basics.errors import WrongUse
from mocks.camera.gelsight_stream import BOUNDARY, MjpegServer, encode, saturated
from mocks.faults import CAMERA_FAULTS, Fault, parse
from mocks.ur.serve import KINDS as ARM_FAULTS


class Counter:
    """A view whose picture says how often it was asked for."""

    def __init__(self) -> None:
        self.value = 0
        self.pictures = 0
        self.sent_count = 0

    def state(self) -> int:
        return self.value

    def picture(self) -> ByteArray:
        self.pictures += 1
        return np.full((12, 16, 3), self.value, np.uint8)

    def sent(self) -> None:
        self.sent_count += 1


@contextmanager
def serving(view: Counter, rate: float = 100.0) -> Iterator[MjpegServer]:
    server = MjpegServer("127.0.0.1", 0, view, rate)
    stop = threading.Event()
    thread = threading.Thread(target=server.serve, args=(stop.is_set,))
    thread.start()
    try:
        yield server
    finally:
        stop.set()
        thread.join()


def ask(server: MjpegServer, path: str, size: int) -> bytes:
    with socket.create_connection(("127.0.0.1", server.port), 2.0) as client:
        client.sendall(f"GET {path} HTTP/1.0\r\n\r\n".encode())
        answer = b""
        while len(answer) < size and (more := client.recv(65536)):
            answer += more
    return answer


def test_a_snapshot_is_one_whole_picture() -> None:
    view = Counter()
    view.value = 77
    with serving(view) as server:
        head, jpeg = ask(server, "/?action=snapshot", 10**6).split(b"\r\n\r\n", 1)
    assert head.startswith(b"HTTP/1.0 200 OK")
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    assert np.all(image == 77)


def test_a_stream_is_parts_of_stated_length() -> None:
    with serving(Counter()) as server:
        answer = ask(server, "/?action=stream", 6000)
    assert b"multipart/x-mixed-replace;boundary=" + BOUNDARY in answer
    parts = answer.split(b"--" + BOUNDARY + b"\r\n")[1:-1]
    assert len(parts) >= 2
    for part in parts:
        head, body = part.split(b"\r\n\r\n", 1)
        length = int(head.split(b"Content-Length: ")[1].split(b"\r\n")[0])
        assert body[:length].endswith(b"\xff\xd9")
        assert body[length:] == b"\r\n"


def test_any_other_path_is_not_found() -> None:
    with serving(Counter()) as server:
        assert ask(server, "/index.html", 10**6).startswith(b"HTTP/1.0 404")


def test_a_picture_is_made_once_while_nothing_changes() -> None:
    view = Counter()
    with serving(view) as server:
        ask(server, "/?action=stream", 6000)
        assert view.pictures == 1
    assert view.sent_count > 1


def test_encoding_keeps_the_picture_to_two_counts() -> None:
    ramp = np.add.outer(np.arange(120), np.arange(160)) % 256
    image = np.stack([ramp, ramp[::-1], 255 - ramp], axis=-1).astype(np.uint8)
    smooth = cv2.GaussianBlur(image, (0, 0), 2.0)
    decoded = cv2.imdecode(np.frombuffer(encode(np.asarray(smooth, np.uint8)), np.uint8), cv2.IMREAD_COLOR)
    assert decoded is not None
    assert np.abs(decoded[..., ::-1].astype(int) - smooth).max() <= 3
    assert np.abs(decoded[..., ::-1].astype(int) - smooth).mean() < 0.7


KINDS = {"gel": CAMERA_FAULTS, "arm": ARM_FAULTS}


def test_a_cue_becomes_a_fault() -> None:
    assert parse({"instrument": "gel", "kind": "stall", "seconds": 2}, KINDS) == Fault("gel", "stall", 2.0)
    assert parse({"instrument": "arm", "kind": "protective_stop"}, KINDS) == Fault("arm", "protective_stop")


@pytest.mark.parametrize(
    "cue",
    [
        {"instrument": "gell", "kind": "stall"},
        {"instrument": "gel", "kind": "stal"},
        {"instrument": "gel", "kind": "protective_stop"},
        {"instrument": "gel", "kind": "stall", "second": 1},
        {"instrument": "gel", "kind": "stall", "seconds": 0},
        {"instrument": "gel", "kind": "stall", "seconds": float("nan")},
        {"instrument": "gel", "kind": "stall", "seconds": True},
        {"kind": "stall"},
    ],
    ids=str,
)
def test_a_mistyped_cue_is_refused(cue: dict[str, object]) -> None:
    with pytest.raises(WrongUse):
        parse(cue, KINDS)


def test_saturation_clips_and_never_wraps() -> None:
    image = np.array([[[0, 63, 64], [100, 200, 255]]], np.uint8)
    assert saturated(image).tolist() == [[[0, 252, 255], [255, 255, 255]]]
