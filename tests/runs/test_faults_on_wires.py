"""Faults at the far ends of the cables during a run: one sentence, nothing lost, the arm at rest."""

import json
import socket
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import SafetyStop, TouchstoneError
from harness.bench.station import Bench
from harness.cli import invoke
from harness.experiment import perform
from harness.experiment.experiment import AnyExperiment
from harness.experiment.perform import Performed
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Progress, Quiet
from harness.recording.step_file import Step
from mocks.in_process.bench import in_process_bench
from tests.support import sessions as session_of
from tests.support.whole_run import copied, edited

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]

Cue = Callable[[Bench], None]

BRAKING = 0.2
"""s: a stop is told as it begins; at 0.9 rad/s a joint is at rest within this."""


@dataclass
class Session:
    """What became of a session in which something was cued as its first contact began."""

    code: int  #: the program's exit code.
    said: dict[str, Any]  #: the JSON object it printed.
    failed: dict[str, Any] = field(default_factory=dict)
    """after the failure and before the bench was closed: what the test looks at."""


@dataclass(frozen=True)
class Cued:
    """A progress that cues a fault as a step begins."""

    progress: Progress
    bench: Bench
    cue: Cue

    def began(self, step: Step) -> None:
        self.progress.began(step)
        self.cue(self.bench)

    def ended(self, step: Step, seconds: float) -> None:
        self.progress.ended(step, seconds)


def cue(bench: Bench, instrument: str, kind: str) -> None:
    assert bench.lab is not None
    bench.lab.fault(instrument, kind)


def moved_in(bench: Bench, seconds: float) -> float:
    """rad by which any joint turns in so many seconds, once the brakes have had their time."""
    time.sleep(BRAKING)
    first = bench.arm.state().joints
    time.sleep(seconds)
    return float(np.abs(bench.arm.state().joints - first).max())


Resume = Callable[[Recording, Cue, Callable[[Bench], dict[str, Any]]], Session]


