"""The GelSight driver against a stream on a socket: the driver used at the bench, unchanged."""

import socket
import struct
import threading
import time
import tracemalloc
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from drivers.camera.http_camera import HttpCamera, gelsight, scene_camera
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.bench.device import Channel
from harness.bench.sensor import GELSIGHT_R15
from harness.picture.image_file import decode_jpeg, read_image
from mocks.camera.gelsight_stream import MjpegServer, encode
from mocks.faults import Fault

SMALL = replace(GELSIGHT_R15, rows=12, columns=16)


class Patch:
    """A view of one colour that a test may change."""

    def __init__(self) -> None:
        self.colour = (10, 120, 240)

    def state(self) -> tuple[int, int, int]:
        return self.colour

    def picture(self) -> ByteArray:
        return np.broadcast_to(np.array(self.colour, np.uint8), (12, 16, 3)).copy()

    def sent(self) -> None:
        pass


@dataclass
class Bench:
    view: Patch
    server: MjpegServer

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server.port}/?action=stream"


@pytest.fixture
def bench() -> Iterator[Bench]:
    view = Patch()
    server = MjpegServer("127.0.0.1", 0, view, 50.0)
    stop = threading.Event()
    thread = threading.Thread(target=server.serve, args=(stop.is_set,))
    thread.start()
    yield Bench(view, server)
    stop.set()
    thread.join()


@pytest.fixture
def gel(bench: Bench) -> Iterator[HttpCamera]:
    gel = gelsight(bench.url, SMALL)
    gel.open()
    yield gel
    gel.close()


def test_frames_are_rgb_with_the_bytes_they_came_as(bench: Bench, gel: HttpCamera) -> None:
    reading = gel.read(3, 2.0)
    assert reading.channel.name == "gel.image"
    assert reading.values.shape == (3, 12, 16, 3)
    assert np.abs(reading.values.astype(int) - np.array(bench.view.colour)).max() <= 2
    assert reading.encoded == (encode(bench.view.picture()),) * 3


def test_only_frames_that_arrive_after_the_call_are_read(gel: HttpCamera) -> None:
    asked = now()
    reading = gel.read(4, 2.0)
    assert np.all(reading.times > asked)
    assert np.all(np.diff(reading.times) > 0.0)


def test_a_slow_consumer_still_gets_the_newest_frame(bench: Bench, gel: HttpCamera) -> None:
    gel.read(20, 2.0)  # twenty frames have piled up behind the capture in the meantime
    bench.view.colour = (200, 30, 60)
    gel.read(2, 2.0)  # a frame already on its way may be the old one; the one after it is not
    assert np.abs(gel.read(1, 2.0).values[0, 0, 0].astype(int) - [200, 30, 60]).max() <= 2


def test_the_rate_is_measured(gel: HttpCamera) -> None:
    gel.read(50, 3.0)
    health = gel.health()
    assert health.rate == pytest.approx(50.0, rel=0.2)
    assert health.latency is None
    assert "GelSight R1.5" in health.identity


def test_opening_and_closing_twice_does_nothing_more(bench: Bench, gel: HttpCamera) -> None:
    gel.open()
    gel.read(1, 2.0)
    gel.close()
    gel.close()
    with pytest.raises(BenchFault, match=r"gel .*opened"):
        gel.read(1, 1.0)
    gel.open()
    gel.read(1, 2.0)


def test_a_wrong_port_is_one_sentence_naming_the_address() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    gel = gelsight(f"http://127.0.0.1:{port}/?action=stream", SMALL)
    with pytest.raises(BenchFault, match=f"gel: .*http://127.0.0.1:{port}/") as refused:
        gel.open()
    assert "\n" not in str(refused.value)
    gel.close()


def test_pictures_of_another_size_are_refused(bench: Bench) -> None:
    gel = gelsight(bench.url, GELSIGHT_R15)
    with pytest.raises(BenchFault, match=r"16 x 12 pixels.*160 x 120"):
        gel.open()
    assert "gel" not in [thread.name for thread in threading.enumerate()]


def test_a_stall_is_a_fault_and_then_heals(bench: Bench, gel: HttpCamera) -> None:
    gel.read(10, 2.0)
    bench.server.fault.set(Fault("gel", "stall", 0.8))
    with pytest.raises(BenchFault, match=r"[012] of 3 frames.*0\.3 s.*http"):
        gel.read(3, 0.3)
    assert gel.read(5, 3.0).values.shape == (5, 12, 16, 3)
    assert "opened again" in gel.health().detail
    assert gel.health().drops >= 20


