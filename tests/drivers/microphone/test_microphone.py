"""The microphone driver on a sound library whose callbacks the test makes."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import drivers.microphone.microphone
from drivers.microphone.microphone import PortAudioMicrophone
from harness.basics.arrays import AnyArray
from harness.basics.errors import BenchFault
from harness.bench.device import Microphone
from harness.bench.microphone_take import (
    COUNT_BROKEN,
    OTHER_STATUS,
    OVERLOAD,
    SAMPLES_LOST,
    SILENCE_INSERTED,
    UNTRIGGERED,
    flags_of,
)
from tests.support.fake_portaudio import FakePortAudio, FakeStream, Status

RATE, BLOCK = 48000, 480
MONO = "Lab card: USB Audio #1 (hw:2,0)"


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> FakePortAudio:
    library = FakePortAudio()
    monkeypatch.setitem(sys.modules, "sounddevice", library)
    monkeypatch.setattr(drivers.microphone.microphone, "now", lambda: library.time)
    monkeypatch.setattr(drivers.microphone.microphone, "STALL", 2.0)  # this computer may be busy
    return library


@pytest.fixture
def microphone(library: FakePortAudio) -> Iterator[PortAudioMicrophone]:
    microphone = PortAudioMicrophone(MONO, RATE, block=BLOCK, threshold=1000)
    microphone.open()
    yield microphone
    microphone.close()


@pytest.fixture
def stream(library: FakePortAudio, microphone: PortAudioMicrophone) -> FakeStream:
    assert library.stream is not None
    for _ in range(49):  # half a second has been heard
        library.stream.deliver()
    return library.stream


def ramp(first: int = 0) -> AnyArray:
    return np.arange(first, first + BLOCK, dtype=np.int32)


def settle(stream: FakeStream, age: float | None = None) -> None:
    """The blocks after a take that show whether its count is whole."""
    for _ in range(25):
        stream.deliver(age=age)


def delivering(stream: FakeStream, *blocks: AnyArray | None) -> Callable[[], None]:
    def run() -> None:
        for block in blocks:
            stream.deliver(block)
        settle(stream)

    return run


def deliver_soon(stream: FakeStream, blocks: int, every: float = 0.0) -> threading.Thread:
    def run() -> None:
        time.sleep(0.05)
        for _ in range(blocks):
            stream.deliver()
            time.sleep(every)
        settle(stream)

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def test_it_is_a_microphone_as_experiments_know_it(
    microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    known: Microphone = microphone  # the type checker compares the methods
    assert known.health().rate == pytest.approx(RATE, rel=1e-6)


def test_counts_come_as_they_were_sampled(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    sent = [ramp(1000 + BLOCK * number) for number in range(5)]
    take = microphone.capture(delivering(stream, *sent), 0.01, 0.04, 1.0)
    sound = take[0].values.ravel()
    assert take[0].values.dtype == np.int32
    # The first sample above the threshold is the ramp's second; one whole block goes before it.
    assert np.array_equal(sound[BLOCK:], np.concatenate(sent)[: len(sound) - BLOCK])
    assert not np.any(sound[:BLOCK])
    assert len(sound) >= BLOCK + 0.04 * RATE
    assert flags_of(take) == 0


def test_one_block_of_a_reading_is_one_callback(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    thread = deliver_soon(stream, 10)
    pressure, flags, callback, clock = microphone.record(0.1)
    thread.join()
    assert pressure.channel.name == "microphone.pressure"
    assert pressure.channel.unit == "count"
    assert pressure.values.shape == (10, BLOCK)
    assert flags.values.shape == (10,)
    assert callback.values[:, 1] == pytest.approx(0.01)
    assert callback.values[:, 0] - callback.values[:, 1] == pytest.approx(pressure.times, abs=1e-6)
    assert clock.values[0, 2] == pytest.approx(RATE, rel=1e-6)


@pytest.mark.parametrize(
    ("status", "flag"),
    [
        (Status(input_overflow=True), SAMPLES_LOST),
        (Status(input_underflow=True), SILENCE_INSERTED),
        (Status(output_underflow=True), OTHER_STATUS),
    ],
)
def test_an_xrun_marks_the_take(
    microphone: PortAudioMicrophone, stream: FakeStream, status: Status, flag: int
) -> None:
    def fire() -> None:
        stream.deliver(ramp(2000))
        stream.deliver(status=status, elapsed=0.05)
        for _ in range(4):
            stream.deliver()
        settle(stream)

    take = microphone.capture(fire, 0.0, 0.05, 1.0)
    assert flags_of(take) & flag
    assert list(np.flatnonzero(take[1].values & flag)) == [1]
    assert microphone.health().drops == 1


def test_the_take_after_an_xrun_is_good_and_its_clock_begins_anew(
    library: FakePortAudio, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    stream.deliver(status=Status(input_overflow=True), elapsed=0.07)
    for _ in range(60):
        stream.deliver()
    began = library.time
    thread = deliver_soon(stream, 10)
    take = microphone.record(0.1)
    thread.join()
    assert flags_of(take) == 0
    assert take[0].times[0] == pytest.approx(began, abs=1e-6)
    assert take[3].values[0, 3] < 1e-6


def test_samples_lost_without_a_word_are_noticed(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    def fire() -> None:
        stream.deliver(ramp(2000))
        stream.deliver(elapsed=0.02)  # one block has gone nowhere
        for _ in range(40):
            stream.deliver()
        settle(stream)

    assert flags_of(microphone.capture(fire, 0.1, 0.4, 1.0)) == COUNT_BROKEN


def test_one_late_callback_is_no_fault(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    def fire() -> None:
        stream.deliver(ramp(2000))
        stream.deliver(late=0.1, age=0.01)  # PortAudio does not know of the lateness
        for _ in range(40):
            stream.deliver()
        settle(stream)

    take = microphone.capture(fire, 0.1, 0.4, 1.0)
    assert flags_of(take) == 0
    assert np.diff(take[0].times) == pytest.approx(BLOCK / RATE, rel=1e-5)


def test_a_back_end_without_times_is_read_by_arrival(
    library: FakePortAudio, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    began = library.time

    def fire() -> None:
        stream.deliver(ramp(2000), age=0.0)
        for _ in range(20):
            stream.deliver(age=0.0)
        settle(stream, age=0.0)

    take = microphone.capture(fire, 0.0, 0.2, 1.0)
    assert take[0].times[0] == pytest.approx(began, abs=1e-6)
    assert np.all(take[2].values[:, 1] == 0.0)
    assert microphone.health().latency is None
    assert "does not say when it sampled" in microphone.health().detail


def test_the_sound_of_a_past_stretch_of_the_bench_clock_is_given(
    library: FakePortAudio, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    began = library.time
    sent = [ramp(1000 + BLOCK * number) for number in range(8)]
    delivering(stream, *sent)()
    length = BLOCK / RATE
    take = microphone.between(began + 2.5 * length, began + 4.5 * length)
    # PortAudio hands a block over when it is full: the first one sent was sampled from `began` on.
    assert take[0].times == pytest.approx(began + length * np.arange(2, 5), abs=1e-6)
    assert np.array_equal(take[0].values.ravel(), np.concatenate(sent[2:5]))
    assert take[3].values[0, -1] == pytest.approx(1000.0)
    assert flags_of(take) == 0


def test_sound_that_is_still_to_come_is_awaited(
    library: FakePortAudio, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    start = library.time + 0.05
    thread = deliver_soon(stream, 10)
    take = microphone.between(start, start + 0.04)
    thread.join()
    assert take[0].times[0] <= start + 1e-6
    assert take[0].times[-1] + BLOCK / RATE >= start + 0.04


def test_a_stated_latency_is_taken_off(library: FakePortAudio) -> None:
    late = PortAudioMicrophone(MONO, RATE, block=BLOCK, latency=3e-3)
    late.open()
    stream = library.stream
    assert stream is not None
    began = library.time
    delivering(stream, *(ramp(1000 + BLOCK * number) for number in range(4)))()
    pressure, _, callback, clock = late.between(began, began + 0.02)
    late.close()
    assert pressure.values[0, 0] == 1000  # it ends 7 ms after ``began``
    assert pressure.times[0] == pytest.approx(began - 3e-3, abs=1e-6)
    assert callback.values[0, 0] == pytest.approx(began + BLOCK / RATE, abs=1e-6)
    assert clock.values[0, 1] + (0 - clock.values[0, 0]) / RATE == pytest.approx(1000.0 - 3e-3, abs=1e-4)


def test_sound_from_before_the_opening_or_forgotten_is_refused(
    library: FakePortAudio, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    with pytest.raises(BenchFault, match=r"0\.50 s.*30 s"):
        microphone.between(library.time - 1.0, library.time - 0.9)


def test_no_sound_is_flagged_not_raised(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    thread = deliver_soon(stream, 12, every=0.05)
    take = microphone.capture(lambda: None, 0.1, 0.1, 0.2)
    thread.join()
    assert flags_of(take) == UNTRIGGERED
    assert take[0].values.size >= 0.2 * RATE


def test_a_sound_before_the_call_is_no_trigger(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    stream.deliver(ramp(5000))
    for _ in range(30):
        stream.deliver()
    thread = deliver_soon(stream, 12, every=0.05)
    take = microphone.capture(lambda: None, 0.1, 0.1, 0.2)
    thread.join()
    assert flags_of(take) & UNTRIGGERED


def test_a_constant_offset_does_not_trigger(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    offset = np.full(BLOCK, 5000, np.int32)
    for _ in range(30):
        stream.deliver(offset)

    def fire() -> None:
        for _ in range(3):
            stream.deliver(offset)
        stream.deliver(offset - ramp(600) * 2)
        settle(stream)

    take = microphone.capture(fire, 0.01, 0.01, 1.0)
    assert flags_of(take) == 0
    assert take[0].values[1, 0] == 5000 - 1200


def test_an_overloaded_converter_is_flagged(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    loud = ramp(2000)
    loud[100:103] = 2**23 - 1
    take = microphone.capture(delivering(stream, loud, None), 0.0, 0.01, 1.0)
    assert flags_of(take) == OVERLOAD


def test_a_device_that_falls_silent_is_named(
    monkeypatch: pytest.MonkeyPatch, microphone: PortAudioMicrophone, stream: FakeStream
) -> None:
    monkeypatch.setattr(drivers.microphone.microphone, "STALL", 0.2)
    with pytest.raises(BenchFault, match=r"hw:2,0.*0\.2 s"):
        microphone.record(0.1)
    with pytest.raises(BenchFault, match="hw:2,0"):
        microphone.capture(lambda: None, 0.1, 0.1, 0.1)


def test_another_rate_than_asked_for_is_refused(microphone: PortAudioMicrophone, stream: FakeStream) -> None:
    for _ in range(250):
        stream.deliver(elapsed=BLOCK / 44100)
    thread = deliver_soon(stream, 10)
    with pytest.raises(BenchFault, match=r"4[0-9]{4} .*48000"):
        microphone.record(0.05)
    thread.join()


def test_opening_and_closing_twice_does_nothing_more(
    library: FakePortAudio, microphone: PortAudioMicrophone
) -> None:
    first = library.stream
    microphone.open()
    assert library.stream is first
    microphone.close()
    microphone.close()
    assert first is not None
    assert first.closed
    with pytest.raises(BenchFault, match=r"^\D*opened\D*$"):
        microphone.record(0.1)


def test_the_right_channel_of_two_is_read(library: FakePortAudio) -> None:
    microphone = PortAudioMicrophone("Lab card: USB Audio (hw:1,0)", RATE, 2, 1, 32, BLOCK, threshold=10)
    microphone.open()
    stream = library.stream
    assert stream is not None
    both = np.column_stack([np.full(BLOCK, 7), ramp(100)]).ravel().astype(np.int32)
    take = microphone.capture(delivering(stream, both, None), 0.0, 0.01, 1.0)
    microphone.close()
    assert np.array_equal(take[0].values[0], ramp(100))
    assert stream.settings["dither_off"]
    assert stream.settings["clip_off"]


def test_a_device_is_chosen_by_a_part_of_its_name_if_one_has_it(library: FakePortAudio) -> None:
    for name in (MONO, f"{MONO}, ALSA", "hw:2"):
        microphone = PortAudioMicrophone(name, RATE, block=BLOCK)
        microphone.open()
        assert library.stream is not None
        assert library.stream.settings["device"] == 2
        microphone.close()


def test_a_name_that_fits_two_or_none_lists_what_there_is(library: FakePortAudio) -> None:
    with pytest.raises(BenchFault, match=r"'Lab card'.* 2 .*hw:1,0.*hw:2,0"):
        PortAudioMicrophone("Lab card", RATE).open()
    with pytest.raises(BenchFault, match=r"'Loud speaker'.*hw:1,0.*hw:2,0"):
        PortAudioMicrophone("Loud speaker", RATE).open()
    library.devices = ()
    with pytest.raises(BenchFault, match=r"'Lab card'.*none"):
        PortAudioMicrophone("Lab card", RATE).open()


def test_another_number_of_channels_is_refused(library: FakePortAudio) -> None:
    with pytest.raises(BenchFault, match=r"2 input channels.* 1"):
        PortAudioMicrophone("Lab card: USB Audio (hw:1,0)", RATE).open()


def test_what_the_device_does_not_do_is_one_sentence(library: FakePortAudio) -> None:
    library.refusal = "Invalid sample rate"
    with pytest.raises(BenchFault, match="48000 Hz: Invalid sample rate") as refused:
        PortAudioMicrophone(MONO, RATE).open()
    assert "\n" not in str(refused.value)


def test_a_missing_package_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    with pytest.raises(BenchFault, match="pip install sounddevice"):
        PortAudioMicrophone(MONO, RATE).open()


def test_a_missing_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "sounddevice.py").write_text("raise OSError('PortAudio library not found')")
    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BenchFault, match="apt-get install libportaudio2"):
        PortAudioMicrophone(MONO, RATE).open()


def test_the_list_of_devices_is_made_anew_unless_a_stream_is_open(library: FakePortAudio) -> None:
    first, second = PortAudioMicrophone(MONO, RATE), PortAudioMicrophone(MONO, RATE)
    first.open()
    second.open()
    assert library.listed == 1
    first.close()
    second.close()
    first.open()
    first.close()
    assert library.listed == 2


def test_numbers_that_cannot_be_are_a_programming_error(microphone: PortAudioMicrophone) -> None:
    for bits, channel, block, threshold in ((16, 0, 512, 1), (24, 1, 512, 1), (24, 0, 0, 1), (24, 0, 512, 0)):
        with pytest.raises(ValueError, match="24 or 32"):
            PortAudioMicrophone(MONO, RATE, 1, channel, bits, block, threshold)
    for seconds in (0.0, 16.0):
        with pytest.raises(ValueError, match=r"\b15(\.0)? s"):
            microphone.record(seconds)
