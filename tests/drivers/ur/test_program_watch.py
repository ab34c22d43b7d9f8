"""The names of programs that start, from bytes written by hand from the manual of the primary interface."""

import struct
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur.program_watch import started_programs
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
