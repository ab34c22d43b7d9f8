"""A truth file is damaged in a thousand ways: it reads back unchanged, or is refused in one sentence."""

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import DataRefused
from harness.bench.scene import scene_from_options
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.experiment.truth import Truth, read_truth, truth_or_notes, truth_paths
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, create_run, station_calibration
from harness.recording.truth_file import read_truth_file, write_truth_file
from mocks.in_process.bench import in_process_bench


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A run whose mocked world wrote a truth with two contacts."""
    folder = tmp_path_factory.mktemp("truth") / "run"
    scene, station = scene_from_options("builtin:mug"), load_station(station_path("mock"))
    mesh, gel = known_object(scene).mesh, station_calibration(station)
    mock = {"gap": "default"}
    recording = create_run(folder, "contact-localization", scene, station, mesh, gel, {}, 3, mock)
    files = RunFiles(recording)
    bench = in_process_bench(files.scene, files.station, files.context)
    for step in range(2):
        bench.mark(step, 0)
    assert {path.name for path in truth_paths(recording) if path.exists()} == {
        "run.truth.json",
        "run.truth.npz",
    }
    return recording


@pytest.fixture
def copy(run: Recording, tmp_path: Path) -> Recording:
    shutil.copytree(run.folder, tmp_path / "run")
    for path in truth_paths(run):
        shutil.copy(path, tmp_path / path.name)
    return Recording(tmp_path / "run")


def numbers(truth: Truth | None) -> Any:
    """All values of a truth, comparable to the bit."""
    assert truth is not None
    assert truth.surface is not None
    points = {step: point.tolist() for step, point in truth.points.items()}
    return points, dict(truth.differences), truth.surface.vertices.tolist(), truth.surface.faces.tolist()


def flipped(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << draw.randrange(8))]) + data[at + 1 :]


def cut(data: bytes, draw: random.Random) -> bytes:
    return data[: draw.randrange(len(data))]


def without_a_line(data: bytes, draw: random.Random) -> bytes:
    lines = data.split(b"\n")
    del lines[draw.randrange(len(lines) - 1)]
    return b"\n".join(lines)


def with_other_value(data: bytes, draw: random.Random) -> bytes:
    """The file with one JSON value replaced, in the layout of the original."""
    tree = json.loads(data)
    places: list[tuple[Any, Any]] = []

    def collect(node: Any) -> None:
        for key in node if isinstance(node, dict) else range(len(node)):
            places.append((node, key))
            if isinstance(node[key], dict | list):
                collect(node[key])

    collect(tree)
    node, key = draw.choice(places)
    node[key] = draw.choice([None, -1, 1, 2, 1e300, "x", [], {}, True, 0.1, [[0.0, 0.0, 0.0]]])
    return json.dumps(tree, indent=1).encode() + b"\n"


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    flipped,
    cut,
    without_a_line,
    with_other_value,
)


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_truth_is_refused_in_one_sentence_or_reads_unchanged(
    copy: Recording, damage: Callable[[bytes, random.Random], bytes]
) -> None:
    path, right = copy.truth_path, numbers(read_truth(copy))
    whole, draw, refused = path.read_bytes(), random.Random(51), 0
    for _ in range(250):
        path.write_bytes(damage(whole, draw))
        truth, notes = truth_or_notes(copy)
        if truth is None:
            (note,) = notes
            assert str(path) in note
            assert "scores" in note
            assert "\n" not in note
            refused += 1
        else:
            assert numbers(truth) == right
            assert notes == ()
    assert refused > 200


def test_a_damaged_surface_is_refused_in_one_sentence(copy: Recording) -> None:
    path, draw = truth_paths(copy)[1], random.Random(51)
    whole = path.read_bytes()
    for _ in range(50):
        path.write_bytes(draw.choice((flipped, cut))(whole, draw))
        truth, (note,) = truth_or_notes(copy)
        assert truth is None
        assert f"{path} is damaged" in note


def test_the_truth_of_another_run_is_refused(copy: Recording) -> None:
    for change in ({"run_id": "0" * 32}, {"seed": 4}):
        write_truth_file(copy.truth_path, {**read_truth_file(truth_paths(copy)[0]), **change})
        truth, (note,) = truth_or_notes(copy)
        assert truth is None
        assert "was written for another run" in note


def old_truth(fields: dict[str, Any]) -> dict[str, Any]:
    """The fields as an earlier version wrote them."""
    kept = ("schema", "seed", "base_from_object", "differences", "contacts")
    return {**{key: fields[key] for key in kept}, "schema": 1}


def test_a_new_run_takes_no_truth_without_a_checksum(copy: Recording) -> None:
    copy.truth_path.write_text(json.dumps(old_truth(read_truth_file(copy.truth_path))))
    truth, (note,) = truth_or_notes(copy)
    assert truth is None
    assert "was written for another run" in note


def test_an_old_run_reads_its_truth_without_a_checksum_and_says_so(
    copy: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = numbers(read_truth(copy))
    copy.truth_path.write_text(json.dumps(old_truth(read_truth_file(copy.truth_path))))
    object.__setattr__(copy.header, "run_id", "")
    truth, (note,) = truth_or_notes(copy)
    assert numbers(truth) == right
    assert "checksum" in note
    broken = old_truth(json.loads(copy.truth_path.read_text()))
    broken["differences"] = {**broken["differences"], "longest_side_m": "x"}
    copy.truth_path.write_text(json.dumps(broken))
    with pytest.raises(DataRefused, match="longest side is 'x' m"):
        read_truth(copy)


def test_a_resumed_world_keeps_the_contacts_of_its_own_run_alone(copy: Recording) -> None:
    files = RunFiles(copy)
    before = read_truth(copy)
    assert before is not None
    in_process_bench(files.scene, files.station, files.context).mark(2, 0)
    after = read_truth(copy)
    assert after is not None
    assert sorted(after.points) == [0, 1, 2]
    assert np.array_equal(after.points[1], before.points[1])
    copy.truth_path.write_bytes(copy.truth_path.read_bytes()[:-9])
    in_process_bench(files.scene, files.station, files.context).mark(2, 0)
    damaged = read_truth(copy)
    assert damaged is not None
    assert sorted(damaged.points) == [2]
