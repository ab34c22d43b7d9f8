"""Raw counts through the recording and into WAV files, to the bit."""

import json
import wave
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.bench.acquisition_channels import FORCE, PRESSURE, block_channel
from harness.bench.device import Channel, Reading
from harness.recording.recording import Recording, RunHeader
from harness.recording.step_file import Step, codec_of
from harness.recording.wav_export import export_wav

BLOCK = 50
RATE = 50_002.5


def blocks(name: str, counts: AnyArray, start: float = 12.0) -> Reading:
    times = start + np.arange(0, len(counts), BLOCK) / RATE
    return Reading(block_channel(name, BLOCK, 50e3), times, counts.reshape(-1, BLOCK))


def recording(folder: Path, *steps: tuple[Reading, ...]) -> Recording:
    header = RunHeader("x", {}, {}, {}, {}, {}, 0, None, 1_700_000_000_000_000_000, "2026-11-01T00:00:00")
    made = Recording.create(folder, header)
    for index, readings in enumerate(steps):
        made.commit(Step(index, "strike", {}), readings, 1.0)
    return made


def counts_of(path: Path, shift: int) -> AnyArray:
    with wave.open(str(path)) as file:
        width, data = file.getsampwidth(), file.readframes(file.getnframes())
    wide = np.zeros((len(data) // width, 4), np.uint8)
    wide[:, 4 - width :] = np.frombuffer(data, np.uint8).reshape(-1, width)
    whole: AnyArray = wide.view("<i4")[:, 0] >> (32 - 8 * width + shift)
    return whole


@settings(deadline=None)
@given(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=40), st.sampled_from([8, 16, 24, 32]))
def test_every_block_comes_back_to_the_bit(values: list[int], bits: int) -> None:
    counts = np.array(values, np.int64) >> (32 - bits)
    channel = Channel(PRESSURE, "count", (len(counts),), "int32", "", 48e3)
    reading = Reading(channel, np.array([1.0]), counts[None])
    codec = codec_of(channel)
    data, _ = codec.decode(codec.encode(reading, 0, 10**18), channel)
    assert data.dtype == np.int32
    assert np.array_equal(data, counts)


def test_a_recorded_strike_reads_back_as_raw_audio(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    force = rng.integers(-32768, 32768, 20 * BLOCK)
    sound = rng.integers(-(2**31), 2**31, 20 * BLOCK)
    made = recording(tmp_path / "run", (blocks(FORCE, force), blocks(PRESSURE, sound, 12.0 + 0.5 / RATE)))
    read = made.step(0).readings
    for name, counts in ((FORCE, force), (PRESSURE, sound)):
        assert np.array_equal(read[name].values.ravel(), counts)
        assert read[name].channel == block_channel(name, BLOCK, 50e3)
    assert np.allclose(read[PRESSURE].times - read[FORCE].times, 0.5 / RATE, atol=1e-9)
    with (tmp_path / "run/steps/000.mcap").open("rb") as stream:
        schemas = {schema.name for schema, _, _ in make_reader(stream).iter_messages() if schema is not None}
    assert schemas == {"foxglove.RawAudio"}


@pytest.mark.parametrize(("bits", "width", "shift"), [(16, 3, 8), (24, 3, 0), (32, 4, 0)])
def test_wav_files_hold_the_counts(tmp_path: Path, bits: int, width: int, shift: int) -> None:
    half = 1 << (bits - 1)
    counts = np.random.default_rng(bits).integers(-half, half, 4 * BLOCK)
    counts[:2] = -half, half - 1
    quiet = counts // 1000
    made = recording(
        tmp_path / "run",
        (blocks(FORCE, counts), blocks(PRESSURE, counts)),
        (blocks(FORCE, quiet), blocks(PRESSURE, quiet)),
    )
    files = export_wav(made, tmp_path / "wav")
    assert [file.file for file in files] == [
        "000-hammer.force.wav",
        "000-microphone.pressure.wav",
        "001-hammer.force.wav",
        "001-microphone.pressure.wav",
    ]
    for file in files:
        assert (file.bits, file.shift_bits) == (8 * width, shift)
        truth = counts if file.step == 0 else quiet
        assert np.array_equal(counts_of(tmp_path / "wav" / file.file, file.shift_bits), truth)
        assert file.rate_hz == pytest.approx(RATE, abs=1e-2)
        assert file.start_s == pytest.approx(12.0, abs=1e-6)
    listed = json.loads((tmp_path / "wav/wav.json").read_text())
    assert [entry["file"] for entry in listed["files"]] == [file.file for file in files]
    with wave.open(str(tmp_path / "wav" / files[0].file)) as sound:
        assert (sound.getframerate(), sound.getnchannels(), sound.getsampwidth()) == (50_000, 1, width)


def test_a_run_without_sound_has_no_wav(tmp_path: Path) -> None:
    joints = Reading(Channel("arm.joints", "rad", (6,), "float64"), np.array([1.0]), np.zeros((1, 6)))
    made = recording(tmp_path / "run", (joints,))
    with pytest.raises(DataRefused, match=r"hammer\.force.*microphone\.pressure"):
        export_wav(made, tmp_path / "wav")
    assert not (tmp_path / "wav").exists()
