"""Why the controller's program does not run: three causes, three sentences."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drivers.ur import link as ur_link
from drivers.ur import pipe
from drivers.ur.link import Link
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, ProtectiveStop

PLAYING, STOPPED, PAUSED = 2, 1, 4
BEGIN = 1000.0
"""s on the bench clock."""


def a_packet(time: float, runtime_state: int, safety_bits: int = 1) -> FloatArray:
    packet = np.zeros(pipe.WIDTH)
    packet[pipe.FIELDS["time"]] = time
    packet[pipe.FIELDS["runtime_state"]] = runtime_state
    packet[pipe.FIELDS["safety_bits"]] = safety_bits
    packet[pipe.FIELDS["robot_mode"]] = 7
    return packet


def a_link(kicks: Sequence[float], packets: Sequence[FloatArray], monkeypatch: pytest.MonkeyPatch) -> Link:
    """One that was kicked at these times, and is asked a second after its last packet, which ended it."""
    link = Link("127.0.0.9", 500.0, patience=0.1)
    link._kicks.clear()
    link._kicks.extend(kicks)
    stream: Any = SimpleNamespace(packets=lambda: iter([*packets, None]))
    link._stream = stream
    assert len(list(link.packets())) == len(packets) + 1
    monkeypatch.setattr(ur_link, "now", lambda: float(packets[-1][0]) + 1.0)
    return link


KICKS = [BEGIN - 0.02 * k for k in range(40, -1, -1)]


@pytest.mark.parametrize(
    ("ended", "state", "words"),
    [
        (0.005, STOPPED, "program stopped, robot running; somebody stopped the program, at the pendant"),
        (0.019, PAUSED, "program paused, robot running; somebody paused the program, at the pendant"),
        (0.250, STOPPED, "this computer was too busy: the watchdog waited for 250 ms (limit 100 ms)"),
        (0.250, PAUSED, "this computer was too busy: the watchdog waited for 250 ms (limit 100 ms)"),
    ],
)
def test_the_cause_is_of_when_the_program_ended_however_late_it_is_asked_for(
    ended: float, state: int, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    packets = [a_packet(BEGIN, PLAYING), a_packet(BEGIN + ended, state), a_packet(BEGIN + ended + 0.3, state)]
    cause = a_link(KICKS, packets, monkeypatch).why()
    assert isinstance(cause, BenchFault)
    assert words in str(cause)
    assert str(cause).count("; ") == 1, "one cause is named"


def test_a_delay_long_before_the_end_is_no_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    kicks = [BEGIN - 2.0, *KICKS]
    packets = [a_packet(BEGIN, PLAYING), a_packet(BEGIN + 0.01, STOPPED)]
    assert "too busy" not in str(a_link(kicks, packets, monkeypatch).why())


def test_a_safety_stop_is_named_before_all_else(monkeypatch: pytest.MonkeyPatch) -> None:
    packets = [a_packet(BEGIN, PLAYING), a_packet(BEGIN + 0.25, PAUSED, safety_bits=1 << 2)]
    cause = a_link(KICKS, packets, monkeypatch).why()
    assert isinstance(cause, ProtectiveStop)
    assert "busy" not in str(cause)
