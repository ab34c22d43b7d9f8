"""A strike from two instruments: the force triggers, the sound is of the same moments, and doubts stay."""

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.arrays import AnyArray
from harness.basics.errors import BenchFault, DataRefused
from harness.bench.acquisition import Strike, of_one_stream, shipped_acquisition, strike_from_readings
from harness.bench.acquisition_channels import (
    BLOCK,
    CLOCK,
    FLAGS,
    FORCE,
    PRESSURE,
    CaptureForm,
    block_channel,
    readings_of_capture,
)
from harness.bench.device import Channel, ImpactHammer, Microphone, Reading
from harness.bench.instruments.sound import MARGIN, capture
from harness.bench.microphone_take import (
    BAD,
    CLOCK_FIELDS,
    COUNT_BROKEN,
    OVERLOAD,
    SAMPLES_LOST,
    SILENCE_INSERTED,
    UNSURE,
    take_of,
)
from harness.bench.microphone_take import CLOCK as CARD_CLOCK
from harness.bench.microphone_take import FLAGS as CARD_FLAGS

CALIBRATION = shipped_acquisition("acquisition_sound_card")
BOX, CARD = 50e3, 48e3
SCANS, ONSET = 52 * BLOCK, 1000
TONE = 3000.0
OPENED = 12.0


class Hammer:
    """Force of one blow from 100 s on; input 1 is shorted."""

    def __init__(self, fails: bool = False) -> None:
        self.fails = fails

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        fire()
        if self.fails:
            raise BenchFault("the box was unplugged")
        counts = np.zeros((SCANS, 2))
        counts[:, 0] = CALIBRATION.hammer_offset
        counts[ONSET : ONSET + 20, 0] += 3000.0 * np.sin(np.pi * np.arange(20) / 20)
        form = CaptureForm(BOX, 147.0, CALIBRATION.full_scale_counts)
        pairs = np.array([[0.0, 100.0], [1000.0, 100.0 + 1000 / BOX]])
        return readings_of_capture(np.rint(counts), (100.0, 100.0 + 0.5 / BOX), BOX, form, pairs, np.zeros(2))


class Card:
    """A tone that lasts for ever, and what is asked for."""

    def __init__(self, flags: int = 0, uncertainty: float = 1e-6, rate: float = CARD) -> None:
        self.flags, self.uncertainty, self.rate = flags, uncertainty, rate
        self.asked: list[tuple[float, float]] = []

    def between(self, start: float, end: float) -> tuple[Reading, ...]:
        self.asked.append((start, end))
        numbers = np.arange(np.floor(start * self.rate / 512) * 512, np.ceil(end * self.rate / 512) * 512)
        return card_take(self.tone(numbers / self.rate), numbers / self.rate, self.flags, self.uncertainty)

    @staticmethod
    def tone(at: AnyArray) -> AnyArray:
        return np.rint(2e6 * np.sin(2 * np.pi * TONE * at))


