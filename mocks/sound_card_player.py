"""A program that plays on a sound device what it reads: ``python -m mocks.sound_card_player``.

Arguments: the device's name, samples a second, channels, samples a block. Interleaved int32
samples come on the standard input; where none have come, silence is played. One full stop on
the standard output says that it plays, an exclamation mark that it came late and a gap was
heard. It ends with its input.
"""

import os
import sys
import threading
from typing import Any

_CHUNK = 1 << 16


class Queue:
    """Bytes that wait to be played."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._lock = threading.Lock()

    def put(self, samples: bytes) -> None:
        """Play these after what waits."""
        with self._lock:
            self._bytes += samples

    def fill(self, block: Any, _frames: int, _times: Any, status: Any) -> None:
        """Fill a block for the sound library: what waits, then silence."""
        if status.output_underflow:
            os.write(sys.stdout.fileno(), b"!")
        with self._lock:
            played = bytes(self._bytes[: len(block)])
            del self._bytes[: len(block)]
        block[:] = played.ljust(len(block), b"\0")


def main(arguments: list[str]) -> None:
    """Play the standard input until it ends."""
    import sounddevice

    device, rate, channels, quantum = arguments[0], *map(int, arguments[1:])
    queue = Queue()
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
        while samples := os.read(sys.stdin.fileno(), _CHUNK):
            queue.put(samples)


if __name__ == "__main__":
    main(sys.argv[1:])
