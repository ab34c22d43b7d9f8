"""Files written at commit bc239515 still open, and its recordings still give the same estimates.

``tests/samples/written_at_bc239515`` holds a short recording of each experiment, made on the mocked bench in
process (the files that all three share are kept once, in ``common``), an ObjectFile with a sound, a file of
markers, a station and a scene. The shipped ObjectFiles, stations and scenes are of that commit too.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.api import answer
from harness.bench.scene import load_scene
from harness.bench.station_file import load_station
from harness.objectfile.file import ObjectFile
from harness.objectfile.verify import verify
from harness.sim.gel.markers import read_markers

SAMPLES = Path(__file__).parents[1] / "samples" / "written_at_bc239515"


def answered(name: str, folder: Path, *levels: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """The estimates that bc239515 gave by sense, and those of today."""
    recordings = SAMPLES / "recordings"
    shutil.copytree(recordings / name, folder)
    shutil.copytree(recordings / "common", folder, dirs_exist_ok=True)
    before: dict[str, Any] = json.loads((recordings / name / "answered.json").read_text())
    now: dict[str, Any] = answer(folder, levels)["estimates"]
    assert list(now) == list(before)
    return before, now


def test_a_recorded_contact_localization_is_answered_as_before(tmp_path: Path) -> None:
    before, now = answered("contact", tmp_path / "run")
    for sense, found in before.items():
        # Modes are solved on tetrahedra that fTetWild fills anew on every machine; six fillings moved the
        # answers from sound by up to 0.12 mm. Touch uses none.
        within = 1e-6 if sense == "touch" else 5e-4
        assert now[sense]["position_m"] == pytest.approx(found["position_m"], abs=within), sense
        assert now[sense]["credible90_m"] == pytest.approx(found["credible90_m"], abs=within), sense


def test_a_recorded_scale_estimation_is_answered_as_before(tmp_path: Path) -> None:
    before, now = answered("size", tmp_path / "run")
    for sense, found in before.items():
        assert now[sense]["size_m"] == pytest.approx(found["size_m"], abs=1e-3), sense
        assert now[sense]["low90_m"] < found["size_m"] < now[sense]["high90_m"], sense


def test_a_recorded_shape_reconstruction_is_answered(tmp_path: Path) -> None:
    """Every sense answers; the method has become another one since, so its numbers are not held."""
    before, now = answered("shape", tmp_path / "run", "shape.method=family-coarse")
    for sense in before:
        assert 0.0 < now[sense]["deviation_m"] < 0.05, sense


def test_an_objectfile_still_passes_its_own_tests() -> None:
    checks = verify(ObjectFile.open(SAMPLES / "objectfile"))
    assert [check.said for check in checks if not check.passed] == []
    assert len(checks) > 5


def test_files_of_a_bench_still_open() -> None:
    station, scene = load_station(SAMPLES / "bench.toml"), load_scene(SAMPLES / "scene.toml")
    assert station.camera is not None
    assert station.camera.rows == 120
    assert scene.object.material == "ceramic"
    assert len(read_markers(SAMPLES / "markers.json").dots) == 70
