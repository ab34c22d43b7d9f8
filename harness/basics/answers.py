"""Standard output for answers alone: what libraries print goes to standard error."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from io import UnsupportedOperation
from typing import TextIO

_streams: list[TextIO] = []
"""Where answers go while standard output is theirs alone; the last one holds."""


def write_answer(line: str) -> None:
    """Write a line to standard output, at once: some programs go on until they are ended."""
    stream = _streams[-1] if _streams else sys.stdout
    stream.write(line + "\n")
    stream.flush()


@contextmanager
def answers_alone() -> Iterator[None]:
    """Within it only ``write_answer`` writes to standard output; not libraries, compiled ones included."""
    with _own_output() as stream, redirect_stdout(sys.stderr):
        _streams.append(stream)
        try:
            yield
        finally:
            _streams.pop()


@contextmanager
def _own_output() -> Iterator[TextIO]:
    """Standard output under another descriptor; compiled libraries write to standard error meanwhile."""
    try:
        own = os.dup(_OUT)
    except OSError:  # the program was started without
        yield sys.stdout
        return
    sys.stdout.flush()
    os.dup2(_ERR, _OUT)
    try:
        with _writing_to(own) as stream:
            yield stream
    finally:
        os.dup2(own, _OUT)
        os.close(own)


@contextmanager
def _writing_to(own: int) -> Iterator[TextIO]:
    """A stream on a copy of the descriptor, where Python's standard output was on it and not replaced."""
    try:
        replaced = sys.stdout.fileno() != _OUT
    except (UnsupportedOperation, ValueError, AttributeError):
        replaced = True
    if replaced:
        yield sys.stdout
        return
    with os.fdopen(os.dup(own), "w", encoding="utf-8") as stream:
        yield stream


_OUT, _ERR = 1, 2