def card_take(counts: AnyArray, times: AnyArray, flags: int, uncertainty: float) -> tuple[Reading, ...]:
    first = times[::512]
    line = dict(zip(CLOCK_FIELDS, (0.0, times[0], CARD, 1e-5, uncertainty, OPENED), strict=True))
    raised = np.zeros(len(first))
    raised[len(first) // 2] = flags
    return (
        Reading(block_channel(PRESSURE, 512, CARD), first, counts.reshape(-1, 512)),
        Reading(Channel(CARD_FLAGS, "1", (), "uint8"), first, raised),
        Reading(
            Channel(CARD_CLOCK, "1", (len(CLOCK_FIELDS),), "float64"), first[:1], np.array([[*line.values()]])
        ),
    )


def struck(card: Card | None, hammer: Hammer | None = None) -> dict[str, Reading]:
    hammers: ImpactHammer = hammer or Hammer()  # type: ignore[assignment]
    cards: Microphone | None = card  # type: ignore[assignment]
    read = capture(hammers, cards, lambda: None, 0.02, 0.5, 1.0)
    assert len({reading.channel.name for reading in read}) == len(read)
    return {reading.channel.name: reading for reading in read}


def test_without_a_microphone_of_its_own_everything_is_the_box_s() -> None:
    readings = struck(None)
    assert set(readings) == {FORCE, PRESSURE, CLOCK, FLAGS}
    assert readings[PRESSURE].channel.shape == (BLOCK,)
    assert take_of(readings) is None


def test_the_sound_of_the_force_s_moments_is_asked_for_once_with_some_to_spare() -> None:
    card = Card()
    readings = struck(card)
    assert set(readings) == {FORCE, PRESSURE, CLOCK, FLAGS, CARD_FLAGS, CARD_CLOCK}
    assert readings[PRESSURE].channel.shape == (512,)
    ((start, end),) = card.asked
    assert start == pytest.approx(100.0 - MARGIN)
    assert end >= 100.0 + SCANS / BOX + MARGIN - BLOCK / BOX


@settings(deadline=None, max_examples=20)
@given(st.floats(-200e-6, 200e-6), st.sampled_from([44100.0, 48000.0, 96000.0]))
def test_force_and_sound_share_rate_and_onset(drift: float, rate: float) -> None:
    card = Card(rate=rate * (1.0 + drift))
    strike = strike_from_readings(struck(card), CALIBRATION)
    assert strike.fault == ""
    assert strike.rate == pytest.approx(BOX, rel=1e-9)
    assert len(strike.force) == len(strike.pressure) == SCANS
    assert strike.times[strike.onset] == pytest.approx(100.0 + ONSET / BOX, abs=3 / BOX)
    truth = card.tone(strike.times) * CALIBRATION.pascals_per_count
    inner = slice(500, -500)
    rest = np.median(strike.pressure - truth)
    assert np.abs(strike.pressure - truth - rest)[inner].max() < 1e-3 * np.abs(truth).max()
    assert (strike.jitter, strike.opened) == (1e-6, OPENED)


@pytest.mark.parametrize(
    ("flag", "said"),
    [
        (SAMPLES_LOST, "samples were lost"),
        (SILENCE_INSERTED, "silence was inserted"),
        (COUNT_BROKEN, "missing or made up"),
        (SAMPLES_LOST | SILENCE_INSERTED, "silence was inserted.*; samples were lost"),
    ],
)
def test_a_take_with_an_xrun_is_marked_and_never_used_silently(flag: int, said: str) -> None:
    readings = struck(Card(flags=flag))
    strike = strike_from_readings(readings, CALIBRATION)
    assert strike.overload
    assert re.search(said, strike.fault)
    take = take_of(readings)
    assert take is not None
    assert take.flags & BAD


def test_a_card_that_does_not_say_when_it_sampled_is_not_used_for_phases() -> None:
    sure, unsure = (
        strike_from_readings(struck(Card(uncertainty=u)), CALIBRATION) for u in (0.9 * UNSURE, 1.1 * UNSURE)
    )
    assert sure.fault == ""
    assert "110 us" in unsure.fault
    assert unsure.overload


def test_an_overloaded_converter_alone_is_an_overload() -> None:
    strike = strike_from_readings(struck(Card(flags=OVERLOAD)), CALIBRATION)
    assert strike.lost == ""


def test_a_failed_hammer_is_the_failure() -> None:
    with pytest.raises(BenchFault, match="unplugged"):
        struck(Card(), Hammer(fails=True))


def test_flags_without_a_clock_are_refused() -> None:
    readings = struck(Card())
    del readings[CARD_CLOCK]
    with pytest.raises(DataRefused, match=r"microphone\.flags.*microphone\.clock"):
        strike_from_readings(readings, CALIBRATION)


def strike_at(opened: float | None, lost: str = "") -> Strike:
    found = strike_from_readings(struck(Card()), CALIBRATION)
    return replace(found, opened=opened, lost=lost, overload=bool(lost))


def test_only_strikes_heard_by_one_stream_are_compared() -> None:
    found = of_one_stream(
        [strike_at(1.0), None, strike_at(1.0), strike_at(9.0), strike_at(9.0, "lost"), strike_at(9.0, "lost")]
    )
    assert found[1] is None
    faults = [strike.fault for strike in found if strike is not None]
    assert [faults[0], faults[1], *faults[3:]] == ["", "", "lost", "lost"]
    assert "latency" in faults[2]
    assert [strike.overload for strike in found if strike is not None] == [False, False, True, True, True]


def test_strikes_of_one_stream_or_of_the_box_are_left_alone() -> None:
    for opened in (None, 0.0, 5.0):
        strikes = [strike_at(opened), None, strike_at(opened)]
        assert all(a is b for a, b in zip(of_one_stream(strikes), strikes, strict=True))
