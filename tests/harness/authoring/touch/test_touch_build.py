"""``touchstone object build --only touch`` on a small block: what it writes, says, keeps and refuses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from harness.authoring.touch.data import choose_nodes
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.touch.touch import COARSENED, SPACINGS, PatchSpec, patch_bytes, spaced_codes
from harness.basics.errors import WrongUse
from harness.bench.sensor import GELSIGHT_R15
from harness.cli import invoke
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.verify import verify
from harness.objects.household import build as named_object
from harness.sim.gel.height_map import RasterMesh


@pytest.fixture
def block(tmp_path: Path) -> Path:
    path = tmp_path / "block.stl"
    trimesh.creation.box([0.06, 0.05, 0.02]).export(path)
    return path


def build(block: Path, *more: str) -> int:
    out = str(block.parent / "object")
    return invoke(
        ["object", "build", str(block), "--units", "m", "--material", "wood", "--profile", "smoke",
         "--only", "touch", "--out", out, *more]
    )  # fmt: skip


def test_a_block_becomes_an_object_file_that_can_be_touched(
    block: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert build(block, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["bytes"] <= 4e6
    assert set(answer["seconds"]) == {
        "mesh", "codes", "measure trained_places", "measure unseen_places", "measure any_press", "write",
    }  # fmt: skip
    for kind, median, tenth in (
        ("trained_places", 40.0, 30.0),
        ("unseen_places", 34.0, 24.0),
        ("any_press", 34.0, 24.0),
    ):
        rows = answer["errors"][kind]
        assert rows["level"]["psnr_db_median"] > median
        assert rows["level"]["psnr_db_p10"] > tenth
        assert rows["level"]["psnr_db_median"] > rows["background"]["psnr_db_median"]
    of = ObjectFile.open(block.parent / "object")
    assert all(check.passed for check in verify(of)), verify(of)
    assert open_touch(of).entry.gel.rows == 120
    first = (of.folder / "touch.onnx").read_bytes()
    assert build(block) == 0
    said = capsys.readouterr().out
    assert "untouched gel" in said
    assert "psnr db p10" in said
    assert (of.folder / "touch.onnx").read_bytes() == first
    assert invoke(["object", "info", str(of.folder)]) == 0
    assert "0.5 to 2 mm deep" in capsys.readouterr().out


def test_an_unknown_profile_of_touch_is_wrong_use(block: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert build(block, "--profile", "small") == 2
    assert "'small'" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name",
    # The larger ones, for which the pixels have to grow, and the smallest.
    [
        "pitcher",
        "tray",
        "wrench",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("mug", "bowl", "plate")),
    ],
)
def test_the_smallest_profile_has_room_for_every_built_in_object(name: str) -> None:
    """The pixels grow only where no distance of nodes leaves room for the profile's own."""
    raster, spec = RasterMesh(named_object(name)), touch_profile("smoke").codes
    coded, spacing = spaced_codes(raster, GELSIGHT_R15, spec, 0)
    pitch = coded.patches.pitch
    patch = PatchSpec(spacing, pitch)
    assert len(coded.nodes) * patch_bytes(GELSIGHT_R15, patch) <= spec.most_bytes
    coarsened = [each * spec.pitch for each in COARSENED]
    assert pitch in coarsened
    if pitch > coarsened[0]:
        finer = PatchSpec(SPACINGS[-1], coarsened[coarsened.index(pitch) - 1])
        nodes = choose_nodes(raster.mesh, SPACINGS[-1], 0)
        assert len(nodes) * patch_bytes(GELSIGHT_R15, finer) > spec.most_bytes


def test_an_object_with_no_room_for_its_touch_is_told_to_take_a_larger_file() -> None:
    spec = replace(touch_profile("smoke").codes, most_bytes=10_000)
    with pytest.raises(WrongUse, match=r"cm\^2.*0\.01 MB.*1\.2 mm"):
        spaced_codes(RasterMesh(named_object("wrench")), GELSIGHT_R15, spec, 0)
