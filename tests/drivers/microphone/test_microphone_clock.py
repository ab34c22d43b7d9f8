"""Laws of the fitted clock, of lost samples and of how counts are read."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.microphone.readings import (
    Block,
    Blocks,
    Format,
    fit_clock,
    overloaded,
    places_of_doubt,
    readings,
    steps,
    usual_rate,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.bench.microphone_take import BAD, COUNT_BROKEN, flags_of, words

RATE, BLOCK = 48000.0, 512
FORM = Format(48000, 24, 1, 0, BLOCK)
SETTLED = 19  # blocks in the 0.2 s that a step needs on either side
drifts = st.floats(-100e-6, 100e-6)
starts = st.floats(0.0, 1e6)
seeds = st.integers(0, 2**32 - 1)


def blocks(count: int) -> FloatArray:
    return BLOCK * np.arange(count, dtype=np.float64)


@given(drifts, starts, st.integers(1, 900))
def test_punctual_blocks_give_their_times_back(drift: float, start: float, count: int) -> None:
    indices = blocks(count)
    times = start + indices / (RATE * (1.0 + drift))
    clock = fit_clock(indices, times, RATE)
    assert clock.times(indices) == pytest.approx(times, abs=5e-6)
    assert clock.residual < 5e-6


@given(drifts, starts)
def test_ten_seconds_show_a_crystals_drift(drift: float, start: float) -> None:
    indices = blocks(940)
    clock = fit_clock(indices, start + indices / (RATE * (1.0 + drift)), RATE)
    assert clock.rate == pytest.approx(RATE * (1.0 + drift), rel=1e-6)


@given(drifts, seeds, st.floats(1e-5, 1e-3))
def test_late_blocks_hardly_move_the_clock(drift: float, seed: int, jitter: float) -> None:
    draw = np.random.default_rng(seed)
    indices = blocks(500)
    true = indices / (RATE * (1.0 + drift))
    late = jitter * draw.random(500) + np.where(draw.random(500) < 0.1, 0.05, 0.0)
    clock = fit_clock(indices, true + late, RATE)
    # A line by least squares would be 5 ms late here.
    assert np.abs(clock.times(indices) - true).max() < 1.5 * jitter + 5e-5


@given(seeds, st.floats(-1e5, 1e5), st.integers(-(10**9), 10**9))
def test_the_clock_follows_a_shift_of_either_scale(seed: int, seconds: float, samples: int) -> None:
    indices = blocks(100)
    times = indices / RATE + 1e-3 * np.random.default_rng(seed).random(100)
    clock, moved = fit_clock(indices, times, RATE), fit_clock(indices + samples, times + seconds, RATE)
    assert moved.times(indices + samples) - seconds == pytest.approx(clock.times(indices), abs=1e-7)


@given(drifts, seeds)
def test_a_fifth_of_a_second_cannot_invent_a_drift(drift: float, seed: int) -> None:
    indices = blocks(19)
    times = indices / (RATE * (1.0 + drift)) + 1e-3 * np.random.default_rng(seed).random(19)
    assert fit_clock(indices, times, RATE).rate == pytest.approx(RATE, rel=3e-4)


def test_no_block_is_no_clock() -> None:
    with pytest.raises(ValueError, match="block"):
        fit_clock(np.zeros(0), np.zeros(0), RATE)


@given(st.integers(30, 70), st.integers(-2048, 2048), seeds, drifts)
def test_a_step_is_what_was_lost_or_made_up(place: int, lost: int, seed: int, drift: float) -> None:
    indices = blocks(100)
    taken = indices + np.where(np.arange(100) >= place, lost, 0)
    times = taken / (RATE * (1.0 + drift)) + 1e-4 * np.random.default_rng(seed).random(100)
    found = steps(indices, times, RATE, 20)
    assert found[place - 20] == pytest.approx(lost / RATE, abs=2.5e-4)
    assert np.abs(found).max() == pytest.approx(abs(lost) / RATE, abs=2.5e-4)


@given(st.integers(0, 99), st.floats(0.0, 1.0))
def test_one_late_block_is_no_step(place: int, late: float) -> None:
    times = blocks(100) / RATE
    times[place] += late
    assert np.abs(steps(blocks(100), times, RATE, 20)).max() < 1e-9
    assert len(steps(blocks(39), times[:39], RATE, 20)) == 0


def heard(samples_before: dict[int, int]) -> list[Block]:
    """A second and a half of blocks; before some of them samples went missing."""
    lost = np.cumsum([samples_before.get(number, 0) for number in range(140)])
    length = BLOCK / RATE
    return [
        Block(number * BLOCK, number * length + lost[number] / RATE + length, length, 0, b"")
        for number in range(140)
    ]


@given(st.integers(25, 115), st.integers(128, 4096), st.sampled_from([-1, 1]))
def test_a_quarter_of_a_block_lost_or_made_up_is_noticed(place: int, samples: int, sign: int) -> None:
    assert places_of_doubt(heard({place: sign * (samples + 1)}), FORM)[place]


@given(st.integers(25, 115), st.integers(0, 90))
def test_an_unbroken_count_is_left_alone(place: int, samples: int) -> None:
    assert not np.any(places_of_doubt(heard({place: samples}), FORM))


def test_the_usual_rate_is_not_changed_by_a_loss_but_by_another_rate() -> None:
    assert usual_rate(heard({70: 4000}), FORM) == pytest.approx(RATE, rel=1e-9)
    other = [replace(block, arrived=block.arrived * 48000 / 44100) for block in heard({})]
    assert usual_rate(other, FORM) == pytest.approx(44100, rel=1e-3)


@given(st.integers(25, 75), st.integers(-18, 36))
def test_a_take_about_a_gap_is_bad_and_one_well_after_it_has_a_clock_of_its_own(gap: int, begin: int) -> None:
    told = [replace(block, counts=bytes(3 * BLOCK)) for block in heard({gap: 2000})]
    first = gap + begin
    near = readings(told, first * BLOCK, (first + 3) * BLOCK, FORM, 0.0)
    assert flags_of(near) == COUNT_BROKEN
    first = gap + 2 * SETTLED + 1
    after = readings(told, first * BLOCK, (first + 3) * BLOCK, FORM, 0.0)
    assert flags_of(after) == 0
    true = told[first].arrived - told[first].age
    assert after[0].times[0] == pytest.approx(true, abs=1e-6)


@given(st.lists(st.integers(-(2**23), 2**23 - 1), min_size=1, max_size=64))
def test_packed_24_bit_counts_keep_value_and_sign(counts: list[int]) -> None:
    raw = b"".join(count.to_bytes(3, "little", signed=True) for count in counts)
    assert FORM.counts(raw).tolist() == counts


@given(st.integers(0, 2), st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=32))
def test_one_of_interleaved_channels_is_read(channel: int, counts: list[int]) -> None:
    interleaved = np.zeros((len(counts), 3), np.int32)
    interleaved[:, channel] = counts
    form = Format(48000, 32, 3, channel, len(counts))
    assert form.counts(interleaved.tobytes()).tolist() == counts


@pytest.mark.parametrize("end", [2**23 - 1, -(2**23)])
def test_three_at_the_end_of_scale_are_an_overload_and_two_are_a_peak(end: int) -> None:
    for run, expected in ((2, False), (3, True), (7, True)):
        counts = np.zeros(50, np.int32)
        counts[20 : 20 + run] = end
        assert overloaded(counts, FORM) is expected
    apart = np.zeros(50, np.int32)
    apart[::2] = end
    assert not overloaded(apart, FORM)


def test_only_the_newest_blocks_are_kept() -> None:
    kept = Blocks(capacity=3, size=BLOCK)
    for number in range(5):
        kept.add(Block(number * BLOCK, 0.0, 0.0, BAD if number == 0 else 0, b""))
    assert [block.first // BLOCK for block in kept.since(0)] == [2, 3, 4]
    assert [block.first // BLOCK for block in kept.since(3 * BLOCK + 100)] == [3, 4]
    assert (kept.total, kept.bad) == (5, 1)


def test_every_flag_has_words_and_no_other() -> None:
    assert len(words(63)) == 6
    assert words(0) == ()
    with pytest.raises(DataRefused, match="bit 64"):
        words(65)
