"""A pytest plugin that limits the CPU time of a test instead of its duration.

A busy computer makes a test take longer, and must not make it fail. A test that waits for ever uses no CPU:
pytest-timeout ends it after ``timeout`` seconds.
"""

import contextlib
import signal
from collections.abc import Generator, Iterator
from types import FrameType
from typing import Never

import pytest


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

    def stop(_signal: int, _frame: FrameType | None) -> Never:
        pytest.fail(f"used more than {seconds:g} s of CPU (cpu_timeout in pyproject.toml)")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
