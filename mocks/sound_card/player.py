"""A program that plays on a sound device what it reads: ``python -m mocks.sound_card.player``.

Arguments: the device's name, samples a second, channels, samples a block. What is to be played
comes on the standard input, in messages: a header (``HEADER``), then interleaved int32 samples.
The header's first number is the time on the bench clock at which the first of them is to be heard by the
device; ``AT_ONCE`` for after what waits, ``MEANWHILE`` for samples to repeat while nothing else is played
(silence until then). One full stop on the standard output says that it plays, an exclamation mark
that it came late and a gap was heard. It ends with its input.
"""

import os
import struct
import sys
import threading
from collections import deque
from typing import Any

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.clock import now
from harness.basics.resampling import resample

HEADER = struct.Struct("<dQ")
"""The time, and how many bytes follow."""

AT_ONCE, MEANWHILE = -1.0, -2.0

_TIMELINE = 400
_BROKEN = 1e-3
"""s by which a block's time leaves the others' where the device lost samples, and its time begins anew."""

_SURE = 5
"""Such blocks in a row that are believed."""

_TAPS = 64
_LATE = b"!"


class Queue:
    """A buffer of samples to play."""

    def __init__(self, rate: int, channels: int) -> None:
        self._rate = rate
        self._channels = channels
        self._meanwhile = np.zeros((1, channels), np.int32)
        self._waiting: list[tuple[int, AnyArray]] = []
        self._position = 0
        # Bench times of sample 0 as each block tells them; their median errs by microseconds.
        self._zeros: deque[float] = deque(maxlen=_TIMELINE)
        self._astray: list[float] = []
        self._lock = threading.Lock()

    def take(self, time: float, samples: AnyArray) -> None:
        """Obey one message."""
        if time >= 0.0:
            self._schedule(time, samples)
            return
        with self._lock:
            if time == MEANWHILE:
                self._meanwhile = samples
                return
            ends = [begin + len(waiting) for begin, waiting in self._waiting]
            self._waiting.append((max([self._position, *ends]), samples))

    def fill(self, block: Any, frames: int, times: Any, status: Any) -> None:
        """Fill a block for the sound library."""
        arrived = now()
        if status.output_underflow:
            os.write(sys.stdout.fileno(), _LATE)
        with self._lock:
            ahead = times.outputBufferDacTime - times.currentTime
            self._tell(arrived + ahead - self._position / self._rate)
            block[:] = self._next(frames).tobytes()

    def _tell(self, zero: float) -> None:
        """Take in when sample 0 would have been played, by one block's time."""
        if not self._zeros or abs(zero - float(np.median(self._zeros))) < _BROKEN:
            self._zeros.append(zero)
            self._astray = []
            return
        self._astray.append(zero)
        if len(self._astray) == _SURE:
            self._zeros = deque(self._astray, maxlen=_TIMELINE)
            self._astray = []

    def _next(self, frames: int) -> AnyArray:
        numbers = self._position + np.arange(frames)
        played: AnyArray = self._meanwhile[numbers % len(self._meanwhile)]
        for begin, samples in self._waiting:
            here = (numbers >= begin) & (numbers < begin + len(samples))
            played[here] = samples[numbers[here] - begin]
        self._position += frames
        self._waiting = [(b, samples) for b, samples in self._waiting if b + len(samples) > self._position]
        return played

    def _schedule(self, time: float, samples: AnyArray) -> None:
        """Between two samples of the device the sound is moved by a fraction of one."""
        with self._lock:
            exact = (time - float(np.median(self._zeros))) * self._rate
        begin = int(np.ceil(exact))
        # Outside the lock: the sound library does not wait.
        moved = _earlier(samples, begin - exact)
        with self._lock:
            if begin < self._position:
                os.write(sys.stdout.fileno(), _LATE)
                begin = self._position
            self._waiting.append((begin, moved))


def _earlier(samples: AnyArray, fraction: float) -> AnyArray:
    """Interleaved samples a fraction of a sample earlier; whole numbers again."""
    impulse = np.zeros(2 * _TAPS + 1)
    impulse[_TAPS] = 1.0
    places: FloatArray = np.arange(2.0 * _TAPS) + fraction
    taps = resample(impulse, 0.0, 1.0, places, 1.0)
    moved = [np.convolve(channel, taps)[_TAPS : _TAPS + len(samples)] for channel in samples.T]
    limits = np.iinfo(np.int32)
    whole: AnyArray = np.clip(np.rint(np.stack(moved, axis=1)), limits.min, limits.max)
    return whole.astype(np.int32)


def main(arguments: list[str]) -> None:
    """Play the standard input until it ends."""
    import sounddevice

    device, rate, channels, quantum = arguments[0], *map(int, arguments[1:])
    queue = Queue(rate, channels)
    stream = sounddevice.RawOutputStream(
        device=device,
        samplerate=rate,
        channels=channels,
        dtype="int32",
        blocksize=quantum,
        latency="high",
        clip_off=True,
        dither_off=True,
        callback=queue.fill,
    )
    with stream:
        os.write(sys.stdout.fileno(), b".")
        while len(header := sys.stdin.buffer.read(HEADER.size)) == HEADER.size:
            time, size = HEADER.unpack(header)
            queue.take(time, np.frombuffer(sys.stdin.buffer.read(size), np.int32).reshape(-1, channels))


if __name__ == "__main__":
    main(sys.argv[1:])
