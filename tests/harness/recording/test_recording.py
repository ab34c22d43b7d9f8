"""A step is on disk whole or not at all, and reads back to the bit."""

import errno
import json
import os
import struct
import subprocess
import sys
import textwrap
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import RecordingDamaged, WrongUse
from harness.bench.device import Reading
from harness.recording import step_file
from harness.recording.observation import BARE_IMAGE, IMAGE
from harness.recording.recording import Recording
from harness.recording.step_file import Step, StepRecord, read_step, write_step
from tests.samples.recorded_step import OFFSET_NS, images, joints, poses, sample_header, wrenches

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


@pytest.mark.parametrize("name", ["gel.image", IMAGE, BARE_IMAGE])
def test_an_image_is_recorded_as_the_jpeg_it_arrived_as(tmp_path: Path, name: str) -> None:
    reading = named(images(3), name)
    write_step(tmp_path / "000.mcap", StepRecord(Step(0, "press", {}), {name: reading}, 0.0), OFFSET_NS)
    again = read_step(tmp_path / "000.mcap", OFFSET_NS).readings[name]
    assert again.encoded == reading.encoded
    assert np.array_equal(again.values, reading.values)


def test_an_image_of_the_bare_bench_that_was_written_as_numbers_still_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reading = named(images(1), BARE_IMAGE)
    monkeypatch.setattr(step_file, "codec_of", lambda _: step_file._NUMBERS)
    write_step(tmp_path / "000.mcap", StepRecord(Step(0, "look", {}), {BARE_IMAGE: reading}, 0.0), OFFSET_NS)
    monkeypatch.undo()
    again = read_step(tmp_path / "000.mcap", OFFSET_NS).readings[BARE_IMAGE]
    assert np.array_equal(again.values, reading.values)
    assert again.encoded == ()


def named(reading: Reading, name: str) -> Reading:
    return replace(reading, channel=replace(reading.channel, name=name))


@pytest.mark.parametrize("side", [7_000, 30_000])
def test_an_image_that_states_more_pixels_than_a_camera_has_is_not_unpacked(
    tmp_path: Path, side: int
) -> None:
    vast = bytearray(images(1).encoded[0])
    at = vast.index(b"\xff\xc0")
    vast[at + 5 : at + 9] = struct.pack(">HH", side, side)
    reading = replace(images(1), encoded=(bytes(vast),))
    record = StepRecord(Step(0, "press", {}), {"gel.image": reading}, 0.0)
    write_step(tmp_path / "000.mcap", record, OFFSET_NS)
    tracemalloc.start()
    with pytest.raises(RecordingDamaged, match="decode"):
        read_step(tmp_path / "000.mcap", OFFSET_NS)
    assert tracemalloc.get_traced_memory()[1] < 1e7
    tracemalloc.stop()


def test_a_step_is_decoded_once_and_a_changed_file_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    decoded, counted = step_file._decoded, list[int]()

    def count(data: bytes, clock_offset_ns: int) -> StepRecord:
        counted.append(clock_offset_ns)
        return decoded(data, clock_offset_ns)

    monkeypatch.setattr(step_file, "_RECENT", step_file._RecentSteps())
    monkeypatch.setattr(step_file, "_decoded", count)
    path, reading = tmp_path / "000.mcap", joints([[0.0] * 6])
    record = StepRecord(Step(0, "press", {"depth_m": 1e-3}), {"arm.joints": reading}, 1.5)
    write_step(path, record, OFFSET_NS)
    first = read_step(path, OFFSET_NS)
    vars(first)["readings"].clear()
    vars(first.step)["parameters"].clear()
    assert read_step(path, OFFSET_NS).step == record.step
    assert set(read_step(path, OFFSET_NS).readings) == {"arm.joints"}
    assert len(counted) == 1
    write_step(path, replace(record, seconds=2.5), OFFSET_NS)
    assert read_step(path, OFFSET_NS).seconds == 2.5
    assert len(counted) == 2


def test_memory_of_decoded_steps_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recent = step_file._RecentSteps()
    monkeypatch.setattr(step_file, "_RECENT", recent)
    monkeypatch.setattr(step_file, "MAX_RECENT_BYTES", 1000)
    for index in range(5):
        path = tmp_path / f"{index:03d}.mcap"
        record = StepRecord(Step(index, "press", {}), {"arm.joints": joints([[0.0] * 6] * 10)}, 0.0)
        write_step(path, record, OFFSET_NS)
        read_step(path, OFFSET_NS)
    assert [step.step.index for step in recent._steps.values()] == [4]


