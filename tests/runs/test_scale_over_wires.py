"""Scale estimation over every wire, from the command line: a look, contacts, and the answer as JSON."""

import json
import sys
from pathlib import Path

import pytest

from tests.support.run_process import RunProcess

pytestmark = [
    pytest.mark.slow,  # the same run in process is in test_run.py of scale estimation
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]


def test_a_run_looks_touches_and_answers_and_is_replayed_to_the_same(tmp_path: Path) -> None:
    arguments = [
        "run",
        "scale-estimation",
        "--object",
        "builtin:mug",
        "--range",
        "6cm",
        "24cm",
        "--bench",
        "wires",
    ]
    arguments += ["--sense", "vision,touch", "--contacts", "2", "--seed", "2", "--out", str(tmp_path / "run")]
    code, result = RunProcess(arguments, tmp_path).finish(200.0)
    assert code == 0
    assert result["mock"]
    assert result["range_m"] == [0.06, 0.24]
    true = json.loads((tmp_path / "run.truth.json").read_text())["differences"]["longest_side_m"]
    assert result["estimates"]["fused"]["size_m"] == pytest.approx(true, rel=0.05)
    assert result["estimates"]["audio"]["refused"]
    again = RunProcess(["replay", str(tmp_path / "run"), "--out", str(tmp_path / "again")], tmp_path)
    code, replayed = again.finish(100.0)
    assert code == 0
    assert {sense: one["size_m"] for sense, one in replayed["estimates"].items()} == {
        sense: one["size_m"] for sense, one in result["estimates"].items()
    }
