"""The limit of a test's CPU time."""

import subprocess
import sys
from pathlib import Path

_TESTS = """
import time

def test_computes():
    while True:
        pass

def test_waits():
    time.sleep(1.0)
"""


def test_a_test_that_computes_too_long_fails_and_one_that_waits_does_not(tmp_path: Path) -> None:
    (tmp_path / "test_two.py").write_text(_TESTS)
    (tmp_path / "pytest.ini").write_text("[pytest]\ncpu_timeout = 0.3\ntimeout = 60\n")
    program = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "tests.support.cpu_limit",
        "--rootdir",
        str(tmp_path),
    ]
    done = subprocess.run([*program, str(tmp_path)], capture_output=True, text=True, check=False)
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    assert "used more than 0.3 s of CPU" in done.stdout
