"""A microphone on a sound card, by PortAudio: raw counts, the clock fitted, every doubt flagged."""

import threading
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np

from drivers.microphone.readings import (
    SETTLE,
    Block,
    Blocks,
    Format,
    Trigger,
    clock_of,
    places_of_doubt,
    readings,
    starts,
    states_ages,
    unbroken,
    usual_rate,
)
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.starvation import WATCH, name_cause
from harness.bench.device import Health, Reading
from harness.bench.microphone_take import OTHER_STATUS, SAMPLES_LOST, SILENCE_INSERTED, UNTRIGGERED

STALL = 0.5
"""s without a block after which the device is taken to be gone."""

OPEN_TIMEOUT = 5.0
"""s until a stream that delivers nothing is given up."""

BUFFER = 0.5
"""s of sound that the library keeps for a computer that is late."""

RATE_TOLERANCE = 1e-2
"""Largest relative difference of the measured rate from the asked one; no crystal is that far off."""

_CLOCK_SECONDS = 10.0
_BASELINE_SECONDS = 0.2
_BITS = (24, 32)


class PortAudioMicrophone:
    """A microphone as a sound card's input; a ``Microphone``.

    Open the card itself (on Linux a device with ``hw:`` in its name). A sound server between
    resamples and mixes without a word; channel counts are therefore compared exactly.

    Args:
        device: its name; see `find_input`.
        rate: samples a second; one that the card has itself.
        channels: that the device has, exactly.
        channel: which of them is the microphone, from 0.
        bits: 24 or 32, of one count.
        block: samples handed over at a time.
        threshold: counts from the baseline at which `capture` triggers, above zero.
        name: of the instrument, as messages call it.
        serial: of the microphone, as the station states it.
        keep: s of sound kept.
        latency: s by which the card's times are late, as measured; taken off every time.

    Raises:
        ValueError: a number above that cannot be.
    """

    def __init__(
        self,
        device: str,
        rate: int,
        channels: int = 1,
        channel: int = 0,
        bits: int = 24,
        block: int = 512,
        threshold: int = 2**18,
        name: str = "microphone",
        serial: str = "",
        keep: float = 30.0,
        latency: float = 0.0,
    ) -> None:
        if bits not in _BITS or not 0 <= channel < channels or min(rate, block, threshold) < 1:
            raise ValueError(
                f"{name}: bits must be 24 or 32 (is {bits}), channel below channels ({channel}, {channels}), "
                f"and rate, block and threshold above zero ({rate}, {block}, {threshold})"
            )
        self.name = name
        self.form = Format(rate, bits, channels, channel, block, latency)
        self._device = device
        self._serial = serial
        self._threshold = threshold
        self._keep = keep
        self._blocks = self._empty()
        self._next = 0
        self._opened = 0.0
        self._stream: Any = None

    def open(self) -> None:
        """Begin to listen, and wait for the first block; does nothing if already open.

        Raises:
            BenchFault: PortAudio or the device is missing, the device has another number of
                channels or not this rate, or it is silent.
        """
        if self._stream is not None:
            return
        WATCH.start()
        library = _acquire()
        try:
            self._stream = self._begin(library)
        except BaseException:
            release()
            raise
        try:
            self._hear(1, OPEN_TIMEOUT)
        except BenchFault:
            self.close()
            raise

    def close(self) -> None:
        """Stop listening; does nothing if already closed."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None
            release()

    def record(self, seconds: float) -> tuple[Reading, ...]:
        """The next ``seconds`` of sound, in whole blocks.

        Returns:
            As `drivers.microphone.readings.readings`; a bad take says so in ``microphone.flags``.

        Raises:
            BenchFault: the microphone is not open, is gone, or runs at another rate than asked.
        """
        self._require(seconds)
        first = self._heard()
        end = first + self._samples(seconds)
        return self._readings(first, end)

    def between(self, start: float, end: float) -> tuple[Reading, ...]:
        """The sound from ``start`` to ``end`` s on the bench clock, remembered or awaited, in whole blocks.

        Returns:
            As `record`.

        Raises:
            BenchFault: as `record`; or the sound of ``start`` is not kept, or was before the opening.
        """
        self._require(end - start)
        blocks = self._blocks.since(0)
        # By each block's own measured time: a line through all of them is no guide across a gap.
        began = starts(blocks, self.form) - self.form.latency
        before = np.flatnonzero(began <= start)
        if not len(before):
            raise BenchFault(
                f"{self.name}: the sound of {began[0] - start:.2f} s is not there any more, or was before it "
                f"was opened; {self._keep:g} s are kept: ask for it sooner"
            )
        first = blocks[before[-1]].first + self._samples(max(0.0, start - began[-1]))
        return self._readings(first, first + self._samples(end - start) + self.form.block)

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Call ``fire()`` and record the sound that follows.

        The trigger is the first sample, of those handed over after the call, further than
        ``threshold`` from the median of the last 0.2 s before it.

        Args:
            fire: makes the sound; may return before it is heard.
            before: s to record before the trigger.
            after: s to record after it.
            timeout: s to wait for the trigger.

        Returns:
            As `record`; where nothing triggered, the newest ``before + after`` s, flagged.

        Raises:
            BenchFault: the microphone is not open, is gone, or runs at another rate than asked.
        """
        self._require(before + after)
        self._hear(self._samples(before), STALL)
        start = self._heard()
        blocks = self._blocks.since(start - self._samples(_BASELINE_SECONDS))
        counts = [self.form.counts(block.counts) for block in blocks if block.first < start]
        baseline = float(np.median(np.concatenate(counts))) if counts else 0.0
        trigger = Trigger(self._blocks, self.form, start, baseline, self._threshold)
        total = self._blocks.total
        fire()
        if not self._hear_trigger(trigger, total, timeout):
            end = self._heard()
            return self._readings(end - self._samples(before + after), end, UNTRIGGERED)
        end = trigger.index + self._samples(after)
        return self._readings(trigger.index - self._samples(before), end)

    def health(self) -> Health:
        """Rate by the fitted clock, bad blocks and the sound's age on arrival, since opening."""
        identity = f"{self._device} {self._serial}".strip() + f" by PortAudio, {self.form.bits} bit"
        blocks = self._blocks.since(0)
        if not blocks:
            return Health(self.name, identity, 0.0, 0, None, "nothing heard yet")
        whole = unbroken(blocks, places_of_doubt(blocks, self.form), self._next, self.form)
        clock = clock_of(whole or blocks, self.form)
        stated = states_ages(blocks, self.form)
        latency = median(block.age for block in blocks) if stated else None
        detail = f"clock fitted to {clock.residual * 1e6:.0f} us"
        detail += "" if stated else "; the sound card does not say when it sampled"
        detail += "" if len(whole) == len(blocks) else f"; samples were lost within {self._keep:g} s"
        return Health(self.name, identity, clock.rate, self._blocks.bad, latency, detail)

    def _begin(self, library: Any) -> Any:
        """The stream, running."""
        found = _find_input(library, self._device, self.form.channels)
        self._blocks = self._empty()
        self._next, self._opened = 0, now()
        kind = {
            "device": found["index"],
            "channels": self.form.channels,
            "dtype": f"int{self.form.bits}",
            "samplerate": self.form.rate,
        }
        try:
            library.check_input_settings(**kind)
            # A long buffer: a late computer then loses nothing. Clipping and dither are left off:
            # both would change counts.
            stream = library.RawInputStream(
                **kind,
                blocksize=self.form.block,
                latency=BUFFER,
                clip_off=True,
                dither_off=True,
                callback=self._listen,
            )
            stream.start()
        except library.PortAudioError as error:
            raise BenchFault(
                f"{self.name}: {found['name']!r} does not open with {self.form.channels} channels of "
                f"{self.form.bits} bit at {self.form.rate} Hz: {error.args[0]}; "
                "close other programs that use it, or set another rate in the station"
            ) from error
        return stream

    def _listen(self, data: Any, frames: int, times: Any, status: Any) -> None:
        """PortAudio's thread: keep the block and what is known of it, and nothing else."""
        arrived = now()
        flags = SILENCE_INSERTED * bool(status.input_underflow) | SAMPLES_LOST * bool(status.input_overflow)
        if status and not flags and not status.priming_output:
            flags = OTHER_STATUS
        age = times.currentTime - times.inputBufferAdcTime if times.inputBufferAdcTime > 0.0 else 0.0
        self._blocks.add(Block(self._next, arrived, age, flags, bytes(data)))
        self._next += frames

    def _empty(self) -> Blocks:
        capacity = int(np.ceil(self._keep * self.form.rate / self.form.block))
        return Blocks(capacity, self.form.block)

    def _require(self, seconds: float) -> None:
        if not 0.0 < seconds <= 0.5 * self._keep:
            raise ValueError(
                f"{seconds:g} s asked for; above zero and up to {0.5 * self._keep:g} s can be kept"
            )
        if self._stream is None:
            raise BenchFault(f"{self.name} was read before it was opened; open the bench first")

    def _samples(self, seconds: float) -> int:
        return int(np.ceil(seconds * self.form.rate))

    def _heard(self) -> int:
        newest = self._blocks.newest()
        return 0 if newest is None else newest.first + self.form.block

    def _hear(self, end: int, stall: float) -> None:
        """Wait until sample number ``end`` is there; a fault where blocks cease for ``stall`` s."""
        while True:
            total = self._blocks.total
            if self._blocks.wait(lambda: self._heard() >= end, stall):
                return
            if self._blocks.total == total:
                raise self._gone(stall)

    def _hear_trigger(self, trigger: Trigger, total: int, timeout: float) -> bool:
        """Whether it comes within ``timeout`` s; a fault where blocks have ceased since the ``total``-th."""
        if self._blocks.wait(trigger.look, timeout):
            return True
        newest = self._blocks.total
        if newest == total or not self._blocks.wait(lambda: self._blocks.total > newest, STALL):
            raise self._gone(STALL)
        return False

    def _gone(self, seconds: float) -> BenchFault:
        return BenchFault(
            f"{self.name}: {self._device!r} has sent nothing for {seconds:g} s: "
            + name_cause(
                "the device is gone or its sound server has stopped; check its cable, then open the bench "
                "again",
                now() - seconds,
            )
        )

    def _readings(self, first: int, end: int, flags: int = 0) -> tuple[Reading, ...]:
        # A loss shows in the blocks that follow it, so some are awaited that are not returned.
        self._hear(end + self._samples(1.1 * SETTLE), STALL)
        heard = self._blocks.since(first - self._samples(_CLOCK_SECONDS))
        rate = usual_rate(heard, self.form)
        if abs(rate / self.form.rate - 1.0) > RATE_TOLERANCE:
            raise BenchFault(
                f"{self.name}: {self._device!r} delivers {rate:.0f} samples a second and "
                f"{self.form.rate} were asked for; set a rate that the device has itself"
            )
        return readings(heard, first, end, self.form, self._opened, flags)


