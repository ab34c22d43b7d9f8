"""``touchstone cost vision`` on a small block: a curve, a picture, and what it refuses."""

import json
from pathlib import Path
from types import MappingProxyType

import pytest
import trimesh

from harness.authoring.vision import profiles as vision_profiles
from harness.authoring.vision.profiles import CellsSpec, VisionProfile
from harness.cli import invoke
from harness.objectfile.vision.network import NetworkSize

TINY = VisionProfile(
    CellsSpec(NetworkSize(width=8, octaves=2, turns=1, kind="osf-v"), cells=4, places=20_000, steps=60),
    pictures=2,
)


@pytest.fixture
def block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    profiles = {**vision_profiles.VISION_PROFILES, "tiny": TINY}
    monkeypatch.setattr(vision_profiles, "VISION_PROFILES", MappingProxyType(profiles))
    path = tmp_path / "block.ply"
    trimesh.creation.box([0.06, 0.05, 0.02]).export(path)
    return path


def cost(block: Path, *more: str) -> int:
    return invoke(
        ["cost", "vision", str(block), "--units", "m", "--profile", "tiny", "--views", "2", "--repeat", "2",
         "--size", "24", "--threads", "1", "--out", str(block.parent / "cost"), *more]
    )  # fmt: skip


@pytest.mark.slow  # curves of sound and touch stay
def test_a_knob_is_turned_and_its_curve_kept(block: Path, capsys: pytest.CaptureFixture[str]) -> None:
    knobs = ("--knob", "coverage", "--knob", "grid")
    assert cost(block, *knobs, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    out = block.parent / "cost"
    assert json.loads((out / "curve.json").read_text()) == answer
    assert Path(answer["picture"]).read_bytes().startswith(b"\x89PNG")
    points = answer["points"]
    turned = [
        point["levels"]["level"] for point in points if point["levels"]["knob"] == "coverage, sub-pixels"
    ]
    assert turned == ["1", "5", "7"]
    assert any(point["front"] for point in points)
    for point in points:
        assert point["seconds"] > 0.0
        assert 0.0 < point["error_grey"] < 150.0
        assert point["from_exact"]["psnr_db"] > 5.0
    before = {path: path.stat().st_mtime_ns for path in out.glob("*.onnx")}
    assert len(before) == 5
    assert cost(block, *knobs) == 0
    said = capsys.readouterr().out
    assert {path: path.stat().st_mtime_ns for path in out.glob("*.onnx")} == before
    for words in ("coverage", "grid, cells", "CPU, ms", "curve.png"):
        assert words in said


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--knob", "coverige"), "no knob 'coverige'; did you mean 'coverage'"),
        (("--knob", "termination"), "--knob termination: a ray ends where it meets the surface; there are"),
        (("--knob", "lead"), "there are default, coverage, rays, side, grid, width, told"),
        (("--profile", "fine"), "no profile 'fine' of vision"),
        (("--units", "yd"), "unknown unit 'yd'"),
        (("--size", "8"), "greater than or equal to 16"),
    ],
)
def test_what_cannot_be_measured_is_wrong_use(
    block: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], said: str
) -> None:
    assert cost(block, *more) == 2
    assert said in capsys.readouterr().err
    assert not (block.parent / "cost").exists()
