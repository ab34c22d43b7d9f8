"""The names of programs that start, from bytes written by hand from the manual of the primary interface."""

import os
import queue
import socket
import struct
import time
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur import program_watch
from drivers.ur.program_watch import ProgramWatch, started_programs
from harness.basics.errors import BenchFault


def package(kind: int, body: bytes) -> bytes:
    return struct.pack(">iB", 5 + len(body), kind) + body


def key_message(title: str, text: str, kind: int = 7) -> bytes:
    head = struct.pack(">QbBiiB", 123456, -3, kind, 0, 0, len(title))
    return package(20, head + title.encode() + text.encode())


STATE = package(16, bytes(range(200)) + b"PROGRAM_XXX_STARTEDno_message")
STOPPED = key_message("PROGRAM_XXX_STOPPED", "earlier")
STARTED = key_message("PROGRAM_XXX_STARTED", "intruder")


def pieces(raw: bytes, size: int) -> Iterator[bytes]:
    return (raw[start : start + size] for start in range(0, len(raw), size))


@given(st.lists(st.sampled_from([STATE, STOPPED, STARTED]), max_size=6), st.integers(1, 300))
def test_each_start_is_named_once_however_the_bytes_are_cut(packages: list[bytes], size: int) -> None:
    named = list(started_programs(pieces(b"".join(packages), size)))
    assert named == ["intruder"] * packages.count(STARTED)


@pytest.mark.parametrize(
    ("text", "name"),
    [("", ""), ("a\nb\x1b[2J", "a?b?[2J"), ("n" * 300, "n" * 80), ("prüfung", "prüfung")],
)
def test_a_name_is_fit_to_be_printed(text: str, name: str) -> None:
    assert list(started_programs(iter([key_message("PROGRAM_XXX_STARTED", text)]))) == [name]


@pytest.mark.parametrize("body", [b"", b"\x00" * 5, b"\x00" * 19])
def test_a_short_message_is_no_start(body: bytes) -> None:
    assert list(started_programs(iter([package(20, body), STARTED]))) == ["intruder"]


@pytest.mark.parametrize("size", [-1, 0, 4, 1 << 24])
def test_a_package_of_impossible_size_is_a_fault(size: int) -> None:
    with pytest.raises(BenchFault, match="bytes"):
        list(started_programs(iter([struct.pack(">i", size) + b"more"])))


@pytest.fixture
def controller() -> Iterator[socket.socket]:
    """The listening primary port of a controller."""
    address = f"127.89.{os.getpid() // 250 % 250}.{1 + os.getpid() % 250}"
    with socket.create_server((address, program_watch.PORT)) as port:
        yield port


def test_a_foreign_program_is_stopped_by_the_watch_itself_whatever_else_hangs(
    controller: socket.socket,
) -> None:
    stops: queue.SimpleQueue[str] = queue.SimpleQueue()
    watch = ProgramWatch(controller.getsockname()[0], lambda: stops.put("stop"))
    link, _ = controller.accept()
    with link:
        watch.expect()
        watch.start()
        link.sendall(key_message("PROGRAM_XXX_STARTED", "rtde_control") + STARTED)
        assert stops.get(timeout=60.0) == "stop"
        assert watch.foreign == "'intruder'"
        assert not watch.awaits
        link.sendall(key_message("PROGRAM_XXX_STARTED", "rtde_control"))
        assert stops.get(timeout=60.0) == "stop", "a second one of the driver's name is somebody else's"
        assert watch.foreign == "'intruder'"
        assert stops.empty()
    while not watch.failure:
        time.sleep(0.001)
    assert "port 30011" in watch.failure


def test_a_controller_without_messages_is_refused(controller: socket.socket) -> None:
    address = controller.getsockname()[0]
    controller.close()
    with pytest.raises(BenchFault, match="port 30011"):
        ProgramWatch(address, lambda: None)