_lock = threading.Lock()
_users = 0


def _acquire() -> Any:
    """Return the ``sounddevice`` module with the present devices; ``release`` it after use.

    PortAudio lists devices only when it starts, and a microphone may have been plugged in since.
    It is restarted unless this process is using it.
    """
    global _users
    with _lock:
        library = _load()
        if _users == 0:
            try:
                # sounddevice documents no other way to see new devices.
                library._terminate()  # noqa: SLF001
                library._initialize()  # noqa: SLF001
            except library.PortAudioError as error:
                reason = str(error.args[0]) if error.args else type(error).__name__
                raise BenchFault(
                    f"PortAudio did not start: {reason}; check the system's sound settings"
                ) from error
        _users += 1
        return library


def release() -> None:
    """Say that a stream opened after `acquire` is closed."""
    global _users
    with _lock:
        _users -= 1


def _load() -> Any:
    try:
        import sounddevice
    except ImportError as missing:
        raise BenchFault(
            "a microphone needs the Python package sounddevice; say: pip install sounddevice"
        ) from missing
    except OSError as missing:  # the package looks for the library when it is imported
        raise BenchFault(
            "a microphone needs the PortAudio library, and it is not installed; "
            "on Debian or Ubuntu say: apt-get install libportaudio2"
        ) from missing
    return sounddevice


