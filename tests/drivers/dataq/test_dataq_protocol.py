"""What the driver says to a box, and what it makes of words without framing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.dataq.hammer import DataqHammer
from drivers.dataq.link import (
    MODELS,
    answer_to,
    counts,
    divisor,
    likely_loss,
    packet_exponent,
    without_start_echo,
)
from harness.basics.arrays import AnyArray
from harness.basics.errors import WrongUse
from tests.support.daq_bench import CALIBRATION

OFFSETS = np.array([120.0, -180.0])


@pytest.mark.parametrize(
    ("reply", "value"),
    [
        (b"info 6 AB12\r", "AB12"),
        (b"\0info 6 AB12\r\0", "AB12"),
        (b"info 6\r", ""),
        (b"info 6 \0\r", ""),
        (b"stop\r\0info 6 AB12\r\0", "AB12"),
    ],
)
def test_the_value_follows_the_echo(reply: bytes, value: str) -> None:
    assert answer_to("info 6", reply) == value


@pytest.mark.parametrize("reply", [b"", b"info 60 1\r", b"stop\r", b"\xff\xfe\r", b"info 6 AB"])
def test_another_or_half_an_echo_is_no_answer(reply: bytes) -> None:
    assert answer_to("info 6", reply) is None


def test_fifty_kilohertz_on_two_channels_is_divisor_600() -> None:
    assert divisor(60_000_000, 50e3, 2, MODELS["DI-2108"]) == 600


@pytest.mark.parametrize(
    ("rate", "nearest"), [(44.1e3, "44117.64706"), (100e3, "80000"), (400.0, "457.7706569")]
)
def test_a_rate_that_the_box_has_not_is_refused_with_the_nearest(rate: float, nearest: str) -> None:
    with pytest.raises(WrongUse, match=nearest):
        divisor(60_000_000, rate, 2, MODELS["DI-2108"])


@pytest.mark.parametrize(("rate", "exponent"), [(50e3, 4), (500.0, 0), (80e3, 5)])
def test_a_packet_is_full_within_two_and_a_half_milliseconds(rate: float, exponent: int) -> None:
    assert packet_exponent(rate, 2) == exponent
    assert (1 << (exponent + 4)) <= max(16.0, 2 * 2 * rate * 2.5e-3)


def test_twelve_bits_are_left_justified() -> None:
    words = np.array([0x7FF0, -0x8000, 0x0010, -0x0010], np.int16)
    assert counts(words, MODELS["DI-1110"]).tolist() == [2047, -2048, 1, -1]
    assert counts(words, MODELS["DI-2108"]).tolist() == words.tolist()


@pytest.mark.parametrize("after", [b"", b"\0"])
def test_an_echo_in_front_of_the_data_is_none_of_it(after: bytes) -> None:
    assert without_start_echo(b"start 0\r" + after + b"\x78\x00\x4c\xff") == (False, b"\x78\x00\x4c\xff")
    assert without_start_echo(b"\x78\x00\x4c\xff") == (False, b"\x78\x00\x4c\xff")


@pytest.mark.parametrize("begun", [b"", b"s", b"start 0", b"start 0\r"])
def test_what_may_become_an_echo_is_waited_for(begun: bytes) -> None:
    assert without_start_echo(begun) == (True, begun)


def test_an_unknown_model_is_named_with_those_there_are() -> None:
    with pytest.raises(WrongUse, match=r"DI-1110, DI-2108"):
        DataqHammer(CALIBRATION, port="/dev/ttyACM0", model="DI-9999")


def quiet(seed: int, model: str) -> AnyArray:
    drawn = np.rint(np.random.default_rng(seed).normal(size=(2500, 2)) * (2.0, 30.0) + OFFSETS)
    words: AnyArray = (drawn.astype(np.int16) << (16 - MODELS[model].bits)).astype("<i2")
    return words


@settings(deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 3), st.sampled_from(sorted(MODELS)))
def test_what_was_lost_is_told_from_what_the_channels_rest_at(seed: int, missing: int, model: str) -> None:
    data = quiet(seed, model).tobytes()[missing:]
    words = np.frombuffer(data[: len(data) // 4 * 4], "<i2").reshape(-1, 2)
    assert likely_loss(words, OFFSETS, 60.0, MODELS[model]) == missing


def test_a_hammer_that_is_leant_on_is_no_loss() -> None:
    assert likely_loss(quiet(0, "DI-2108") + np.int16(900), OFFSETS, 60.0, MODELS["DI-2108"]) is None
