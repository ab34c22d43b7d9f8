"""A pytest plugin that limits the CPU time of a test instead of its duration.

A busy computer makes a test take longer, and must not make it fail. A test that waits for ever uses no CPU:
pytest-timeout ends it after ``timeout`` seconds.

A thread reads the CPU clock now and then. A CPU timer of the kernel would do the same, but while one runs
Linux counts the process's CPU time in ticks of 4 to 10 ms, and tests read that clock too.
"""

import contextlib
import signal
import threading
import time
from collections.abc import Generator, Iterator
from types import FrameType
from typing import Never

import pytest

_PERIOD = 0.2
"""Seconds between two looks at the CPU clock."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the limit."""
    parser.addini("cpu_timeout", "most CPU seconds that each phase of a test may use", default="300")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    """Limit the fixtures."""
    with _limited(item):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None]:
    """Limit the test."""
    with _limited(item):
        return (yield)


@contextlib.contextmanager
def _limited(item: pytest.Item) -> Iterator[None]:
    seconds = float(item.config.getini("cpu_timeout"))
    main, end, ended = threading.main_thread().ident, time.process_time() + seconds, threading.Event()

    def stop(_signal: int, _frame: FrameType | None) -> Never:
        pytest.fail(f"used more than {seconds:g} s of CPU (cpu_timeout in pyproject.toml)")

    def watch() -> None:
        while not ended.wait(_PERIOD):
            if time.process_time() > end and main is not None:
                signal.pthread_kill(main, signal.SIGUSR2)
                return

    before = signal.signal(signal.SIGUSR2, stop)
    watcher = threading.Thread(target=watch, name="cpu limit", daemon=True)
    watcher.start()
    try:
        yield
    finally:
        ended.set()
        watcher.join()
        signal.signal(signal.SIGUSR2, before)
