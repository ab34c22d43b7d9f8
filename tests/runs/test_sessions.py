"""Sessions on the bench in process: resumed, failed, complete; the wires are tried elsewhere."""

import json
import os
import signal
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import BenchFault, NotTouched, WrongUse
from harness.bench.device import Reading
from harness.bench.station import Bench
from harness.bench.station_file import load_station, station_path
from harness.cli import invoke
from harness.commands.output import warn
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.recording.step_file import Step
from mocks.in_process.bench import in_process_bench
from tests.support import sessions as session_of
from tests.support.whole_run import copied, edited, in_process_run, touch_scene

PACKETS_APART = 0.1e-3
"""m: simulated packets are 0.4 mm of the search apart, and the touch is interpolated between two."""


def bench_of(recording: Recording, gap: str = "default") -> Bench:
    run = RunFiles(recording)
    return in_process_bench(run.scene, run.station, replace(run.context, gap=gap))


def cut(recording: Recording, folder: Path, steps: int) -> Recording:
    """A copy that was stopped after so many steps."""
    copy = copied(recording, folder)
    for path in sorted((folder / "steps").glob("*.mcap"))[steps:]:
        path.unlink()
    return copy


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_resumed_run_reads_what_the_whole_one_read(done: Recording, tmp_path: Path, steps: int) -> None:
    stopped = cut(done, tmp_path / "run", steps)
    kept = {path: path.read_bytes() for path in (tmp_path / "run" / "steps").glob("*")}
    complete = session_of.perform_on(bench_of(stopped), stopped, Quiet()).complete
    assert complete
    assert {path: path.read_bytes() for path in kept} == kept
    for mine, theirs in zip(stopped.steps(), done.steps(), strict=True):
        last = [record.readings["arm.base_from_flange"].values[-1] for record in (mine, theirs)]
        assert last[0] == pytest.approx(last[1], abs=PACKETS_APART)
    contacts = [json.loads(r.truth_path.read_text())["contacts"] for r in (stopped, done)]
    assert [c["step"] for c in contacts[0]] == [0, 1, 2]
    assert np.array([c["point_in_object_m"] for c in contacts[0]]) == pytest.approx(
        np.array([c["point_in_object_m"] for c in contacts[1]]), abs=PACKETS_APART
    )


