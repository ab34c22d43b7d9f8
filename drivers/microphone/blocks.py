"""A microphone's newest blocks, as the sound library handed them over."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray
from harness.bench.microphone_take import BAD


@dataclass(frozen=True)
class Block:
    """What one callback handed over."""

    first: int  #: number of its first sample since the stream began.
    arrived: float  #: s on the bench clock, at the callback.
    age: float  #: s from its first sample's conversion to the callback, as PortAudio states it.
    flags: int  #: of `harness.bench.microphone_take`.
    counts: bytes  #: the bytes of its samples, all channels.


@dataclass(frozen=True)
class Format:
    """How a microphone's bytes are read."""

    rate: int  #: samples a second, nominal.
    bits: int  #: 24 or 32, of one sample.
    channels: int  #: interleaved in a block.
    channel: int  #: which of them is the microphone, from 0.
    block: int  #: samples in a block.
    latency: float = 0.0  #: s by which the card's times are late, as measured; taken off.

    @property
    def full_scale(self) -> int:
        """The largest count; the smallest is one further from zero."""
        return (1 << (self.bits - 1)) - 1

    def counts(self, raw: bytes) -> AnyArray:
        """``(samples,)`` int32 of the microphone's channel; 24-bit samples keep their sign."""
        if self.bits == 32:
            samples = np.frombuffer(raw, np.dtype("=i4"))
        else:
            wide = np.zeros((len(raw) // 3, 4), np.uint8)
            wide[:, 1:] = np.frombuffer(raw, np.uint8).reshape(-1, 3)
            samples = wide.view(np.dtype("<i4"))[:, 0] >> 8
        return samples.reshape(-1, self.channels)[:, self.channel].astype(np.int32)


class Blocks:
    """The newest blocks of a stream; filled by the sound library's thread, read by any.

    Args:
        capacity: how many blocks are kept.
        size: samples in a block.
    """

    def __init__(self, capacity: int, size: int) -> None:
        self._kept: deque[Block] = deque(maxlen=capacity)
        self._size = size
        # Re-entrant, so that what is waited for may look at the blocks.
        self._arrived = threading.Condition(threading.RLock())
        self._total = 0
        self.bad = 0  #: blocks since opening that must not be used.

    def add(self, block: Block) -> None:
        """Keep a block and wake whoever waits for one."""
        with self._arrived:
            self.bad += bool(block.flags & BAD)
            self._total += 1
            self._kept.append(block)
            self._arrived.notify_all()

    @property
    def total(self) -> int:
        """Blocks that have come since opening, kept or not."""
        return self._total

    def newest(self) -> Block | None:
        """The last block, if there is one."""
        with self._arrived:
            return self._kept[-1] if self._kept else None

    def since(self, first: int) -> list[Block]:
        """The kept blocks that hold sample number ``first`` or later ones, oldest first."""
        with self._arrived:
            return [block for block in self._kept if block.first + self._size > first]

    def wait(self, enough: Callable[[], bool], timeout: float) -> bool:
        """Wait until ``enough()``, or ``timeout`` s; looked at after every block."""
        with self._arrived:
            return self._arrived.wait_for(enough, timeout)


class Trigger:
    """The first sample further than a threshold from the baseline, looked for block by block.

    Args:
        blocks: of the stream.
        form: of their bytes.
        start: sample number from which to look.
        baseline: counts.
        threshold: counts.
    """

    def __init__(self, blocks: Blocks, form: Format, start: int, baseline: float, threshold: int) -> None:
        self.index = start  #: number of the sample found; ``start`` until then.
        self._blocks = blocks
        self._form = form
        self._next = start
        self._baseline = baseline
        self._threshold = threshold

    def look(self) -> bool:
        """Whether a sample has been found; ``index`` is its number."""
        for block in self._blocks.since(self._next):
            loud = np.flatnonzero(self._is_loud(self._form.counts(block.counts)))
            self._next = block.first + self._form.block
            if len(loud):
                self.index = block.first + int(loud[0])
                return True
        return False

    def _is_loud(self, counts: AnyArray) -> AnyArray:
        return np.asarray(np.abs(counts - self._baseline) > self._threshold)