def test_half_a_picture_is_never_read(bench: Bench, gel: HttpCamera) -> None:
    bench.server.fault.set(Fault("gel", "truncate", 0.3))
    reading = gel.read(10, 3.0)
    assert np.abs(reading.values.astype(int) - np.array(bench.view.colour)).max() <= 2
    assert gel.health().drops >= 10


def test_a_dropped_connection_is_made_again(bench: Bench, gel: HttpCamera) -> None:
    bench.server.fault.set(Fault("gel", "drop", 0.3))
    gel.read(20, 3.0)
    assert "opened again" in gel.health().detail


def test_a_frozen_stream_is_named_and_heals(bench: Bench, gel: HttpCamera) -> None:
    """A moment of one picture is no fault; three seconds of it are."""
    bench.server.fault.set(Fault("gel", "freeze"))
    bench.view.colour = (0, 0, 0)
    gel.read(2, 2.0)
    assert len(set(gel.read(5, 2.0).encoded)) == 1
    assert gel.health().failure == ""
    time.sleep(3.0)
    assert "frozen" in gel.health().failure
    with pytest.raises(BenchFault, match=r"gel .*\d+ frames.*[23]\.\d s"):
        gel.read(1, 2.0)
    bench.server.fault.set(Fault("gel", "none"))
    time.sleep(0.2)
    assert gel.read(1, 2.0).values[0, 0, 0, 2] < 10
    assert gel.health().failure == ""


def test_a_frozen_stream_does_not_open(bench: Bench) -> None:
    with gelsight_open(bench):
        bench.server.fault.set(Fault("gel", "freeze"))
    camera = scene_camera(bench.url, rows=12, columns=16)
    with pytest.raises(BenchFault, match=r"camera .*\d+ frames"):
        camera.open()


@contextmanager
def gelsight_open(bench: Bench) -> Iterator[HttpCamera]:
    camera = gelsight(bench.url, SMALL)
    camera.open()
    try:
        yield camera
    finally:
        camera.close()


def test_frames_with_other_heads_and_one_scan_are_one_picture() -> None:
    camera, whole = stream(), lit()
    for k in range(60):
        stamp = f"{k:08d}".encode()
        camera._keep(0.05 * k, whole[:2] + b"\xff\xfe\x00\x0a" + stamp + whole[2:])
    assert "frozen" in camera.failure


def test_pictures_of_a_grey_camera_are_refused_of_a_gel_and_named_of_a_scene() -> None:
    """One channel, or three equal ones."""
    grey = np.linspace(20, 220, 120 * 160).reshape(120, 160).astype(np.uint8)
    done, single = cv2.imencode(".jpg", grey)
    assert done
    for jpeg in (single.tobytes(), encode(np.repeat(grey[..., None], 3, axis=2))):
        scene = stream()
        assert scene._decode(jpeg) is not None
        assert "colour" in scene.health().detail
        gel = HttpCamera("gel", "http://127.0.0.1:1", scene.channel, "", colour=True)
        with pytest.raises(BenchFault, match=r"gel: .*colour"):
            gel._decode(jpeg)
        gel._decode(lit())


@pytest.mark.parametrize(
    "gaps",
    [
        np.where(np.arange(400) % 200 < 100, 0.04, 0.08),
        np.where(np.arange(400) % 3 == 0, 0.08, 0.04),
        np.linspace(0.03, 0.12, 400),
        np.random.default_rng(5).uniform(0.03, 0.1, 400),
    ],
)
def test_a_rate_that_varies_drops_no_frames(gaps: FloatArray) -> None:
    """Exposure that follows the light: in steps, alternating, slowly, at random. At most two steps count."""
    camera = stream()
    frames_at(camera, np.cumsum(gaps))
    assert camera.drops <= 2


def test_a_count_that_cannot_be_kept_is_a_programming_error(gel: HttpCamera) -> None:
    for count in (0, 65):
        with pytest.raises(ValueError, match=f"{count} frames"):
            gel.read(count, 1.0)


def test_the_scene_camera_reads_the_same_way(bench: Bench) -> None:
    camera = scene_camera(bench.url, rows=12, columns=16)
    camera.open()
    reading = camera.read(2, 2.0)
    camera.close()
    assert reading.channel.name == "camera.image"
    assert reading.values.shape == (2, 12, 16, 3)


def stream() -> HttpCamera:
    """A stream that no thread fills."""
    channel = Channel("gel.image", "count", (120, 160, 3), "uint8")
    return HttpCamera("the camera", "http://127.0.0.1:1", channel, "")


def frames_at(camera: HttpCamera, times: Iterable[float], jpeg: bytes = b"\xff\xd8\xff\xd9") -> None:
    for at in times:
        camera._keep(at, jpeg)


