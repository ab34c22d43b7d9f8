"""The microphone driver, unchanged, on a PipeWire null sink: every sample compared."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import drivers.microphone.microphone
from drivers.microphone.microphone import PortAudioMicrophone
from harness.basics.arrays import AnyArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.bench.device import Reading
from harness.bench.microphone_take import BAD, UNSURE, UNTRIGGERED, flags_of
from mocks.sound_card.card import SoundCard, why_not

pytestmark = pytest.mark.skipif(bool(why_not()), reason=why_not() or "a sound card can be mocked here")

RATE = 48000
ATTEMPTS = 8


@pytest.fixture(scope="module", params=[1, 2], ids=["mono", "stereo"])
def card(request: pytest.FixtureRequest) -> Iterator[SoundCard]:
    with SoundCard(RATE, request.param) as card, pytest.MonkeyPatch.context() as patch:
        for name, value in card.environment.items():
            patch.setenv(name, value)
        yield card


@pytest.fixture
def microphone(card: SoundCard) -> Iterator[PortAudioMicrophone]:
    microphone = listener(card, 24)
    microphone.open()
    yield microphone
    microphone.close()


def listener(card: SoundCard, bits: int) -> PortAudioMicrophone:
    """The card's last channel, so that a swap with another would show."""
    return PortAudioMicrophone(
        card.microphone, RATE, card.channels, channel=card.channels - 1, bits=bits, threshold=1
    )


def any_counts(samples: int, channels: int) -> AnyArray:
    """Every 24-bit count is as likely, and both ends of the scale are there; the first is not zero."""
    counts = np.random.default_rng(4).integers(-(2**23), 2**23, (samples, channels))
    counts[:4] = np.array([[1], [2**23 - 1], [-(2**23)], [-1]])
    return (counts << 8).astype(np.int32)


def span(sound: AnyArray) -> int:
    """Samples from the first that is not silent to the last."""
    loud = np.flatnonzero(sound)
    return int(loud[-1] - loud[0]) if len(loud) else 0


def heard(card: SoundCard, microphone: PortAudioMicrophone, played: AnyArray) -> tuple[Reading, ...]:
    """A take that neither side calls bad; a late computer is no fault of the samples' path.

    The driver flags what it lost. What the player was late for lies as silence in the sound,
    which then lasts longer than what was played; a take that is too short is never excused.
    """
    seconds = len(played) / RATE
    for _ in range(ATTEMPTS):
        card.stumbles()
        take = microphone.capture(lambda: card.play(played), 0.05, seconds + 0.05, 3.0)
        late = card.stumbles() or span(take[0].values.ravel()) > span(played[:, -1])
        if not late and not flags_of(take) & (BAD | UNTRIGGERED):
            return take
        time.sleep(0.3)
    pytest.fail(f"{ATTEMPTS} takes in a row were called bad")


@pytest.mark.parametrize("bits", [24, 32])
def test_every_sample_arrives_as_it_was_played(card: SoundCard, bits: int) -> None:
    played = any_counts(2 * RATE, card.channels)
    microphone = listener(card, bits)
    microphone.open()
    sound = heard(card, microphone, played)[0].values.ravel()
    microphone.close()
    expected = played[:, -1] >> (32 - bits)
    begin = int(np.flatnonzero(sound)[0])
    assert np.array_equal(sound[begin : begin + len(expected)], expected)
    assert not np.any(sound[:begin])
    assert not np.any(sound[begin + len(expected) :])


def test_clicks_keep_their_distance(card: SoundCard, microphone: PortAudioMicrophone) -> None:
    played = np.zeros((RATE, card.channels), np.int32)
    played[::4800] = 2**30
    take = heard(card, microphone, played)
    clicks = np.flatnonzero(take[0].values.ravel())
    assert np.array_equal(np.diff(clicks), np.full(9, 4800))


def test_the_clock_is_fitted_to_the_bench_clock(card: SoundCard, microphone: PortAudioMicrophone) -> None:
    played = np.full((100, card.channels), 2**30, np.int32)
    asked = now()
    for _ in range(ATTEMPTS):  # a late computer makes a take unsure, and says so
        pressure, _, callback, clock = heard(card, microphone, played)
        _, _, rate, residual, uncertainty, opened = clock.values[0]
        if uncertainty < UNSURE:
            break
    assert uncertainty < UNSURE
    assert opened < asked
    # The card's timer is this computer's: over the take, a rate that is not the nominal one misplaces
    # samples by no more than the place of the take is uncertain.
    lasts = pressure.times[-1] - pressure.times[0]
    assert abs(rate / RATE - 1.0) * lasts < 5.0 * uncertainty
    assert rate == pytest.approx(RATE, rel=2e-3)
    assert residual < 2e-3
    # On a computer that is up for a day, times in s have a spacing of 1.5e-11, more than 1e-9 of a block.
    spacing = float(np.spacing(pressure.times[-1]))
    assert np.diff(pressure.times) == pytest.approx(512 / rate, rel=1e-9, abs=2.0 * spacing)
    assert np.all(pressure.times + 512 / rate < callback.values[:, 0] + 2e-3)
    assert pressure.times[-1] > asked


