"""The lab's children: told of faults, heard of when they fail, and gone when their parent is."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import BenchFault
from mocks.faults import Fault
from mocks.lab_processes import ARM_PORTS, ChildPipe, LabChild, free_address
from mocks.shared_pose import SharedPose, StepMark

_PARENT = """
import sys, time
from mocks.lab_processes import LabChild

def run(line):
    line.ready()
    while True:  # deaf to its line: only the system can end it
        time.sleep(1.0)

child = LabChild("deaf", run)
child.wait_ready(5.0)
print(child._process.pid, flush=True)
time.sleep(60.0)
"""


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux's /proc and parent-death signal")
def test_a_child_dies_with_a_parent_that_is_killed() -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", _PARENT], stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2]
    )
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert _alive(child)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    end = time.monotonic() + 5.0
    while _alive(child) and time.monotonic() < end:
        time.sleep(0.01)
    assert not _alive(child)


def _echo(line: ChildPipe) -> None:
    """Ends by itself once it has heard of the fault that the test cues."""
    line.ready()
    while not line.should_stop():
        if line.fault() == Fault("gel", "stall", 1.5):
            return
        time.sleep(0.01)


def test_a_fault_reaches_the_child() -> None:
    child = LabChild("gel", _echo)
    child.wait_ready(5.0)
    child.cue(Fault("gel", "stall", 1.5))
    child._process.join(5.0)
    assert child._process.exitcode == 0
    child.cue(Fault("gel", "none"))  # nobody hears it any more, and nothing breaks
    child.kill()


def _fail(line: ChildPipe) -> None:
    raise OSError("port 8080 is taken")


def test_a_child_that_fails_says_why(capfd: pytest.CaptureFixture[str]) -> None:
    child = LabChild("gel", _fail)
    with pytest.raises(BenchFault, match=r"gel .*OSError: port 8080 is taken"):
        child.wait_ready(5.0)
    child.kill()
    assert "Traceback" in capfd.readouterr().err


def test_a_child_that_is_never_ready_is_not_waited_for() -> None:
    child = LabChild("gel", lambda line: time.sleep(30.0))
    with pytest.raises(BenchFault, match=r"0\.1 s"):
        child.wait_ready(0.1)
    child.kill()


def test_an_address_has_every_port_free() -> None:
    address = free_address()
    assert address.startswith("127.")
    for port in ARM_PORTS:
        socket.create_server((address, port)).close()
    assert free_address() != address


def test_pose_and_mark_pass_between_processes() -> None:
    shared = SharedPose(np.eye(4))
    pose = np.eye(4)
    pose[:3] = np.random.default_rng(0).standard_normal((3, 4))
    if os.fork() == 0:
        shared.set_pose(pose)
        shared.set_mark(StepMark(7, 3, 1))
        shared.set_shown(1, 7)
        os._exit(0)
    os.wait()
    assert np.array_equal(shared.base_from_flange, pose)
    assert shared.mark == StepMark(7, 3, 1)
    assert (shared.shown(0), shared.shown(1)) == (0, 7)


def test_a_half_written_cell_is_never_read() -> None:
    shared = SharedPose(np.eye(4))
    shared._pose._memory[0:8] = b"\0" * 8
    with pytest.raises(RuntimeError, match="cell"):
        _ = shared.base_from_flange
