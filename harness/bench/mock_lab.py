"""The station's end of the pipe to a mocked lab: start it, tell it the step, cue faults, end it.

The lab is a program of its own (``python -m mocks.lab``) that answers JSON lines. It ends with
the end of file on its standard input, so it cannot outlive the process that started it.
"""

import fcntl
import json
import os
import selectors
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.mesh import Mesh
from harness.basics.worker_pool import end_process
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station

_OWNER = "owner.lock"


class OwnedFolder:
    """A new temporary folder, held until it is closed; a process that was killed holds nothing.

    Making one removes the folders of the same prefix, and the same user, whose owners are dead.

    Args:
        prefix: of the folder's name, for all folders of one purpose.
        parent: where; the computer's temporary folder where None.
    """

    def __init__(self, prefix: str, parent: Path | None = None) -> None:
        parent = parent or Path(tempfile.gettempdir())
        _remove_ownerless(prefix, parent)
        self.path = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        # The lock on this descriptor shows that the owner lives; no child inherits it.
        part = self.path / f".{_OWNER}.part"
        self._held: int | None = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._held, fcntl.LOCK_EX)
        # Renamed once locked: a folder with an owner's lock that is free has lost its owner.
        part.rename(self.path / _OWNER)

    def close(self) -> None:
        """Remove the folder with all that is in it; may be called twice."""
        held, self._held = self._held, None
        if held is not None:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(held)


READY_WITHIN = 60.0
"""s for the lab to be ready: on a cold machine its kernels are compiled first."""

SOLVED_WITHIN = 600.0
"""s more where the scene asks for sound: the modes of a true object met for the first time are solved."""

ANSWER_WITHIN = 15.0
END_WITHIN = 3.0
COMMAND = (sys.executable, "-P", "-m", "mocks.lab")
"""The program of a mocked lab; ``-P`` keeps a folder ``mocks`` of the working directory out of its way."""

_TAIL = 2000
_SCHEMA = 1


@dataclass(frozen=True)
class LabAddresses:
    """Where the mocked instruments are."""

    addresses: Mapping[str, str]  #: by instrument: a host, a URL, the path of a port, the name of an input.
    environment: Mapping[str, str] = field(default_factory=dict)
    """what a program must have in its environment to open them."""