def test_a_computer_late_for_a_second_is_noticed(
    monkeypatch: pytest.MonkeyPatch, microphone: PortAudioMicrophone
) -> None:
    pauses = [1.0]

    def late_clock() -> float:
        if pauses and threading.current_thread() is not threading.main_thread():
            time.sleep(pauses.pop())
        return now()

    monkeypatch.setattr(drivers.microphone.microphone, "STALL", 3.0)
    microphone.record(0.5)
    monkeypatch.setattr(drivers.microphone.microphone, "now", late_clock)
    take = microphone.record(1.5)
    assert not pauses
    assert flags_of(take) & BAD


def test_silence_is_said_to_be_silent(microphone: PortAudioMicrophone) -> None:
    take = microphone.capture(lambda: None, 0.1, 0.1, 0.3)
    assert flags_of(take) & UNTRIGGERED
    assert not np.any(take[0].values)


def test_health_names_the_device_and_its_measured_rate(microphone: PortAudioMicrophone) -> None:
    microphone.record(0.5)
    health = microphone.health()
    assert "mock_microphone by PortAudio, 24 bit" in health.identity
    assert health.rate == pytest.approx(RATE, rel=1e-3)
    assert health.latency is not None


def test_another_name_lists_those_that_there_are(card: SoundCard) -> None:
    with pytest.raises(BenchFault, match=r"'Scarlett'.*'mock_microphone, ALSA'"):
        PortAudioMicrophone("Scarlett", RATE).open()


def test_another_number_of_channels_is_refused(card: SoundCard) -> None:
    asked = 3 - card.channels
    expected = rf"\b{card.channels} input channels.* {asked}\b"
    with pytest.raises(BenchFault, match=expected):
        PortAudioMicrophone(card.microphone, RATE, asked).open()


def test_a_rate_that_the_card_has_not_is_refused(card: SoundCard) -> None:
    with pytest.raises(BenchFault, match=r"24 bit.*44100 Hz"):
        PortAudioMicrophone(card.microphone, 44100, card.channels).open()


def test_a_card_taken_away_is_named_and_a_new_one_is_heard(monkeypatch: pytest.MonkeyPatch) -> None:
    with SoundCard(RATE) as card:
        monkeypatch.setenv("ALSA_CONFIG_PATH", card.environment["ALSA_CONFIG_PATH"])
        microphone = listener(card, 24)
        microphone.open()
        card.unplug()
        with pytest.raises(BenchFault, match=r"'mock_microphone'.*0\.5 s"):
            microphone.record(2.0)
        microphone.close()
        with pytest.raises(BenchFault) as refused:
            microphone.open()
        assert "\n" not in str(refused.value)
    with SoundCard(RATE) as card:
        monkeypatch.setenv("ALSA_CONFIG_PATH", card.environment["ALSA_CONFIG_PATH"])
        microphone.open()
        microphone.record(0.1)
        microphone.close()


_PARENT = """
import sys, time
from mocks.sound_card.card import SoundCard
card = SoundCard()
card.start()
print(card._folder, *[child.pid for child in card._children], flush=True)
time.sleep(60)
"""


def test_its_processes_end_with_the_one_that_started_them() -> None:
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, "PYTHONPATH": root}
    parent = subprocess.Popen([sys.executable, "-c", _PARENT], stdout=subprocess.PIPE, env=environment)
    assert parent.stdout is not None
    folder, *numbers = parent.stdout.readline().decode().split()
    children = [int(number) for number in numbers]
    assert len(children) == 3
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    deadline = now() + 60.0
    while any(Path(f"/proc/{child}").exists() for child in children):
        assert now() < deadline, "a process of the sound card outlives its parent"
        time.sleep(0.05)
    shutil.rmtree(folder)


def test_what_cannot_be_played_is_refused(card: SoundCard) -> None:
    for counts in (np.zeros((4, 3), np.int32), np.zeros(4, np.int32), np.zeros((4, card.channels))):
        with pytest.raises(ValueError, match="int32"):
            card.play(counts)
