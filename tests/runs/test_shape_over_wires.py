"""Shape reconstruction over every wire, from the command line: a look, presses, surfaces beside a result.

``python -m pytest tests/runs/test_shape_over_wires.py -m benchmark -s`` makes one run of each built-in object
over every wire and the same in process.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.objects.household import MATERIALS
from tests.support.run_process import RunProcess

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]

SAME_SURFACE = 0.5e-3
"""m between the mean distances of both: an arm on its wires stops up to 0.3 mm elsewhere."""


PRESSES = {"bowl": "8"}
"""Number of presses by object, where four blind presses mostly end on the housing."""


def surfaces(result: dict[str, Any]) -> dict[str, Any]:
    return {sense: (one["extents_m"], one["chamfer_m"]) for sense, one in result["estimates"].items()}


@pytest.mark.slow  # the same run in process is in test_shape_run.py
def test_a_run_looks_presses_and_answers_and_is_replayed_to_the_same(tmp_path: Path) -> None:
    arguments = ["run", "shape-reconstruction", "--object", "builtin:mug", "--presses", "2", "--seed", "0"]
    arguments += ["--level", "shape.method=rbf", "--bench", "wires"]
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
        ["replay", str(tmp_path / "run"), "--level", "shape.method=rbf", "--out", str(tmp_path / "again")],
        tmp_path,
    )
    code, replayed = again.finish(100.0)
    assert code == 0
    assert surfaces(replayed) == surfaces(result)
    assert (tmp_path / "again" / fused["mesh"]).is_file()


@pytest.mark.benchmark
@pytest.mark.parametrize("name", MATERIALS)
def test_each_object_over_every_wire_is_what_it_is_in_process(name: str, tmp_path: Path) -> None:
    arguments = [
        "run",
        "shape-reconstruction",
        "--object",
        f"builtin:{name}",
        "--presses",
        PRESSES.get(name, "4"),
        "--seed",
        "0",
    ]
    arguments += ["--set", "choose=random", "--level", "shape.method=rbf"]
    results = []
    for bench in ("wires", "in-process"):
        out = ["--bench", bench, "--out", str(tmp_path / bench)]
        code, result = RunProcess([*arguments, *out], tmp_path).finish(300.0)
        assert code == 0
        results.append(result)
    wired, simulated = results
    assert wired["contacts"] == simulated["contacts"]
    (extents, chamfer), (others, other) = (surfaces(result)["fused"] for result in results)
    apart = float(np.abs(np.subtract(extents, others)).max())
    print(  # noqa: T201
        f"{name:<8} {wired['contacts']} contacts; {1e3 * chamfer:.2f} mm off over the wires, "
        f"{1e3 * other:.2f} in process; extents {1e3 * apart:.2f} mm apart",
        flush=True,
    )
    # The extents are printed alone: a press 0.3 mm deeper meets a curved wall millimetres farther out.
    assert abs(chamfer - other) < SAME_SURFACE