def lit(rows: int = 120, columns: int = 160) -> bytes:
    y, x = np.mgrid[:rows, :columns]
    levels = 128.0 + 60.0 * np.sin(x / 17.0)[..., None] * [1.0, 0.5, 0.2] + 40.0 * np.cos(y / 11.0)[..., None]
    noise = np.random.default_rng(0).normal(0.0, 2.0, (rows, columns, 3))
    return encode(np.clip(levels + noise, 0.0, 255.0).astype(np.uint8))


def test_a_frame_that_lost_a_packet_is_no_frame() -> None:
    camera, whole, random = stream(), lit(), np.random.default_rng(1)
    assert camera._decode(whole) is not None
    for start in random.integers(700, len(whole) - 1100, 50):
        assert camera._decode(whole[:start] + whole[start + 1024 :]) is None
    assert camera.drops == 50


def test_what_follows_the_end_of_an_image_is_left_out() -> None:
    camera, whole = stream(), lit()
    camera._keep(1.0, whole + bytes(500))
    assert [frame.jpeg for frame in camera._frames] == [whole]
    assert camera.drops == 0


def test_frames_that_come_in_groups_are_not_missed() -> None:
    camera, random = stream(), np.random.default_rng(2)
    groups = [0.4 * k + np.sort(random.uniform(0.0, 2e-3, 10)) for k in range(20)]
    frames_at(camera, np.concatenate(groups))
    assert camera.drops == 0


@pytest.mark.parametrize("jitter", [0.0, 2e-3, 5e-3])
def test_frames_that_a_steady_stream_loses_are_counted(jitter: float) -> None:
    camera, random = stream(), np.random.default_rng(3)
    lost = set(random.choice(np.arange(40, 200), 20, replace=False))
    times = 0.04 * np.arange(201) + random.uniform(-jitter, jitter, 201)
    frames_at(camera, [at for k, at in enumerate(times) if k not in lost])
    assert abs(camera.drops - 20) <= 1


def test_the_rate_is_that_of_the_connection_there_is() -> None:
    camera = stream()
    frames_at(camera, 0.04 * np.arange(20))
    camera._opened = 5.0
    frames_at(camera, 5.02 + 0.04 * np.arange(20))
    assert camera.rate == pytest.approx(25.0)


class Connections:
    """Captures at 25 frames a second on a clock of their own: each sends some frames and is then dead."""

    def __init__(self, *frames: int) -> None:
        self.clock, self._left, self._next = 0.0, 0, list(frames)
        self.camera = stream()

    def now(self) -> float:
        return self.clock

    def connect(self, _url: str = "") -> "Connections":
        self.clock += 10.0
        self._left = self._next.pop(0)
        return self

    def read(self) -> tuple[bool, ByteArray]:
        self.clock += 0.04
        self._left -= 1
        if self._left == 0 and not self._next:
            self.camera._closing.set()
        return self._left >= 0, np.frombuffer(b"\xff\xd8\xff\xd9", np.uint8)

    def release(self) -> None:
        pass


def test_the_time_without_a_connection_is_no_part_of_the_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    link = Connections(6, 3)
    monkeypatch.setattr("drivers.camera.http_camera.now", link.now)
    monkeypatch.setattr("drivers.camera.http_camera._capture", link.connect)
    link.camera._drain(link.connect())
    assert len(link.camera._frames) == 9
    assert link.camera.rate == pytest.approx(25.0)


@pytest.mark.parametrize("size", [30_000, 60_000])
def test_a_head_that_states_a_vast_picture_takes_no_memory(size: int) -> None:
    data = bytearray(lit())
    at = data.index(b"\xff\xc0")
    data[at + 5 : at + 9] = struct.pack(">HH", size, size)
    tracemalloc.start()
    with pytest.raises(BenchFault, match=f"{size} x {size} pixels.*160 x 120"):
        stream()._decode(bytes(data))
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_no_camera_turns_a_stream_that_it_does_not_turn_in_a_file(tmp_path: Path) -> None:
    """EXIF's orientation 6: the picture lies on its side."""
    tags = struct.pack("<2sHIHHHIHHI", b"II", 42, 8, 1, 0x0112, 3, 1, 6, 0, 0)
    exif = b"\xff\xe1" + struct.pack(">H", 8 + len(tags)) + b"Exif\0\0" + tags
    turned = lit()[:2] + exif + lit()[2:]
    (tmp_path / "turned.jpg").write_bytes(turned)
    of_stream = stream()._decode(turned)
    assert of_stream is not None
    assert np.array_equal(of_stream, read_image(tmp_path / "turned.jpg"))
    assert np.array_equal(of_stream, decode_jpeg(lit()))
