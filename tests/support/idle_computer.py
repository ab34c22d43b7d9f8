"""Tests of drivers' messages judge the far end of a cable, whatever else this computer is busy with."""

import pytest

from harness.basics import starvation


@pytest.fixture(autouse=True)
def idle_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process appear in time and its computer idle."""
    monkeypatch.setattr(starvation.WATCH, "delay_since", lambda _: 0.0)
    monkeypatch.setattr(starvation, "is_busy", lambda: False)