def test_readings_refuse_to_be_written_to(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="read-only"):
        joints([[0.0] * 6]).values[0, 0] = 1.0


def test_not_a_number_never_reaches_the_disk(tmp_path: Path) -> None:
    record = StepRecord(Step(0, "press", {}), {"arm.wrench": wrenches([[float("nan")] * 6])}, 0.0)
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_step(tmp_path / "000.mcap", record, OFFSET_NS)
    assert not (tmp_path / "000.mcap").exists()


def test_a_run_is_not_overwritten(tmp_path: Path) -> None:
    Recording.create(tmp_path / "run", sample_header())
    with pytest.raises(WrongUse, match="--resume"):
        Recording.create(tmp_path / "run", sample_header())


def test_steps_are_committed_in_order_and_counted(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    for index in range(3):
        recording.commit(Step(index, "press", {"n": index}), [joints([[float(index)] * 6])], 0.1)
    again = Recording(tmp_path / "run")
    assert again.committed == 3
    assert [record.step.parameters["n"] for record in again.steps()] == [0, 1, 2]


def test_a_truncated_step_is_named(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    recording.commit(Step(0, "press", {}), [joints([[0.0] * 6] * 50)], 0.1)
    path = tmp_path / "run" / "steps" / "000.mcap"
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(RecordingDamaged, match=r"000\.mcap"):
        Recording(tmp_path / "run").steps()


def test_a_missing_step_is_named(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    for index in range(3):
        recording.commit(Step(index, "press", {}), [joints([[0.0] * 6])], 0.1)
    (tmp_path / "run" / "steps" / "001.mcap").unlink()
    with pytest.raises(RecordingDamaged, match="step 1 "):
        _ = recording.committed


def test_a_future_schema_is_refused(tmp_path: Path) -> None:
    Recording.create(tmp_path / "run", sample_header())
    path = tmp_path / "run" / "run.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema": 99}))
    with pytest.raises(RecordingDamaged, match="schema 99"):
        Recording(tmp_path / "run")


WRITER = """
import sys, numpy as np
from pathlib import Path
from harness.recording.recording import Recording
from harness.bench.device import Channel, Reading
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
    recording = Recording.create(tmp_path / "run", sample_header())
    for pause in (0.0, 0.007, 0.019):
        before = recording.committed
        process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(WRITER), str(tmp_path / "run")])
        try:
            while recording.committed == before and process.poll() is None:
                time.sleep(0.001)
            time.sleep(pause)
        finally:
            process.kill()
            process.wait()
        assert recording.committed > before
        for index, record in enumerate(Recording(tmp_path / "run").steps()):
            assert (record.readings["arm.joints"].values == index).all()


def test_a_step_that_fails_to_flush_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())

    path = tmp_path / "run" / "steps" / "000.mcap"

    def full(descriptor: int) -> None:
        assert not path.exists()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*000\.mcap'"):
        recording.commit(Step(0, "press", {}), [joints([[0.0] * 6])], 0.1)
    assert list((tmp_path / "run" / "steps").iterdir()) == []


def test_steps_are_committed_in_order_alone(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    recording.commit(Step(0, "press", {}), [joints([[0.0] * 6])], 0.1)
    for index in (0, 2):
        with pytest.raises(ValueError, match=f"step {index} .* 1 "):
            recording.commit(Step(index, "press", {}), [joints([[1.0] * 6])], 0.1)
    assert [record.readings["arm.joints"].values[0, 0] for record in recording.steps()] == [0.0]


def test_a_step_of_another_index_is_refused(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    for index in range(2):
        recording.commit(Step(index, "press", {}), [joints([[0.0] * 6])], 0.1)
    steps = tmp_path / "run" / "steps"
    (steps / "000.mcap").write_bytes((steps / "001.mcap").read_bytes())
    with pytest.raises(RecordingDamaged, match=r"000\.mcap .*step 1"):
        recording.steps()


def test_a_folder_with_steps_and_no_header_takes_no_new_run(tmp_path: Path) -> None:
    recording = Recording.create(tmp_path / "run", sample_header())
    recording.commit(Step(0, "press", {}), [joints([[0.0] * 6])], 0.1)
    (tmp_path / "run" / "run.json").unlink()
    with pytest.raises(WrongUse, match="--resume"):
        Recording.create(tmp_path / "run", sample_header())
