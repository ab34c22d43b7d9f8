"""``touchstone object build --only vision`` on a small block: what it writes, says, keeps and refuses."""

import json
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import trimesh

from harness.authoring.training import Report
from harness.authoring.vision import object_vision
from harness.authoring.vision import profiles as vision_profiles
from harness.authoring.vision.object_vision import choose_surface, without_seams
from harness.authoring.vision.profiles import CellsSpec, VisionProfile
from harness.authoring.vision.vision import CHECKPOINT, AuthoredVision, author_vision
from harness.basics.mesh import Mesh
from harness.cli import invoke
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import is_same_surface
from harness.objectfile.verify import verify
from harness.objectfile.vision.coverage import is_closed
from harness.objectfile.vision.network import NetworkSize
from harness.objectfile.vision.render import open_vision
from harness.objects.household import build
from harness.sim.light.appearance import Appearance

TINY = VisionProfile(
    CellsSpec(
        NetworkSize(width=8, octaves=2, turns=1, kind="osf-v"), cells=4, places=20_000, steps=60, batch=64
    ),
    pictures=2,
    side=24,
    samples=2,
)


@pytest.fixture
def block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    profiles = {**vision_profiles.VISION_PROFILES, "tiny": TINY}
    monkeypatch.setattr(vision_profiles, "VISION_PROFILES", MappingProxyType(profiles))
    path = tmp_path / "block.ply"
    box = trimesh.creation.box([0.06, 0.05, 0.02])
    box.visual.face_colors = [200, 60, 30, 255]
    box.export(path)
    return path


def built(block: Path, *more: str) -> int:
    out = str(block.parent / "object")
    return invoke(
        ["object", "build", str(block), "--units", "m", "--material", "wood", "--profile", "tiny",
         "--only", "vision", "--threads", "1", "--out", out, *more]
    )  # fmt: skip


@pytest.mark.slow  # a training; builds of touch and sound stay
def test_a_block_becomes_an_object_file_that_can_be_looked_at(
    block: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert built(block, "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["level"] == "osf-v"
    assert {"psnr_db", "ssim"} <= set(answer["errors"])
    assert {"mesh", "write"} < set(answer["seconds"])
    assert answer["seconds_in_all"] == pytest.approx(sum(answer["seconds"].values()))
    of = ObjectFile.open(block.parent / "object")
    assert sum(file.bytes for file in of.description.files) == answer["bytes"] + of.description.mesh.bytes
    assert all(check.passed for check in verify(of)), verify(of)
    assert not (of.folder / CHECKPOINT).exists()
    entry = of.description.vision
    assert entry is not None
    assert entry.network.measured["psnr_db"] == answer["errors"]["psnr_db"]
    assert entry.surface is None, "the file's faces are the object's"
    first = (of.folder / "object.json").read_bytes()
    assert built(block) == 0
    said = capsys.readouterr().out
    for words in ("on pictures never trained on", "psnr db", "seconds in all", "osf-v"):
        assert words in said
    assert (of.folder / "object.json").read_bytes() == first


def test_a_build_that_is_killed_keeps_what_there_was_and_goes_on(
    block: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    begun: list[Path] = []

    def killed(
        look: Appearance,
        profile: VisionProfile,
        seed: int,
        folder: Path,
        report: Report,
        threads: int | None,
    ) -> AuthoredVision:
        begun.append(folder)
        if len(begun) == 1:
            (folder / CHECKPOINT).write_bytes(b"half of it")
            raise KeyboardInterrupt
        assert (folder / CHECKPOINT).read_bytes() == b"half of it"
        (folder / CHECKPOINT).unlink()
        return author_vision(look, profile, seed, folder, report, threads)

    monkeypatch.setattr(object_vision, "author_vision", killed)
    assert built(block) == 130
    of = ObjectFile.open(block.parent / "object")
    assert of.description.vision is None
    assert of.mesh.faces.shape == (12, 3)
    (left,) = (check for check in verify(of) if not check.passed)
    assert "training" in left.said
    assert built(block) == 0
    assert open_vision(ObjectFile.open(of.folder), 1).entry.level == "osf-v"
    capsys.readouterr()


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--profile", "fine"), "no profile 'fine' of vision"),
        (("--material", "cheese"), "no material"),
        (("--wall", "3"), "--wall"),
        (("--units", "yd"), "unknown unit 'yd'"),
        (("--finish",), "--finish was removed: networks no longer learn from pictures; say --profile paper"),
    ],
)
def test_what_cannot_be_built_is_wrong_use(
    block: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], said: str
) -> None:
    assert built(block, *more) == 2
    assert said in capsys.readouterr().err
    assert not (block.parent / "object").exists()


def test_seams_are_closed_and_the_surface_stays_where_it_was() -> None:
    mug = build("mug", 8e-3)
    torn = Mesh(mug.corners.reshape(-1, 3), np.arange(3 * len(mug.faces)).reshape(-1, 3))
    assert not is_closed(torn)
    closed = without_seams(torn)
    assert is_closed(closed)
    assert len(closed.faces) == len(mug.faces)
    assert closed.face_areas.sum() == pytest.approx(torn.face_areas.sum(), rel=1e-12)
    np.testing.assert_array_equal(np.sort(closed.corners, axis=1), np.sort(mug.corners, axis=1))


def test_the_objects_own_mesh_is_drawn_along_where_it_is_the_same_surface() -> None:
    mug = build("mug", 8e-3)
    torn = Mesh(mug.corners.reshape(-1, 3), np.arange(3 * len(mug.faces)).reshape(-1, 3))
    assert is_same_surface(mug, torn)
    assert choose_surface(mug, torn) is None
    moved = Mesh(mug.vertices + 3e-4 * mug.diagonal, mug.faces)
    open_one = Mesh(mug.vertices, mug.faces[:-20])
    for other in (moved, open_one, build("mug", 4e-3)):
        assert not is_same_surface(mug, other)
        kept = choose_surface(mug, other)
        assert kept is not None
        np.testing.assert_allclose(kept.bounds, other.bounds)