def test_a_half_written_step_is_not_a_step(done: Recording, tmp_path: Path) -> None:
    stopped = cut(done, tmp_path / "run", 2)
    whole = (done.folder / "steps" / "002.mcap").read_bytes()
    (tmp_path / "run" / "steps" / ".002.mcap.part").write_bytes(whole[: len(whole) // 2])
    assert stopped.committed == 2
    session_of.perform_on(bench_of(stopped), stopped, Quiet())
    assert stopped.committed == 3
    assert len(stopped.steps()) == 3


def test_a_complete_run_is_resumed_without_a_bench(
    done: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def open_nothing(*_: object) -> None:
        raise AssertionError("a bench was opened for a run that is complete")

    def finish(_kind: object, run: RunFiles, *_: object, **__: object) -> dict[str, Any]:
        return {"schema": 1, "warnings": [], "recording": str(run.recording.folder), "report": "none"}

    monkeypatch.setattr("harness.experiment.perform.open_station", open_nothing)
    monkeypatch.setattr("harness.tasks.runs.finish", finish)
    folder = copied(done, tmp_path / "run").folder
    assert invoke(["run", "--resume", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["recording"] == str(folder)


def test_an_object_that_is_not_there_is_not_touched(tmp_path: Path) -> None:
    """It was moved after the plan was made: the gel meets nothing, and is back where it came from."""
    started = session_of.start(
        touch_scene(contacts=2), load_station(station_path("mock")), 3, None, tmp_path / "r"
    )

    def take_away(tree: dict[str, Any]) -> None:
        tree["scene"]["object"]["pose"]["position"] = ["0.6 m", "0.6 m", "0.25 m"]

    recording = edited(started.recording, take_away)
    bench = bench_of(recording)
    with pytest.raises(NotTouched, match=r"^contact 1: .* mm .* N ") as caught:
        session_of.perform_on(bench, recording, Quiet())
    assert caught.value.exit_code == 1
    assert "\n" not in str(caught.value)
    assert recording.committed == 0
    stand_off = np.array(recording.header.plan["contacts"][0]["base_from_stand_off"])
    assert bench.arm.state().base_from_flange[:3, 3] == pytest.approx(stand_off[:3, 3], abs=1e-4)


class Blind:
    """A gel that fails at one reading."""

    def __init__(self, bench: Bench, at: int) -> None:
        self._gel, self._left = bench.gel, at
        self.open, self.close, self.health = bench.gel.open, bench.gel.close, bench.gel.health

    def read(self, count: int, timeout: float) -> Reading:
        if self._left == 0:
            raise BenchFault("gel: no frame for 3 s")
        self._left -= 1
        return self._gel.read(count, timeout)


def test_a_gel_that_fails_does_not_stay_pressed(tmp_path: Path) -> None:
    started = session_of.start(
        touch_scene(contacts=2), load_station(station_path("mock")), 3, None, tmp_path / "r"
    )
    recording = started.recording
    bench = bench_of(recording)
    with pytest.raises(BenchFault, match="gel: no frame"):
        session_of.perform_on(
            replace(bench, instruments={**bench.instruments, "gel": Blind(bench, 1)}), recording, Quiet()
        )
    assert recording.committed == 1
    stand_off = np.array(recording.header.plan["contacts"][1]["base_from_stand_off"])
    assert bench.arm.state().base_from_flange[:3, 3] == pytest.approx(stand_off[:3, 3], abs=1e-4)


def test_a_folder_that_holds_a_run_is_left_as_it_is(done: Recording, tmp_path: Path) -> None:
    folder = copied(done, tmp_path / "run").folder
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    with pytest.raises(WrongUse, match="--resume"):
        session_of.start(touch_scene("builtin:bowl"), load_station(station_path("mock")), 1, None, folder)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("error", [KeyboardInterrupt(), PermissionError(13, "Permission denied", "runs/x")])
def test_what_no_command_foresaw_is_one_sentence_too(
    error: BaseException, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr("harness.tasks.runs.begin", fail)
    code = invoke(["run", "--object", "builtin:mug", "--json"])
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert code == answer["exit_code"] == (130 if isinstance(error, KeyboardInterrupt) else 1)
    assert "Traceback" not in captured.err
    assert answer["error"] in (
        "interrupted; what was recorded is kept, go on with --resume",
        "runs/x: Permission denied",
    )


def test_ctrl_c_of_a_command_that_does_not_resume_does_not_send_to_resume(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], done: Recording, tmp_path: Path
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("harness.tasks.runs.finish", fail)
    assert invoke(["replay", str(done.folder), "--out", str(tmp_path / "replay")]) == 130
    assert capsys.readouterr().err == "error: interrupted\n"


def test_a_run_that_its_bench_ends_says_how_it_goes_on(
    done: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise BenchFault("the arm is gone")

    monkeypatch.setattr("harness.tasks.runs.perform_on_bench", fail)
    folder = copied(done, tmp_path / "run").folder
    (folder / "steps" / "002.mcap").unlink()
    assert invoke(["run", "--resume", str(folder)]) == 1
    said = capsys.readouterr().err
    assert f"touchstone run contact-localization --resume {folder}" in said
    assert said.endswith("error: the arm is gone\n")


def test_a_warning_keeps_its_brackets(capsys: pytest.CaptureFixture[str]) -> None:
    warn("see [object.pose] of the scene")
    assert "[object.pose]" in capsys.readouterr().err


@dataclass
class Pressing(Quiet):
    """A progress at which Ctrl-C is pressed as a step begins."""

    at: int

    def began(self, step: Step) -> None:
        if step.index == self.at:
            os.kill(os.getpid(), signal.SIGINT)


def test_ctrl_c_once_ends_after_the_step(done: Recording, tmp_path: Path) -> None:
    stopped = cut(done, tmp_path / "run", 0)
    complete = session_of.perform_on(bench_of(stopped), stopped, Pressing(at=1)).complete
    assert not complete
    assert stopped.committed == 2


def test_two_runs_of_one_seed_read_the_same(done: Recording, tmp_path: Path) -> None:
    again = in_process_run(tmp_path / "again", touch_scene(), seed=3)
    pictures: Sequence[list[tuple[bytes, ...]]] = [
        [record.readings["gel.image"].encoded for record in run.steps()] for run in (done, again)
    ]
    assert pictures[0] == pictures[1]