@pytest.fixture
def resume(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Resume:
    """Goes on with a run by the command line, cues a fault, and looks at the bench after the failure."""
    perform_on = perform.perform_on
    # The steps before were recorded in simulated time, which is ahead of the clock for some seconds.
    monkeypatch.setattr("harness.recording.recording._BACKWARDS_TOLERANCE_NS", 60 * 10**9)

    def go_on(recording: Recording, fault: Cue, look: Callable[[Bench], dict[str, Any]]) -> Session:
        failed: dict[str, Any] = {}

        def faulty(
            kind: AnyExperiment, bench: Bench, run: RunFiles, progress: Progress, *others: Any
        ) -> Performed:
            try:
                return perform_on(kind, bench, run, Cued(progress, bench, fault), *others)
            except TouchstoneError:
                failed.update(moved=moved_in(bench, 0.3), **look(bench))
                raise

        monkeypatch.setattr("harness.experiment.perform.perform_on", faulty)
        code = invoke(["run", "--resume", str(recording.folder), "--json"])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        said = json.loads(captured.out)
        assert said["exit_code"] == code
        assert "\n" not in said["error"]
        monkeypatch.setattr("harness.experiment.perform.perform_on", perform_on)
        return Session(code, said, failed)

    return go_on


@pytest.fixture
def begun(done: Recording, tmp_path: Path) -> Recording:
    """A run with two of three contacts on the disk."""
    recording = copied(done, tmp_path / "run")
    (recording.folder / "steps" / "002.mcap").unlink()
    return recording


def hashes(recording: Recording) -> dict[str, str]:
    steps = sorted((recording.folder / "steps").glob("*"))
    return {path.name: sha256(path.read_bytes()).hexdigest() for path in steps}


@pytest.mark.slow  # in motion in test_arm_alarm.py, pressed on the object in test_sessions.py
def test_a_stalled_camera(resume: Resume, begun: Recording) -> None:
    """Whichever motion it ends, or the reading: the gel is not left on the object."""
    before = hashes(begun)
    contact = begun.header.plan["contacts"][2]
    place, axis = np.array(contact["base_from_stand_off"])[:3, 3], np.array(contact["axis_in_base"])

    def beyond(bench: Bench) -> dict[str, Any]:
        return {"beyond": float((bench.arm.state().base_from_flange[:3, 3] - place) @ axis)}

    session = resume(begun, lambda bench: cue(bench, "gel", "stall"), beyond)
    assert session.code == 1
    assert "gel sent " in session.said["error"]
    assert "stalled" in session.said["error"]
    assert session.failed["moved"] < 1e-3
    assert session.failed["beyond"] < 1e-3, "it does not stay pressed on the object"
    assert hashes(begun) == before
    run = RunFiles(begun)
    bench = in_process_bench(run.scene, run.station, run.context)
    assert session_of.perform_on(bench, begun, Quiet()).complete
    assert begun.committed == 3
    assert before.items() <= hashes(begun).items()


def test_a_protective_stop_in_the_middle_of_a_motion(resume: Resume, begun: Recording) -> None:
    before = hashes(begun)
    timers: list[threading.Timer] = []

    def soon(bench: Bench) -> None:
        timers.append(threading.Timer(0.7, lambda: bench.lab.fault("arm", "protective_stop")))  # type: ignore[union-attr]
        timers[0].start()

    def latched(bench: Bench) -> dict[str, Any]:
        state = bench.arm.state()
        with pytest.raises(SafetyStop) as refused:
            bench.arm.move_joints(state.joints + 0.05, 0.1, 0.5)
        return {"safety": state.safety, "refused": str(refused.value), "again": moved_in(bench, 0.2)}

    session = resume(begun, soon, latched)
    timers[0].join()
    assert session.code == 3
    assert "protective stop" in session.said["error"]
    assert session.failed["safety"] == "protective stop"
    assert "protective stop" in session.failed["refused"]
    assert session.failed["moved"] < 1e-3
    assert session.failed["again"] < 1e-3
    assert hashes(begun) == before


@pytest.mark.slow  # contacts that meet nothing are tested in process
def test_an_object_that_is_not_there(resume: Resume, begun: Recording) -> None:
    def take_away(tree: dict[str, Any]) -> None:
        tree["scene"]["object"]["pose"]["position"] = ["0.6 m", "0.6 m", "0.25 m"]

    before = hashes(begun)
    place = np.array(begun.header.plan["contacts"][2]["base_from_stand_off"])[:3, 3]

    def away(bench: Bench) -> dict[str, Any]:
        return {"away": float(np.linalg.norm(bench.arm.state().base_from_flange[:3, 3] - place))}

    session = resume(edited(begun, take_away), lambda bench: None, away)
    assert session.code == 1
    assert session.said["error"].startswith("contact 3: ")
    assert "[object.pose]" in session.said["error"]
    assert session.failed["moved"] < 1e-3
    assert session.failed["away"] < 1e-3, "it is back at the stand-off"
    assert hashes(begun) == before


STATION = """
schema = 1
[arm]
kind = "ur"
model = "ur5e"
address = "127.7.7.7"
rate = "500 Hz"
[arm.safety]
workspace_low = ["-1.0 m", "-0.8 m", "0.02 m"]
workspace_high = ["0.4 m", "0.8 m", "1.2 m"]
[gel]
kind = "gelsight-http"
make = "gelsight-r1.5"
serial = "none"
url = "http://127.7.7.7:{port}/?action=stream"
calibration = "gelsight_r15_bench"
[frames.flange_from_gel]
position = ["0 mm", "0 mm", "120 mm"]
rotation = ["0 deg", "0 deg", "0 deg"]
"""


def test_a_wrong_port(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing listens: every instrument is named, with what to check, and nothing is waited for long."""
    with socket.create_server(("127.7.7.7", 0)) as closed_again:
        port = closed_again.getsockname()[1]
    (tmp_path / "station.toml").write_text(STATION.format(port=port))
    code = invoke(["check", "--station", str(tmp_path / "station.toml"), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert code == 1
    assert set(said["failures"]) == {"arm", "gel"}
    arm, gel = said["failures"]["arm"], said["failures"]["gel"]
    assert "127.7.7.7" in arm
    assert str(port) in gel
    assert "check" in arm
    assert "check" in gel
