"""Recorded force and sound as WAV files, for ears and for programs that know nothing of runs.

Samples are the raw counts, in 24 bits (in 32 where they need them), shifted up by whole bits so that a
16-bit converter's full scale is the file's: shifting down by ``shift_bits`` gives the counts back,
bit for bit. A WAV's rate is a whole number; the measured one and the time of the first sample are in
``wav.json`` beside the files.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import DataRefused
from harness.basics.wav import write_pcm
from harness.basics.whole_file import write_text_whole
from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.device import Reading
from harness.recording.recording import Recording

SCHEMA = 1
INDEX = "wav.json"

_WIDTHS = ((16, 24), (24, 24), (32, 32))
"""Bits that the counts of a channel need, and bits of its files."""


@dataclass(frozen=True)
class WavFile:
    """One file, as ``wav.json`` lists it."""

    file: str  #: its name.
    step: int  #: of the run.
    channel: str  #: that it holds.
    rate_hz: float  #: measured, on the bench clock.
    start_s: float  #: of the first sample, on the bench clock.
    bits: int  #: of a sample.
    shift_bits: int  #: by which counts were shifted up.


def export_wav(recording: Recording, folder: Path) -> list[WavFile]:
    """Write every strike's force and sound into ``folder``, and ``wav.json``; what was written.

    Raises:
        DataRefused: the run recorded no sound.
    """
    found = [
        (record.step.index, reading)
        for record in recording.steps()
        for name, reading in sorted(record.readings.items())
        if name in (FORCE, PRESSURE)
    ]
    if not found:
        raise DataRefused(
            f"{recording.folder} recorded neither {FORCE} nor {PRESSURE}; nothing to write as WAV"
        )
    folder.mkdir(parents=True, exist_ok=True)
    needed = {
        name: max(_bits(r.values) for _, r in found if r.channel.name == name) for name in (FORCE, PRESSURE)
    }
    files = [_write(folder, step, reading, needed[reading.channel.name]) for step, reading in found]
    listed = {"schema": SCHEMA, "files": [asdict(file) for file in files]}
    write_text_whole(folder / INDEX, json.dumps(listed, indent=1, allow_nan=False))
    return files


def _bits(counts: AnyArray) -> int:
    """16, 24 or 32: the least that holds every count."""
    low, high = int(counts.min()), int(counts.max())
    return next(bits for bits, _ in _WIDTHS if -(1 << (bits - 1)) <= low and high < 1 << (bits - 1))


def _write(folder: Path, step: int, reading: Reading, needed: int) -> WavFile:
    bits = dict(_WIDTHS)[needed]
    shift = bits - needed
    block = reading.values.shape[1]
    spans = np.diff(reading.times)
    rate = float(block / np.median(spans)) if len(spans) else float(reading.channel.nominal_rate or 0.0)
    name = f"{step:03d}-{reading.channel.name}.wav"
    counts = np.left_shift(reading.values.ravel().astype(np.int64), shift)
    write_pcm(str(folder / name), counts, round(reading.channel.nominal_rate or rate), bits)
    return WavFile(name, step, reading.channel.name, rate, float(reading.times[0]), bits, shift)
