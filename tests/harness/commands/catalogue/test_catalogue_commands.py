"""``touchstone catalogue``: check, build, status and page, on blocks that build in seconds."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.cli import invoke
from harness.commands.catalogue.build import Throughput
from tests.samples.tiny_catalogue import block


def answered(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


@pytest.fixture
def catalogue(tmp_path: Path) -> Path:
    """Two blocks, a file that is no mesh, and a row of no material."""
    for name, length in (("one", 0.08), ("two", 0.09)):
        block(tmp_path, name, length)
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    path = tmp_path / "objects.csv"
    path.write_text("name,material,units\none,wood,m\ntwo,steel,m\nbad,steel,m\nnone,cheese,m\n")
    return path


def test_the_published_catalogue_is_checked_without_meshes(
    shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = shared_data / "meshes" / "objectfolder" / "objects.csv"
    assert invoke(["catalogue", "check", str(path), "--material", "glass", "--json"]) == 1
    answer = answered(capsys)
    assert answer["materials"] == {"glass": 26}
    assert len(answer["excluded"]) == 26
    assert "--meshes" in answer["excluded"][0]["reason"]


def test_check_says_what_can_be_built_and_why_the_rest_cannot(
    catalogue: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["catalogue", "check", str(catalogue), "--json"]) == 0
    answer = answered(capsys)
    assert {each["name"]: each["verdict"] for each in answer["intake"]} == {
        "one": "ready",
        "two": "ready",
        "bad": "excluded",
    }
    assert answer["intake"][0]["mass_kg"] == pytest.approx(0.08 * 0.05 * 0.02 * 750.0, rel=0.02)
    assert [row["name"] for row in answer["excluded"]] == ["none"]
    assert invoke(["catalogue", "check", str(catalogue)]) == 0
    assert "2 ready, 1 excluded" in capsys.readouterr().out


def test_build_status_page_and_a_second_build(catalogue: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = catalogue.parent / "built"
    arguments = ["--out", str(out), "--profile", "smoke", "--senses", "touch", "--workers", "1"]
    build = ["catalogue", "build", str(catalogue), *arguments]
    assert invoke([*build, "--json"]) == 1
    shown = capsys.readouterr()
    answer = json.loads(shown.out)
    assert (answer["built"], answer["stages_made"]) == (2, {"touch": 2})
    assert [(each["name"], each["outcome"]) for each in answer["failed"]] == [("bad", "refused")]
    assert "3 of 3 objects, 1 failed" in shown.err
    assert "an hour" in shown.err

    assert invoke([*build, "--json"]) == 1
    answer = answered(capsys)
    assert (answer["standing"], answer["built"], answer["stages_made"]) == (2, 0, {})
    assert invoke(build) == 1
    assert "2 of 3 objects" in capsys.readouterr().out

    assert invoke(["catalogue", "status", str(out), "--json"]) == 1
    answer = answered(capsys)
    assert answer["counts"] == {"built": 2, "refused": 1}
    assert answer["objects"][0]["quality"]["unseen_places_psnr_db_median"] > 20.0
    assert invoke(["catalogue", "status", str(out)]) == 1
    assert "bad: refused" in capsys.readouterr().out

    assert invoke(["catalogue", "page", str(out), "--json"]) == 0
    page = Path(answered(capsys)["page"]).read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "bad.stl" in page
    assert "cheese" in page
    assert "http" not in page


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        (["--senses", "smell"], "--senses smell"),
        (["--senses", ""], "makes nothing"),
        (["--profile", "fine"], "no profile 'fine'"),
        (["--runner", "slurm"], "no runner 'slurm'"),
        (["--address", "auto"], "is of --runner ray"),
        (["--time-limit", "0s"], "above zero"),
        (["--material", "cheese"], "no material 'cheese'"),
    ],
)
def test_what_cannot_be_built_is_wrong_use(
    catalogue: Path, capsys: pytest.CaptureFixture[str], more: list[str], reason: str
) -> None:
    assert (
        invoke(["catalogue", "build", str(catalogue), "--out", str(catalogue.parent / "built"), *more]) == 2
    )
    assert reason in capsys.readouterr().err
    assert not (catalogue.parent / "built").exists()


@pytest.mark.parametrize("command", ["status", "page"])
def test_a_folder_without_a_build_is_wrong_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert invoke(["catalogue", command, str(tmp_path)]) == 2
    assert "build.json" in capsys.readouterr().err


def test_throughput_and_time_left_follow_what_was_done() -> None:
    now = [0.0]
    throughput = Throughput(10, lambda: now[0])
    assert throughput.sentence() == "0 of 10 objects"
    now[0] = 120.0
    throughput.count(built=True)
    throughput.count(built=False)
    assert (throughput.hourly, throughput.seconds_left) == (60.0, 480.0)
    assert throughput.sentence() == "2 of 10 objects, 1 failed, 60 an hour, 8 min left"
