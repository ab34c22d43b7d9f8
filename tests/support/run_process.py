"""The program as its users start it, in a process of its own that can be interrupted and killed."""

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

PROGRAM = Path(sys.executable).with_name("touchstone")
_MARK = "TOUCHSTONE_TEST_MARK"
_LISTEN = "0A"


class RunProcess:
    """``touchstone ...`` with everything it starts; found again by a mark that children inherit.

    Args:
        arguments: of the command line; ``--json`` is added.
        folder: for temporary files and what it says.
    """

    def __init__(self, arguments: Sequence[str], folder: Path) -> None:
        self.mark = uuid.uuid4().hex
        self._said = folder / f"said-{self.mark}"
        environment = {**os.environ, _MARK: self.mark, "TMPDIR": str(folder)}
        with self._said.open("wb") as said:
            self._process = subprocess.Popen(
                [str(PROGRAM), *arguments, "--json"],
                cwd=folder,
                env=environment,
                stdout=subprocess.PIPE,
                stderr=said,
                start_new_session=True,
            )

    @property
    def said(self) -> str:
        """What it wrote on standard error so far."""
        return self._said.read_text(errors="replace")

    def ended(self) -> bool:
        """Whether it has exited."""
        return self._process.poll() is not None

    def wait_for(self, what: Callable[[], bool], seconds: float) -> None:
        """Until something is so; fails where the program ends first, or it takes too long."""
        end = time.monotonic() + seconds
        while not what():
            ended, late = self.ended(), time.monotonic() > end
            if ended or late:
                self.kill()
            assert not ended, f"it ended first: {self.said}"
            assert not late, f"not within {seconds:g} s: {self.said}"
            time.sleep(0.02)

    def interrupt(self) -> None:
        """Ctrl-C at its terminal: to the whole foreground group."""
        os.killpg(self._process.pid, signal.SIGINT)

    def kill(self) -> None:
        """Kill -9 of the program alone."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def finish(self, seconds: float) -> tuple[int, dict[str, Any]]:
        """Its exit code and the one JSON object on its standard output."""
        try:
            out, _ = self._process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f"it did not end within {seconds:g} s: {self.said}") from None
        lines = out.decode().splitlines()
        assert len(lines) == 1, f"one JSON object, not {lines}; {self.said}"
        answer: dict[str, Any] = json.loads(lines[0])
        return self._process.returncode, answer

    def processes(self) -> list[int]:
        """Everything alive that it started, and itself."""
        return [pid for pid in _all_processes() if self.mark in _environment(pid)]

    def ports(self) -> set[str]:
        """Addresses and ports (in hexadecimal) that they listen on."""
        inodes = {inode for pid in self.processes() for inode in _sockets(pid)}
        return {address for address, inode in _listening() if inode in inodes}

    def left(self, ports: set[str], seconds: float = 5.0) -> tuple[list[int], set[str]]:
        """Processes, and those of ``ports`` still listened on, after at most so many seconds of grace."""
        end = time.monotonic() + seconds
        while True:
            found = self.processes(), ports & {address for address, _ in _listening()}
            if not any(found) or time.monotonic() > end:
                return found
            time.sleep(0.02)


def _all_processes() -> list[int]:
    return [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]


def _environment(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
    except OSError:  # it ended meanwhile
        return ""


def _sockets(pid: int) -> set[str]:
    found = set()
    for path in Path(f"/proc/{pid}/fd").glob("*"):
        try:
            target = str(path.readlink())
        except OSError:
            continue
        if target.startswith("socket:["):
            found.add(target.removeprefix("socket:[").removesuffix("]"))
    return found


def _listening() -> list[tuple[str, str]]:
    """Address and inode of every listening TCP socket."""
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return [(row[1], row[9]) for row in rows if row[3] == _LISTEN]
