"""A strike on the box and on the sound card: at one moment, the force here and the sound there."""

import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import WrongUse
from harness.bench.acquisition import shipped_acquisition
from harness.bench.station_file import load_station, station_path
from mocks.shared_pose import Firing
from mocks.sound_card.card import AHEAD, NOISE, CardConverter, PluggedCard, StrikesOnCard, Wire
from mocks.sound_card.player import MEANWHILE

CALIBRATION = shipped_acquisition("acquisition_sound_card")
CONVERTER = CardConverter.of(CALIBRATION)
SOUND, CARD, SCANS = 50e3, 48000, 50002.0
PA = 3.0


class World:
    """A tone that every strike makes, and a force of one sample."""

    def __init__(self) -> None:
        self.struck: list[tuple[int, int]] = []

    def strike(self, base_from_flange: FloatArray, step: int, sample: int) -> Any:
        self.struck.append((step, sample))
        times = np.arange(20000) / SOUND
        return SimpleNamespace(force=np.zeros(20000), pressure=PA * np.sin(2 * np.pi * 1000 * times))

    def idle(self, seconds: float) -> FloatArray:
        return np.zeros(round(seconds * SOUND))

    def converter_noise(self, step: int, sample: int) -> np.random.Generator:
        return np.random.default_rng(1)


class Strikes:
    def __init__(self) -> None:
        self.sound = World()

    def idle(self) -> AnyArray:
        return np.tile(np.array([[7, 0]], np.int16), (100, 1))

    def read(self, truth: Any, step: int, sample: int) -> AnyArray:
        return np.tile(np.array([[1000, 1]], np.int16), (5000, 1))


class Card:
    def __init__(self) -> None:
        self.played: list[tuple[AnyArray, float]] = []

    def play(self, counts: AnyArray, at: float) -> None:
        self.played.append((counts, at))


@pytest.fixture
def parts() -> tuple[StrikesOnCard, Card, list[Firing], Strikes]:
    strikes, card, firings = Strikes(), Card(), [Firing(0, np.eye(4), -1, -1)]
    wire = Wire(CARD, 2, 1, CONVERTER, SOUND)
    source = StrikesOnCard(
        cast("Any", strikes), lambda: firings[-1], cast("Any", card), wire, lambda: (2000, 40.0, SCANS)
    )
    return source, card, firings, strikes


Parts = tuple[StrikesOnCard, Card, list[Firing], Strikes]


def fired(parts: Parts) -> tuple[AnyArray, float]:
    """What the card was told to play, and when, after one firing."""
    source, card, firings, _ = parts
    firings.append(Firing(1, np.eye(4), 3, 1))
    source(0, 10)
    end = now() + 10.0
    while not card.played and now() < end:
        time.sleep(5e-3)
    return card.played[-1]


def test_nothing_is_played_before_the_striker_is_fired(parts: Parts) -> None:
    source, card, _, strikes = parts
    np.testing.assert_array_equal(source(0, 250), np.tile([[7, 0]], (250, 1)))
    assert card.played == []
    assert strikes.sound.struck == []


def test_what_is_always_heard_is_the_converter_s_noise(parts: Parts) -> None:
    source, card, *_ = parts
    source.begin()
    ((counts, at),) = card.played
    assert at == MEANWHILE
    assert not np.any(counts[:, 0])
    rms = 2.0**31 * 10 ** (NOISE / 20)
    assert counts[:, 1].std() == pytest.approx(rms, rel=0.05)


def test_box_and_card_begin_at_one_scan_of_the_box(parts: Parts) -> None:
    source, _, _, strikes = parts
    before = now()
    samples, at = fired(parts)
    assert before + AHEAD <= at <= now() + AHEAD + 1e-3
    begin = 2000 + (at - 40.0) * SCANS
    assert begin == pytest.approx(round(begin), abs=1e-2)
    first = round(begin) - 100
    counts = source(first, 300)
    np.testing.assert_array_equal(counts[:100, 0], 7)
    np.testing.assert_array_equal(counts[100:, 0], 1000)
    np.testing.assert_array_equal(source(round(begin) + 5000, 10)[:, 0], 7)
    assert strikes.sound.struck == [(3, 1)]
    assert samples.shape[1] == 2


def test_the_card_plays_pascals_in_its_converter_s_counts_on_the_microphone_s_channel(parts: Parts) -> None:
    samples, _ = fired(parts)
    assert not np.any(samples[:, 0])
    heard = samples[:, 1] / 2**8 * CALIBRATION.pascals_per_count
    expected = PA * np.sin(2 * np.pi * 1000 * np.arange(len(heard)) / CARD)
    assert np.abs(heard - expected)[100:-100].max() < 1e-3
    assert not np.any(samples[:, 1] & 0xFF)  # 24 bits


def test_one_firing_is_one_strike(parts: Parts) -> None:
    source, card, *_ = parts
    fired(parts)
    for first in range(0, 5000, 500):
        source(first, 500)
    time.sleep(0.05)
    assert len(card.played) == 1


def test_a_converter_stays_at_its_full_scale() -> None:
    loud = CONVERTER.counts(np.array([1e3, -1e3]), np.random.default_rng(0))
    np.testing.assert_array_equal(loud, [2**23 - 1, -(2**23)])


def test_a_station_that_listens_with_the_box_has_no_card(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="microphone"):
        PluggedCard(load_station(station_path("mock")), tmp_path)
