"""``touchstone object render``: what it writes, says and refuses."""

import json
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from harness.authoring.audio.data import split_nodes
from harness.basics.arrays import FloatArray
from harness.cli import invoke
from harness.objectfile.audio.audio import open_audio
from harness.objectfile.audio.blow import HammerBlow
from harness.objectfile.audio.strike import place_near, strike
from harness.objectfile.file import ObjectFile
from harness.sim.sound.modal_sound import impulse_response
from tests.samples.object_bench import MODES, egg_file


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return egg_file(tmp_path_factory.mktemp("render") / "egg").folder


def rendered(
    folder: Path, out: Path, capsys: pytest.CaptureFixture[str], *more: str, code: int = 0
) -> dict[str, Any]:
    arguments = ["object", "render", "audio", str(folder), "--out", str(out / "a.wav"), "--json", *more]
    assert invoke(arguments) == code
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def samples(path: Path) -> FloatArray:
    with wave.open(str(path), "rb") as file:
        parts = np.frombuffer(file.readframes(file.getnframes()), np.uint8).reshape(-1, 3).astype(np.int64)
    unsigned = parts @ [1, 256, 65536]
    return np.where(unsigned >= 1 << 23, unsigned - (1 << 24), unsigned) / 2.0**23


@pytest.mark.parametrize("level", ["network", "table"])
def test_the_file_holds_the_sum_of_the_modes_that_are_listed(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], level: str
) -> None:
    answer = rendered(
        folder,
        tmp_path,
        capsys,
        "--vertex",
        "3",
        "--force",
        "0",
        "0",
        "-2",
        "--level",
        level,
        "--seconds",
        "1",
    )
    found = samples(tmp_path / "a.wav") * answer["wav"]["full_scale"]
    assert len(found) == answer["samples"] == 44_100
    audio = open_audio(ObjectFile.open(folder), "network" if level == "network" else "table")
    gains = audio.at(np.array([answer["point_m"]]))[0] @ [0.0, 0.0, -2.0]
    times = np.arange(len(found)) / 44_100.0
    wanted = gains @ impulse_response(times, audio.frequencies, audio.dampings)
    assert np.abs(found - wanted).max() <= 1e-5 * answer["peak"]
    assert answer["modes"] == len(answer["frequencies_hz"]) == MODES
    assert answer["impulse_ns"] == 2.0
    assert 2.0 * np.array(answer["gains_per_sqrt_kg"]) == pytest.approx(gains)
    assert answer["error_estimate"]["synthesis_db"] < -100.0
    assert set(answer["seconds"]) == {"load", "gains", "synthesis"}


def test_the_force_goes_inward_unless_another_is_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = rendered(folder, tmp_path, capsys, "--at", "0.139", "-0.02", "0.05")
    assert answer["moved_m"] == pytest.approx(1e-3, rel=0.1)
    assert answer["force_direction"] == pytest.approx([-value for value in answer["normal"]])
    assert answer["normal"][0] > 0.99
    assert answer["impulse_ns"] == pytest.approx(1.0)


