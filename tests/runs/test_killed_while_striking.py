"""Kill -9 between the firing of the hammer and the end of what is listened to: nothing is lost."""

import json
import sys
from hashlib import sha256
from pathlib import Path

import pytest

from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.recording.recording import Recording
from tests.support.run_process import RunProcess

pytestmark = [
    pytest.mark.slow,  # minutes over the wires; kills between steps stay in test_runs_on_wires.py
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]

MUG = (
    *("run", "contact-localization", "--object", "builtin:mug", "--sense", "both"),
    *("--bench", "wires"),
    *("--contacts", "2", "--spacing", "spread", "--seed", "3"),
)


def struck(folder: Path) -> int:
    """Strikes that have begun: the truth of one is written before it is fired."""
    truth = folder / "run.truth.json"
    if not truth.exists():
        return 0
    return sum("strike" in contact for contact in json.loads(truth.read_text())["contacts"])


def hashes(folder: Path) -> dict[Path, str]:
    return {path: sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("*.mcap"))}


def test_a_kill_during_a_strike_loses_that_contact_alone(tmp_path: Path) -> None:
    program = RunProcess([*MUG, "--out", str(tmp_path / "run")], tmp_path)
    program.wait_for(lambda: struck(tmp_path) == 2, 330.0)
    ports = program.ports()
    assert len(ports) >= 4, "dashboard, script, real-time exchange, gel; the box is a terminal"
    program.kill()
    assert program.left(ports) == ([], set())
    steps = tmp_path / "run" / "steps"
    committed = hashes(steps)
    assert len(committed) == len(Recording(tmp_path / "run").steps()) == 1
    resumed = RunProcess(["run", "--resume", str(tmp_path / "run")], tmp_path)
    code, result = resumed.finish(240.0)
    assert code == 0, resumed.said
    assert committed.items() <= hashes(steps).items()
    records = Recording(tmp_path / "run").steps()
    assert [record.step.index for record in records] == [0, 1]
    assert all({FORCE, PRESSURE} <= set(record.readings) for record in records)
    assert list(result["estimates"]) == ["touch", "audio", "both"]
    assert not any("sound says nothing" in warning for warning in result["warnings"])
