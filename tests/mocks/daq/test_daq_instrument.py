"""The box's commands, as the maker's manual has them, byte by byte."""

import pytest

from mocks.daq.box import MODELS, CommandInterpreter


def box(model: str = "DI-2108", echoes_start: bool = False) -> CommandInterpreter:
    return CommandInterpreter(MODELS[model], "5C8A0711", echoes_start)


@pytest.mark.parametrize(
    ("command", "answer"),
    [
        (b"info 0\r", b"info 0 DATAQ\r\0"),
        (b"info 1\r", b"info 1 2108\r\0"),
        (b"info 6\r", b"info 6 5C8A0711\r\0"),
        (b"info 9\r", b"info 9 60000000\r\0"),
        (b"slist 0 1\r", b"slist 0 1\r\0"),
        (b"srate 600\r", b"srate 600\r\0"),
        (b"ps 5\r", b"ps 5\r\0"),
        (b"led 2\r", b"led 2\r\0"),
        (b"encode 1\r", b"encode 1\r\0"),
        (b"dec 500\r", b"dec 500\r\0"),
        (b"deca 3\r", b"deca 3\r\0"),
        (b"stop\r", b"stop\r\0"),
    ],
)
def test_a_command_is_answered_by_itself_and_its_value(command: bytes, answer: bytes) -> None:
    assert box().take(command) == answer


@pytest.mark.parametrize(
    "command",
    [
        b"INFO 0\r",
        b"srate 374\r",
        b"srate 65536\r",
        b"srate\r",
        b"ps 8\r",
        b"slist 2 0\r",
        b"slist 0 11\r",
        b"encode 2\r",
        b"dec 0\r",
        b"dec 513\r",
        b"deca 4\r",
        b"x\r",
    ],
)
def test_what_the_box_does_not_know_is_not_answered(command: bytes) -> None:
    assert box().take(command) == b""


@pytest.mark.parametrize("command", [b"dec 1\r", b"deca 1\r"])
def test_the_small_model_does_not_decimate(command: bytes) -> None:
    assert box("DI-1110").take(command) == b""


def test_what_a_program_sets_stays_when_the_scan_ends() -> None:
    instrument = box()
    instrument.take(b"encode 1\rdec 100\rstart 0\rstop\r")
    assert (instrument.as_text, instrument.decimation) == (True, 100)


def test_a_command_may_come_in_pieces() -> None:
    instrument = box()
    assert instrument.take(b"info") == b""
    assert instrument.take(b" 1\rinf") == b"info 1 2108\r\0"
    assert instrument.take(b"o 0\r") == b"info 0 DATAQ\r\0"


def test_nothing_is_echoed_while_scanning_until_it_stops() -> None:
    instrument = box()
    assert instrument.take(b"start 0\r") == b""
    assert instrument.scanning
    assert instrument.take(b"info 0\rslist 0 3\r") == b""
    assert instrument.scan_list == [0]
    assert instrument.take(b"stop\r") == b"stop\r\0"
    assert not instrument.scanning


def test_some_firmwares_echo_the_start() -> None:
    assert box(echoes_start=True).take(b"start 0\r") == b"start 0\r\0"


def test_an_input_is_in_the_scan_list_once() -> None:
    instrument = box()
    instrument.take(b"slist 0 0\rslist 1 1\r")
    assert instrument.take(b"slist 2 1\r") == b""
    assert instrument.scan_list == [0, 1]
    instrument.take(b"slist 0 5\r")
    assert instrument.scan_list == [5]


def test_the_rate_is_the_dividend_over_the_divisor() -> None:
    instrument = box("DI-1110")
    instrument.take(b"srate 375\r")
    assert instrument.aggregate_rate == 160_000.0