class MockLab:
    """A mocked lab in a process of its own; a context manager that ends it.

    Args:
        scene: that the world shows.
        station: whose instruments are mocked.
        mesh: of the object, in metres, as planned with; a built-in object the lab tessellates anew.
        seed: of the world's draws.
        gap: path of the reality gap.
        truth: where the lab writes what is true.
        command: the program; None for ``COMMAND``.
        run_id: identity of the run, which the truth repeats; empty where no run is recorded.
    """

    def __init__(
        self,
        scene: SceneFile,
        station: Station,
        mesh: Mesh,
        seed: int,
        gap: Path,
        truth: Path,
        command: Sequence[str] | None = None,
        run_id: str = "",
    ) -> None:
        self._scene, self._station, self._mesh = scene, station, mesh
        self._options = ["--seed", str(seed), "--gap", str(gap), "--truth", str(truth)]
        self._options += ["--run", run_id]
        self._command = [*(command or COMMAND)]
        self._process: subprocess.Popen[bytes] | None = None
        self._folder: OwnedFolder | None = None
        self._waiting = b""
        self._busy = threading.Lock()

    def start(self) -> LabAddresses:
        """Start the lab and wait until every instrument answers.

        Raises:
            BenchFault: it ended, or was not ready in time; what it said last is in the message.
        """
        if self._process is not None:
            raise ValueError("this lab is running already; make another")
        self._folder = OwnedFolder("touchstone-lab-")
        arguments = ["--scene", str(self._described(self._folder.path)), *self._options]
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [*self._command, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                process_group=0,  # Ctrl-C at the terminal is for the session; the lab goes on
            )
        try:
            solving = SOLVED_WITHIN if self._scene.sensors.sound else 0.0
            return _addresses(self._line(READY_WITHIN + solving))
        except BaseException:
            self.close()
            raise

    def mark(self, step: int, sample: int) -> None:
        """Tell the world the step and the sample, and wait until it shows them."""
        self.ask({"mark": {"step": step, "sample": sample}})

    def fault(self, instrument: str, kind: str, seconds: float | None = None) -> None:
        """Make something go wrong at the far end of a cable; for tests and demonstrations."""
        cue: dict[str, Any] = {"instrument": instrument, "kind": kind}
        self.ask({"fault": cue if seconds is None else {**cue, "seconds": seconds}})

    def ask(self, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """One line to the lab, and its answer.

        Raises:
            BenchFault: the lab is gone, silent, or cannot do what is asked.
        """
        with self._busy:
            stream = None if self._process is None else self._process.stdin
            if stream is None or stream.closed:
                raise BenchFault("the mocked lab is not running; open the station first")
            try:
                stream.write(json.dumps(request, allow_nan=False).encode() + b"\n")
                stream.flush()
            except OSError as error:
                raise BenchFault(f"the mocked lab is gone; {self._said()}") from error
            answer = self._line(ANSWER_WITHIN)
        if "error" in answer:
            raise BenchFault(f"the mocked lab refused {json.dumps(request)}: {answer['error']}")
        return answer

    def close(self) -> None:
        """End the lab and all its processes; may be called twice."""
        process, self._process = self._process, None
        if process is not None:
            end_process(process, END_WITHIN)
            if process.stdout is not None:
                process.stdout.close()
        if self._folder is not None:
            self._folder.close()
            self._folder = None

    def __enter__(self) -> "MockLab":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def process_id(self) -> int:
        """Of the lab's own process; ``BenchFault`` where it is not running."""
        if self._process is None:
            raise BenchFault("the mocked lab is not running; open the station first")
        return self._process.pid

    @property
    def _log(self) -> Path:
        assert self._folder is not None
        return self._folder.path / "lab.log"

    def _described(self, folder: Path) -> Path:
        """The file that tells the lab what it is a mock of."""
        mesh = None if self._scene.object.builtin is not None else folder / "mesh.npz"
        if mesh is not None:
            np.savez(mesh, vertices=self._mesh.vertices, faces=self._mesh.faces)
        told = {
            "schema": _SCHEMA,
            "scene": self._scene.without_sections().model_dump(mode="json"),
            "station": self._station.model_dump(mode="json"),
            "mesh": None if mesh is None else str(mesh),
            "base_from_object": self._scene.base_from_object(self._mesh).tolist(),
        }
        path = folder / "scene.json"
        path.write_text(json.dumps(told, allow_nan=False), encoding="utf-8")
        return path

    def _line(self, seconds: float) -> Mapping[str, Any]:
        """The next line the lab says within ``seconds``."""
        assert self._process is not None
        assert self._process.stdout is not None
        descriptor = self._process.stdout.fileno()
        end = now() + seconds
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while b"\n" not in self._waiting:
                if not selector.select(max(0.0, end - now())):
                    raise BenchFault(f"the mocked lab said nothing for {seconds:g} s; {self._said()}")
                arrived = os.read(descriptor, 1 << 16)
                if not arrived:
                    raise BenchFault(f"the mocked lab ended; {self._said()}")
                self._waiting += arrived
        line, _, self._waiting = self._waiting.partition(b"\n")
        answer: Mapping[str, Any] = json.loads(line)
        return answer

    def _said(self) -> str:
        text = self._log.read_text(encoding="utf-8", errors="replace").strip()
        return f"its last words were: {text[-_TAIL:]}" if text else "it said nothing on standard error"


def _addresses(ready: Mapping[str, Any]) -> LabAddresses:
    if ready.get("ready") is not True:
        raise BenchFault(f"the mocked lab did not start: {ready.get('error', ready)}")
    return LabAddresses(ready["addresses"], ready["environment"])


def _remove_ownerless(prefix: str, parent: Path) -> None:
    for folder in parent.glob(f"{prefix}*"):
        try:
            mine = not folder.is_symlink() and folder.stat().st_uid == os.getuid()
            lock = os.open(folder / _OWNER, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC) if mine else None
        except OSError:  # it is not a held folder, or another program is removing it
            continue
        if lock is None:
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
        except BlockingIOError:  # its owner lives
            continue
        finally:
            os.close(lock)
