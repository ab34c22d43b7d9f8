"""A step is on disk whole or not at all, and reads back to the bit."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import RecordingDamaged, WrongUse
from harness.bench.reading import Channel, Reading
from harness.recording.codecs import decode_jpeg
from harness.recording.recording import Recording, RunHeader
from harness.recording.step_file import Step, StepRecord, read_step, write_step

OFFSET_NS = 1_790_000_000_123_456_789


def header(**changes: object) -> RunHeader:
    fields: dict[str, object] = {
        "experiment": "test",
        "scene": {},
        "station": {},
        "plan": {},
        "files": {},
        "versions": {},
        "seed": 1,
        "mock": None,
        "clock_offset_ns": OFFSET_NS,
        "created": "2026-01-01T00:00:00+00:00",
    }
    return RunHeader(**{**fields, **changes})  # type: ignore[arg-type]


def joints(values: list[list[float]], start: float = 10.0) -> Reading:
    channel = Channel("arm.joints", "rad", (6,), "float64", "", 500.0)
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + start, np.array(values))


def poses(values: list[list[float]]) -> Reading:
    channel = Channel("arm.base_from_flange", "m", (7,), "float64", "base", 500.0)
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + 1.0, np.array(values))


def wrenches(values: list[list[float]]) -> Reading:
    channel = Channel("arm.wrench", "N", (6,), "float64", "base")
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + 1.0, np.array(values))


def images(count: int) -> Reading:
    rng = np.random.default_rng(0)
    pictures = rng.integers(0, 255, (count, 12, 16, 3), dtype=np.uint8)
    jpegs = tuple(cv2.imencode(".jpg", picture)[1].tobytes() for picture in pictures)
    channel = Channel("gel.image", "count", (12, 16, 3), "uint8", "gel", 25.0)
    return Reading(
        channel, np.arange(count, dtype=np.float64) * 0.04, np.array([decode_jpeg(j) for j in jpegs]), jpegs
    )


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.lists(finite, min_size=7, max_size=7), min_size=1, max_size=4))
def test_numbers_read_back_to_the_bit(
    tmp_path_factory: pytest.TempPathFactory, rows: list[list[float]]
) -> None:
    path = tmp_path_factory.mktemp("steps") / "000.mcap"
    written = [joints([row[:6] for row in rows]), poses(rows), wrenches([row[:6] for row in rows])]
    record = StepRecord(Step(0, "press", {"depth_m": 1e-3}), {r.channel.name: r for r in written}, 1.5)
    write_step(path, record, OFFSET_NS)
    back = read_step(path, OFFSET_NS)
    assert back.step == record.step
    assert back.seconds == 1.5
    for reading in written:
        again = back.readings[reading.channel.name]
        assert again.channel == reading.channel
        assert again.values.tobytes() == reading.values.tobytes()
        assert np.abs(again.times - reading.times).max() < 1e-9


def test_an_image_is_recorded_as_the_jpeg_it_arrived_as(tmp_path: Path) -> None:
    reading = images(3)
    write_step(
        tmp_path / "000.mcap", StepRecord(Step(0, "press", {}), {"gel.image": reading}, 0.0), OFFSET_NS
    )
    again = read_step(tmp_path / "000.mcap", OFFSET_NS).readings["gel.image"]
    assert again.encoded == reading.encoded
    assert np.array_equal(again.values, reading.values)


def test_readings_refuse_to_be_written_to(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="read-only"):
        joints([[0.0] * 6]).values[0, 0] = 1.0


def test_not_a_number_never_reaches_the_disk(tmp_path: Path) -> None:
    record = StepRecord(Step(0, "press", {}), {"arm.wrench": wrenches([[float("nan")] * 6])}, 0.0)
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_step(tmp_path / "000.mcap", record, OFFSET_NS)
    assert not (tmp_path / "000.mcap").exists()


def test_a_run_is_not_overwritten(tmp_path: Path) -> None:
    Recording.create(tmp_path / "run", header())
    with pytest.raises(WrongUse, match="holds a run already"):
        Recording.create(tmp_path / "run", header())


def test_steps_are_committed_in_order_and_counted(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", header())
    for index in range(3):
        recording.commit(Step(index, "press", {"n": index}), [joints([[float(index)] * 6])], 0.1)
    again = Recording(tmp_path / "run")
    assert again.committed == 3
    assert [record.step.parameters["n"] for record in again.steps()] == [0, 1, 2]


def test_a_truncated_step_is_named(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", header())
    recording.commit(Step(0, "press", {}), [joints([[0.0] * 6] * 50)], 0.1)
    path = tmp_path / "run" / "steps" / "000.mcap"
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(RecordingDamaged, match=r"000\.mcap"):
        Recording(tmp_path / "run").steps()


def test_a_missing_step_is_named(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", header())
    for index in range(3):
        recording.commit(Step(index, "press", {}), [joints([[0.0] * 6])], 0.1)
    (tmp_path / "run" / "steps" / "001.mcap").unlink()
    with pytest.raises(RecordingDamaged, match="step 1 is missing"):
        _ = recording.committed


def test_a_future_schema_is_refused(tmp_path: Path) -> None:
    Recording.create(tmp_path / "run", header())
    path = tmp_path / "run" / "run.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema": 99}))
    with pytest.raises(RecordingDamaged, match="schema 99"):
        Recording(tmp_path / "run")


WRITER = """
import sys, numpy as np
from pathlib import Path
from harness.recording.recording import Recording
from harness.bench.reading import Channel, Reading
from harness.recording.step_file import Step
recording = Recording(Path(sys.argv[1]))
channel = Channel("arm.joints", "rad", (6,), "float64")
index = recording.committed
while True:
    values = np.full((200, 6), float(index))
    recording.commit(Step(index, "press", {}), [Reading(channel, np.arange(200.0), values)], 0.0)
    index += 1
"""


def test_kill_at_any_moment_leaves_only_whole_steps(tmp_path: Path) -> None:
    Recording.create(tmp_path / "run", header())
    for pause in (0.35, 0.41, 0.47, 0.53):
        process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(WRITER), str(tmp_path / "run")])
        time.sleep(pause)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        for index, record in enumerate(Recording(tmp_path / "run").steps()):
            assert (record.readings["arm.joints"].values == index).all()
