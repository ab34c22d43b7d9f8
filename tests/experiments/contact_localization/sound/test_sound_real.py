"""Strikes among real sounds: a kitchen's noise, and the response of a real room."""

import wave
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import oaconvolve, resample_poly

from experiments.contact_localization.sound.gains import gain_table
from experiments.contact_localization.sound.likelihood import SoundTerm
from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS
from harness.bench.acquisition import Strike
from harness.strikes.peaks import analyse
from tests.samples import sounding_plate as plate

K = 6
MODES = plate.plate_modes()


def _dry(seed: int) -> tuple[FloatArray, tuple[Strike, ...]]:
    rng = np.random.default_rng(seed)
    points = plate.places(K, rng)
    return points, plate.strikes(MODES, points, rng, np.exp(1j * np.arange(12)), 1e-3)


def _sound(path: Path) -> FloatArray:
    with wave.open(str(path)) as file:
        assert file.getsampwidth() == 2
        rate, channels = file.getframerate(), file.getnchannels()
        samples = np.frombuffer(file.readframes(file.getnframes()), dtype="<i2")
    mono = samples.reshape(-1, channels)[:, 0].astype(np.float64)
    return np.asarray(resample_poly(mono / np.abs(mono).max(), round(plate.RATE / 100), round(rate / 100)))


def _true_share(strikes: list[Strike]) -> tuple[int, float]:
    """Peaks, and the share of them that are a mode of the plate."""
    peaks = analyse(strikes).peaks
    right = [np.abs(MODES.frequencies / peak.frequency - 1.0).min() < 0.01 for peak in peaks]
    return len(peaks), float(np.mean(right)) if right else 1.0


def test_a_real_room_adds_no_modes(shared_data: Path) -> None:
    response = _sound(shared_data / "audio/room/rir_clap.wav")
    response = response[np.argmax(np.abs(response)) :]
    _, dry = _dry(1)
    size = len(dry[0].pressure)
    wet = [replace(s, pressure=oaconvolve(s.pressure, response)[:size]) for s in dry]
    count, right = _true_share(wet)
    assert count >= 5
    assert right >= 0.8


def test_strikes_are_heard_through_a_real_kitchen(shared_data: Path) -> None:
    kitchen = _sound(shared_data / "audio/background/doing_the_dishes.wav")
    _, dry = _dry(2)
    size = len(dry[0].pressure)
    loud = max(np.abs(s.pressure).max() for s in dry)
    noisy = [
        replace(s, pressure=s.pressure + 0.05 * loud * kitchen[k * 2 * size : k * 2 * size + size])
        for k, s in enumerate(dry)
    ]
    count, right = _true_share(noisy)
    assert count >= 5
    assert right >= 0.8


def test_a_kitchen_without_the_object_says_next_to_nothing(shared_data: Path) -> None:
    kitchen = _sound(shared_data / "audio/background/doing_the_dishes.wav")
    table = gain_table(MODES, plate.plate_surface())
    for seed in range(3):
        points, dry = _dry(seed)
        size, first = len(dry[0].pressure), seed * 2_000_000
        only = [
            replace(s, pressure=kitchen[first + 3 * k * size : first + 3 * k * size + size])
            for k, s in enumerate(dry)
        ]
        rng = np.random.default_rng(seed)
        places = np.array([plate.places(K, rng) for _ in range(200)])
        term = SoundTerm(analyse(only), table, MODES, MATERIALS["glass"])
        silent = SoundTerm(analyse(dry), table, MODES, MATERIALS["glass"])
        told = np.ptp(term.log_likelihood(places, plate.down(K)))
        assert told < 0.25 * np.ptp(silent.log_likelihood(np.array([*places, points]), plate.down(K)))
