"""The program over every wire: it answers, is interrupted, is killed, and goes on where it was.

``TOUCHSTONE_KILLS=10`` kills it at ten moments instead of one.
"""

import os
import random
import sys
import time
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.recording.recording import Recording
from tests.support.run_process import RunProcess

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]

CONTACTS = 2
MUG = (
    *("run", "contact-localization", "--object", "builtin:mug", "--bench", "wires"),
    *("--contacts", str(CONTACTS), "--spacing", "spread", "--seed", "3"),
)
KILLS = int(os.environ.get("TOUCHSTONE_KILLS", "1"))
PATIENCE = 150.0
SAME_ANSWER = 0.2e-3
"""m. Poses differ by micrometres, so other draws follow from them; the posterior is 2 mm wide. Most answers
are within 0.05 mm."""

PHASES = (10.0, *[7.0] * (CONTACTS - 1), 3.0)
"""s within which to kill while the first contact is made, each other one, and after the last. The run
estimates then, and draws its report, which takes longer."""


@dataclass(frozen=True)
class Whole:
    """An uninterrupted run."""

    result: dict[str, Any]  #: what it printed.
    folder: Path  #: of the run.
    left: tuple[list[int], set[str]]  #: processes and ports after it.


def started(folder: Path) -> RunProcess:
    """A run whose folder has just been made."""
    program = RunProcess([*MUG, "--out", str(folder / "run")], folder)
    program.wait_for((folder / "run" / "run.json").exists, PATIENCE)
    return program


def contact_begun(folder: Path) -> bool:
    """Whether the first contact is pressed: its truth is written before its images are read."""
    return (folder / "run.truth.json").exists()


def hashes(folder: Path) -> dict[Path, str]:
    return {path: sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("*.mcap"))}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    folder = tmp_path_factory.mktemp("whole")
    program = started(folder)
    program.wait_for(lambda: contact_begun(folder), PATIENCE)
    ports = program.ports()
    assert len(ports) >= 4, "dashboard, script, real-time exchange, gel"
    code, result = program.finish(PATIENCE)
    assert code == 0, program.said
    return Whole(result, folder / "run", program.left(ports))


def test_a_run_answers(whole: Whole) -> None:
    result = whole.result
    touch = result["estimates"]["touch"]
    wanted = "position_m error_m error_mean_m error_top10_m credible90_m modes seconds"
    assert set(touch) >= set(wanted.split())
    wanted = "random_baseline_m geometry_baseline_m plan accuracy recording report"
    assert set(result) >= set(wanted.split())
    assert set(result["plan"]) == {"ran", "skipped"}
    assert result["contacts"] == CONTACTS
    assert touch["error_m"] < result["random_baseline_m"]
    assert Path(result["recording"]) == whole.folder
    assert Path(result["report"]).is_file()


def test_a_run_leaves_no_process_and_no_port(whole: Whole) -> None:
    assert whole.left == ([], set())


def resumed(folder: Path) -> dict[str, Any]:
    """The result of the run in ``folder``, gone on with."""
    program = RunProcess(["run", "--resume", str(folder / "run")], folder)
    code, result = program.finish(PATIENCE)
    assert code == 0, program.said
    return result


def assert_same_answer(result: dict[str, Any], whole: Whole) -> None:
    mine, theirs = (np.array(r["estimates"]["touch"]["position_m"]) for r in (result, whole.result))
    assert float(np.linalg.norm(mine - theirs)) < SAME_ANSWER


@pytest.mark.parametrize("kill", range(KILLS))
def test_kill_loses_at_most_the_step_in_flight(whole: Whole, tmp_path: Path, kill: int) -> None:
    program = started(tmp_path)
    draw = random.Random(kill)
    contacts = draw.randrange(len(PHASES))
    program.wait_for(lambda: len(hashes(tmp_path / "run" / "steps")) >= contacts, PATIENCE)
    time.sleep(draw.random() * PHASES[contacts])
    assert not program.ended(), "it is to be killed while it runs"
    ports = program.ports()
    program.kill()
    assert program.left(ports) == ([], set())
    steps = tmp_path / "run" / "steps"
    committed = hashes(steps)
    assert len(Recording(tmp_path / "run").steps()) == len(committed)
    result = resumed(tmp_path)
    assert {path: digest for path, digest in hashes(steps).items() if path in committed} == committed
    assert result["contacts"] == CONTACTS
    assert_same_answer(result, whole)


@pytest.mark.slow  # in process in test_run.py; twice stays here
def test_ctrl_c_once_ends_after_the_contact(whole: Whole, tmp_path: Path) -> None:
    program = started(tmp_path)
    program.wait_for(lambda: contact_begun(tmp_path), PATIENCE)
    ports = program.ports()
    program.interrupt()
    code, said = program.finish(PATIENCE)
    assert code == said["exit_code"] == 130, program.said
    assert "contact 1; " in said["error"]
    assert program.left(ports) == ([], set())
    committed = hashes(tmp_path / "run" / "steps")
    assert len(committed) == 1
    assert_same_answer(resumed(tmp_path), whole)
    assert committed.items() <= hashes(tmp_path / "run" / "steps").items()


def test_ctrl_c_twice_stops_now(tmp_path: Path) -> None:
    program = started(tmp_path)
    program.wait_for(lambda: contact_begun(tmp_path), PATIENCE)
    ports = program.ports()
    program.interrupt()
    time.sleep(0.2)
    program.interrupt()
    code, said = program.finish(PATIENCE)
    assert code == said["exit_code"] == 130, program.said
    assert "Traceback" not in program.said
    assert program.left(ports) == ([], set())
    assert not hashes(tmp_path / "run" / "steps")
