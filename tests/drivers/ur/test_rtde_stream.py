"""The state stream, against bytes written by hand from the RTDE guide."""

import contextlib
import itertools
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from drivers.ur import pipe, stream
from drivers.ur.stream import RtdeStream
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault

TYPES = "DOUBLE,VECTOR6D,VECTOR6D,VECTOR6D,VECTOR6D,UINT32,UINT32,UINT32,INT32,UINT64"
ADDRESSES = (f"127.88.{n // 250}.{1 + n % 250}" for n in itertools.count())
Conversation = Callable[[socket.socket], None]


def package(kind: str, payload: bytes) -> bytes:
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


def sample(number: int, **changed: float) -> bytes:
    values = [100.0 + number, *(float(i) for i in range(24))]
    for place, value in changed.items():
        values[int(place.removeprefix("at"))] = value
    return package("U", struct.pack(">B25dIIIiQ", 1, *values, 5, 3, 2, 7, 1 << 17))


def hear(link: socket.socket) -> bytes:
    size, kind = struct.unpack(">HB", link.recv(3, socket.MSG_WAITALL))
    return bytes([kind]) + (link.recv(size - 3, socket.MSG_WAITALL) if size > 3 else b"")


def agree(link: socket.socket, types: str = TYPES, version: bytes = b"\x01", start: bytes = b"\x01") -> None:
    assert hear(link) == b"V\x00\x02"
    link.sendall(package("V", version))
    heard = hear(link)
    assert heard[:9] == b"O" + struct.pack(">d", 500.0)
    assert heard[9:].decode().split(",")[:2] == ["timestamp", "actual_q"]
    link.sendall(package("O", b"\x01" + types.encode()))
    assert hear(link) == b"S"
    link.sendall(package("M", b"\x02hi\x00\x02") + package("S", start))


@pytest.fixture
def serve() -> Iterator[Callable[[Conversation], str]]:
    """Start a controller that holds one conversation; its address."""
    threads: list[threading.Thread] = []
    ports: list[socket.socket] = []

    def start(conversation: Conversation) -> str:
        address = next(ADDRESSES)
        port = socket.create_server((address, stream.PORT))

        def run() -> None:
            link, _ = port.accept()
            with link:
                conversation(link)

        thread = threading.Thread(target=run)
        thread.start()
        threads.append(thread)
        ports.append(port)
        return address

    yield start
    for thread in threads:
        thread.join(timeout=60.0)
    for port in ports:
        port.close()


def take(stream: RtdeStream, count: int) -> list[FloatArray]:
    packets = (packet for packet in stream.packets() if packet is not None)
    return list(itertools.islice(packets, count))


@pytest.mark.parametrize("piece", [1, 7, 226, 5000])
def test_every_packet_arrives_in_order_however_the_bytes_are_cut(
    serve: Callable[[Conversation], str], piece: int
) -> None:
    raw = b"".join(sample(n) if n % 3 else package("M", b"text") + sample(n) for n in range(20))

    def conversation(link: socket.socket) -> None:
        agree(link)
        for start in range(0, len(raw), piece):
            link.sendall(raw[start : start + piece])

    stream = RtdeStream(serve(conversation), 500.0)
    packets = np.array(take(stream, 20))
    stream.close()
    assert packets[:, pipe.FIELDS["controller_time"]][:, 0].tolist() == [100.0 + n for n in range(20)]
    assert packets[7, pipe.FIELDS["joints"]].tolist() == [0, 1, 2, 3, 4, 5]
    assert packets[7, pipe.FIELDS["wrench"]].tolist() == [18, 19, 20, 21, 22, 23]
    named = [packets[7, pipe.FIELDS[name]][0] for name in ("safety_bits", "status_bits", "runtime_state")]
    assert named == [5, 3, 2]
    assert packets[7, pipe.FIELDS["robot_mode"]][0] == 7
    assert packets[7, pipe.FIELDS["output_bits"]][0] == 1 << 17
    assert np.all(np.diff(packets[:, 0]) >= 0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize(
    ("place", "name"),
    [
        (0, "timestamp"),
        (3, "actual_q"),
        (12, "actual_qd"),
        (13, "actual_TCP_pose"),
        (19, "actual_TCP_force"),
        (24, "actual_TCP_force"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_where_it_enters(
    serve: Callable[[Conversation], str], place: int, name: str, value: float
) -> None:
    def conversation(link: socket.socket) -> None:
        agree(link)
        link.sendall(sample(0) + sample(1, **{f"at{place}": value}) + sample(2))

    stream = RtdeStream(serve(conversation), 500.0)
    packets = stream.packets()
    assert next(packet for packet in packets if packet is not None)[1] == 100.0
    with pytest.raises(BenchFault, match=name):
        next(packets)
    stream.close()


def test_a_closed_connection_names_the_cable(serve: Callable[[Conversation], str]) -> None:
    stream = RtdeStream(serve(agree), 500.0)
    with pytest.raises(BenchFault, match="cable"):
        take(stream, 1)
    stream.close()


def test_silence_is_told_and_not_taken_for_the_end(serve: Callable[[Conversation], str]) -> None:
    go = threading.Event()

    def conversation(link: socket.socket) -> None:
        agree(link)
        go.wait(60.0)
        link.sendall(sample(0))

    stream = RtdeStream(serve(conversation), 500.0)
    packets = stream.packets()
    assert next(packets) is None
    go.set()
    assert next(packet for packet in packets if packet is not None)[1] == 100.0
    stream.close()


@pytest.mark.parametrize(
    ("types", "version", "start", "words"),
    [
        (TYPES.replace("UINT64", "NOT_FOUND"), b"\x01", b"\x01", "actual_digital_output_bits"),
        (TYPES, b"\x00", b"\x01", "RTDE version 2"),
        (TYPES, b"\x01", b"\x00", "stream"),
    ],
)
def test_a_controller_that_cannot_stream_is_refused_with_the_reason(
    serve: Callable[[Conversation], str], types: str, version: bytes, start: bytes, words: str
) -> None:
    def conversation(link: socket.socket) -> None:
        with contextlib.suppress(struct.error, OSError):
            agree(link, types, version, start)

    with pytest.raises(BenchFault, match=words):
        RtdeStream(serve(conversation), 500.0)


@pytest.mark.parametrize("size", [0, 1, 2])
def test_a_package_of_impossible_size_is_a_fault(serve: Callable[[Conversation], str], size: int) -> None:
    def conversation(link: socket.socket) -> None:
        agree(link)
        link.sendall(struct.pack(">HB", size, ord("U")))

    stream = RtdeStream(serve(conversation), 500.0)
    with pytest.raises(BenchFault, match="bytes"):
        take(stream, 1)
    stream.close()
