"""Shape reconstruction over every wire, from the command line: a look, presses, surfaces beside a result."""

import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.run_process import RunProcess

pytestmark = [
    pytest.mark.slow,  # the same run in process is in test_shape_run.py
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
    pytest.mark.timeout(300),
]


def surfaces(result: dict[str, Any]) -> dict[str, Any]:
    return {sense: (one["extents_m"], one["chamfer_m"]) for sense, one in result["estimates"].items()}


def test_a_run_looks_presses_and_answers_and_is_replayed_to_the_same(tmp_path: Path) -> None:
    arguments = ["run", "shape-reconstruction", "--object", "builtin:mug", "--presses", "2", "--seed", "0"]
    arguments += ["--level", "shape.method=hull"]
    code, result = RunProcess([*arguments, "--out", str(tmp_path / "run")], tmp_path).finish(240.0)
    assert code == 0
    assert result["mock"]
    assert result["presses"] == 2
    assert result["contacts"] >= 1
    fused = result["estimates"]["fused"]
    assert 0.0 < fused["chamfer_m"] < 0.05
    assert (tmp_path / "run" / fused["mesh"]).is_file()
    assert Path(result["report"]).is_file()
    again = RunProcess(
        ["replay", str(tmp_path / "run"), "--level", "shape.method=hull", "--out", str(tmp_path / "again")],
        tmp_path,
    )
    code, replayed = again.finish(100.0)
    assert code == 0
    assert surfaces(replayed) == surfaces(result)
    assert (tmp_path / "again" / fused["mesh"]).is_file()