def _find_input(library: Any, device: str, channels: int) -> dict[str, Any]:
    """The one input device of that name, which must have just so many channels.

    A device is named as PortAudio names it, or by its name, a comma, a space and its host API
    (``"Scarlett 2i2 USB: Audio (hw:1,0), ALSA"``), or by a part of one name only.

    Raises:
        BenchFault: there is none, or more than one; lists those that there are. Or it has another
            number of channels.
    """
    interfaces = library.query_hostapis()
    inputs = [dict(found) for found in library.query_devices() if found["max_input_channels"] > 0]
    full = {f"{each['name']}, {interfaces[each['hostapi']]['name']}": each for each in inputs}
    chosen = [each for name, each in full.items() if device in (name, each["name"])]
    chosen = chosen or [each for name, each in full.items() if device and device in name]
    if len(chosen) == 1:
        found = chosen[0]
        if found["max_input_channels"] != channels:
            raise BenchFault(
                f"microphone: {found['name']!r} has {found['max_input_channels']} input channels and the "
                f"station says {channels}; another number would be mixed without a word: set the station's "
                "channels to the device's"
            )
        return found
    there = "; ".join(repr(name) for name in full) or "none at all"
    problem = "is no sound input here" if not chosen else f"fits {len(chosen)} sound inputs"
    raise BenchFault(
        f"microphone: {device!r} {problem}; plug it in or name one of these in the station: {there}"
    )
