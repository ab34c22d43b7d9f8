"""A WAV gives back the sound, by the scale that was said."""

import wave
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.objectfile.audio.sound_wav import HEADROOM, write_wav

RATE = 44_100.0


def sound(size: float = 1.0) -> FloatArray:
    times = np.arange(2000) / RATE
    return size * np.exp(-30.0 * times) * np.sin(2.0 * np.pi * 1234.0 * times)


def counts(path: Path) -> FloatArray:
    """As a program reads them that knows nothing of this one."""
    with wave.open(str(path), "rb") as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 3, 44_100)
        data = file.readframes(file.getnframes())
    parts = np.frombuffer(data, np.uint8).reshape(-1, 3).astype(np.int64)
    unsigned = parts @ [1, 256, 65536]
    return np.where(unsigned >= 1 << 23, unsigned - (1 << 24), unsigned).astype(np.float64)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(-200.0, 200.0))
def test_counts_times_the_scale_are_the_sound(tmp_path: Path, exponent: float) -> None:
    wanted = sound(10.0**exponent)
    scale = write_wav(tmp_path / "a.wav", wanted, RATE)
    assert scale == pytest.approx(HEADROOM * np.abs(wanted).max())
    step = scale / 2.0**23
    assert np.abs(counts(tmp_path / "a.wav") * step - wanted).max() <= 0.5001 * step


def test_two_sounds_of_one_scale_keep_their_ratio(tmp_path: Path) -> None:
    for name, size in (("loud", 1.0), ("faint", 0.25)):
        assert write_wav(tmp_path / f"{name}.wav", sound(size), RATE, full_scale=2.0) == 2.0
    loud, faint = (np.abs(counts(tmp_path / f"{name}.wav")).max() for name in ("loud", "faint"))
    assert faint / loud == pytest.approx(0.25, abs=1e-5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_full_scale_that_holds_the_loudest_sample_is_taken_and_a_smaller_one_refused(
    tmp_path: Path, sign: float
) -> None:
    wanted = sign * sound()
    loudest = float(np.abs(wanted).max())
    write_wav(tmp_path / "a.wav", wanted, RATE, full_scale=loudest * (1.0 + 2.0**-22))
    found = counts(tmp_path / "a.wav")
    assert np.sign(found[np.argmax(np.abs(found))]) == np.sign(wanted[np.argmax(np.abs(wanted))])
    for scale in (0.9 * loudest, 0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(WrongUse, match="full scale"):
            write_wav(tmp_path / "b.wav", wanted, RATE, full_scale=scale)
    assert not (tmp_path / "b.wav").exists()


@pytest.mark.parametrize("rate", [0.0, -44100.0, 44100.5, float("nan"), float("inf"), 3e9])
def test_a_rate_that_the_file_cannot_say_is_refused(tmp_path: Path, rate: float) -> None:
    with pytest.raises(WrongUse, match="44100"):
        write_wav(tmp_path / "a.wav", sound(), rate)