def test_a_hammer_says_its_force_and_its_time(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nylon = rendered(folder, tmp_path, capsys, "--vertex", "3", "--hammer", "nylon", "--speed", "0.5m/s")
    assert 0.1e-3 < nylon["contact_s"] < 1e-3
    heavy = rendered(
        folder, tmp_path, capsys, "--vertex", "3", "--hammer", "nylon", "--speed", "0.5m/s", "--hammer-mass",
        "20g", "--tip-radius", "4mm",
    )  # fmt: skip
    assert heavy["contact_s"] > 1.5 * nylon["contact_s"]
    timed = rendered(
        folder, tmp_path, capsys, "--vertex", "3", "--contact-time", "0.4ms", "--force", "0", "0", "5"
    )
    assert timed["contact_s"] == 0.4e-3
    assert timed["peak_force_n"] == pytest.approx(5.0)
    assert 0.5 < timed["impulse_ns"] / (5.0 * 0.4e-3) < 0.6


def test_a_distance_makes_it_a_pressure(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    near = rendered(folder, tmp_path, capsys, "--vertex", "3", "--distance", "0.5m")
    far = rendered(folder, tmp_path, capsys, "--vertex", "3", "--distance", "1m")
    assert near["unit"] == near["wav"]["unit"] == "Pa"
    assert near["peak"] == pytest.approx(2.0 * far["peak"], rel=1e-4)


def test_modes_that_have_no_room_in_the_rate_are_said(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = rendered(folder, tmp_path, capsys, "--vertex", "3", "--rate", "8000")
    assert answer["left_out_hz"]
    assert min(answer["left_out_hz"]) >= 4000.0 > max(answer["frequencies_hz"])
    assert answer["modes"] + len(answer["left_out_hz"]) == MODES
    arguments = ["--vertex", "3", "--rate", "8000", "--out", str(tmp_path / "b.wav")]
    assert invoke(["object", "render", "audio", str(folder), *arguments]) == 0
    captured = capsys.readouterr()
    assert "8000" in captured.err
    assert "full scale" in captured.out


def test_a_picture_is_written_beside_the_sound(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "deeper.one.png"
    answer = rendered(
        folder, tmp_path, capsys, "--vertex", "3", "--picture", str(picture), "--seconds", "0.5"
    )
    assert answer["picture"] == str(picture)
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert "picture" in answer["seconds"]


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        ((), 2, "either --at X Y Z in metres, or --vertex N"),
        (("--vertex", "1", "--at", "0.14", "-0.02", "0.05"), 2, "either --at X Y Z"),
        (("--vertex", "-1"), 1, "there is no vertex -1"),
        (("--vertex", "642"), 1, "say 0 to 641"),
        (("--at", "140", "-20", "50"), 1, "the limit is 2 mm"),
        (("--at", "nan", "0", "0"), 2, "finite number of metres"),
        (("--vertex", "1", "--force", "0", "0", "0"), 2, "strikes nothing"),
        (("--vertex", "1", "--force", "0", "nan", "0"), 2, "not three finite numbers"),
        (("--vertex", "1", "--rate", "0"), 2, "say a whole number above 0"),
        (("--vertex", "1", "--rate", "nan"), 2, "say a whole number above 0"),
        (("--vertex", "1", "--seconds", "0"), 2, "say a length above 0 s"),
        (("--vertex", "1", "--seconds", "nan"), 2, "say a length above 0 s"),
        (("--vertex", "1", "--level", "exact"), 2, "--level takes network, or table"),
        (("--vertex", "1", "--hammer", "golden"), 2, "no hammer 'golden'"),
        (("--vertex", "1", "--speed", "1m/s"), 2, "say --hammer as well"),
        (("--vertex", "1", "--impulse", "--hammer", "steel"), 2, "one or the other"),
        (("--vertex", "1", "--contact-time", "1ms", "--tip-radius", "3mm"), 2, "one or the other"),
        (("--vertex", "1", "--contact-time", "1"), 2, "--contact-time: '1' has no unit"),
        (("--vertex", "1", "--distance", "0m"), 2, "hears nothing"),
        (("--vertex", "1", "--full-scale", "1e-9"), 2, "cannot hold a sound"),
        (("--vertex", "1", "--picture", "a.jpg"), 2, "let its name end in .png"),
    ],
)
def test_what_cannot_be_rendered_is_one_sentence(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    more: tuple[str, ...],
    code: int,
    said: str,
) -> None:
    assert said in rendered(folder, tmp_path, capsys, *more, code=code)["error"]
    assert not (tmp_path / "a.wav").exists()


def test_an_object_without_what_is_asked_for_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    silent = tmp_path / "silent"
    silent.mkdir()
    described = json.loads((folder / "object.json").read_text())
    described["audio"] = None
    (silent / "object.json").write_text(json.dumps(described))
    error = rendered(silent, tmp_path, capsys, "--vertex", "0", code=1)["error"]
    assert "`touchstone object build --only audio`" in error
    arguments = ["object", "render", "vision", str(folder), "--out", str(tmp_path / "a.png"), "--json"]
    assert invoke(arguments) == 1
    assert "`touchstone object build --only vision`" in json.loads(capsys.readouterr().out)["error"]
    arguments = ["object", "render", "smell", str(folder), "--out", str(tmp_path / "a.wav"), "--json"]
    assert invoke(arguments) == 2
    assert "No such command 'smell'" in json.loads(capsys.readouterr().out)["error"]


def test_a_built_network_and_its_table_differ_by_what_the_file_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the nodes that were held out, struck along x, y and z."""
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))
    trimesh.creation.box([0.2, 0.05, 0.02]).export(tmp_path / "block.stl")
    assert invoke(
        ["object", "build", str(tmp_path / "block.stl"), "--units", "m", "--material", "wood",
         "--edge", "15mm", "--profile", "smoke", "--modes", "12", "--out", str(tmp_path / "object"), "--json"]
    ) == 0  # fmt: skip
    errors = json.loads(capsys.readouterr().out)["errors"]["network"]
    of = ObjectFile.open(tmp_path / "object")
    network, table = open_audio(of, "network"), open_audio(of, "table")
    nodes = table.as_modes().points
    held_out = nodes[split_nodes(len(nodes), seed=0).held_out]

    def gains(level: Any, point: FloatArray) -> FloatArray:
        place = place_near(level.surface, point, level.most)
        sounds = [strike(level, place, HammerBlow.instant(along), 0.05, 44_100.0) for along in np.eye(3)]
        return np.array([sound.gains for sound in sounds])

    apart = [
        np.linalg.norm(gains(network, point) - (known := gains(table, point))) / np.linalg.norm(known)
        for point in held_out
    ]
    assert np.median(apart) == pytest.approx(errors["gain_error_median"], rel=0.1, abs=1e-3)
    assert np.quantile(apart, 0.95) == pytest.approx(errors["gain_error_p95"], rel=0.1, abs=1e-3)
