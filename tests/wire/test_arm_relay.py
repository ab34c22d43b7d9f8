"""What stands behind a loopback address: a mock says so itself, all else is taken for a real arm."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import SafetyStop
from tests.support.arm_bench import READY, FarEnd, make_arm
from tests.support.relay import Relay

REAL_SERIAL = "20225500001"
FOREVER = "def work():\n while True: sync() end\nend\n"


@pytest.fixture
def real() -> Iterator[FarEnd]:
    """A controller that does not identify itself as a mock, at work on a program of its own."""
    end = FarEnd(REAL_SERIAL)
    end.program(FOREVER)
    while "true" not in end.ask("running"):
        pass
    yield end
    end.close()


def test_a_relay_to_what_is_no_mock_is_refused_and_only_its_name_is_asked(
    real: FarEnd, tmp_path: Path
) -> None:
    before = real.joints()
    with Relay(real.address) as relay:
        with pytest.raises(SafetyStop, match=f"'{REAL_SERIAL}'"):
            make_arm(relay.address, tmp_path).open()
        assert {port: data for port, data in relay.sent.items() if data} == {29999: b"get serial number\n"}
    assert real.ask("running") == "Program running: true"
    assert np.array_equal(real.joints(), before)


def test_the_child_itself_refuses_what_is_no_mock_and_leaves_its_program(real: FarEnd) -> None:
    command = [sys.executable, "-m", "drivers.ur.child", "--address", real.address, "--model", "ur5e"]
    done = subprocess.run(
        [*command, "--rate", "500"], stdin=subprocess.DEVNULL, capture_output=True, check=False
    )
    assert b'"error":"SafetyStop"' in done.stdout
    assert REAL_SERIAL.encode() in done.stdout
    assert real.ask("running") == "Program running: true"


def test_a_relay_to_a_mock_moves_the_mock(tmp_path: Path) -> None:
    end = FarEnd()
    with Relay(end.address) as relay:
        arm = make_arm(relay.address, tmp_path, patience=0.5)
        arm.open()
        arm.move_joints(READY + 0.02, 0.2, 1.5)
        assert np.abs(end.joints() - READY - 0.02).max() < 1e-6
        arm.close()
    end.close()
