"""A mocked acquisition box in a process of its own, with every count of it known beforehand."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from drivers.dataq.hammer import DataqHammer
from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition import AcquisitionCalibration, shipped_acquisition
from mocks.daq.box import DaqBox, Source
from mocks.faults import Fault
from mocks.lab_processes import LabChild

CALIBRATION: AcquisitionCalibration = shipped_acquisition("acquisition_bench")
OFFSETS = (120, -180)


@dataclass
class Bench:
    """A box, its process, and what fires its next record."""

    box: DaqBox
    child: LabChild
    striker: int

    def fire(self) -> None:
        os.write(self.striker, b"1")

    def cue(self, kind: str, seconds: float | None = None) -> None:
        self.child.cue(Fault("hammer", kind, seconds))


def idle_counts(seed: int = 0, scans: int = 49_999, noise: tuple[float, float] = (2.0, 30.0)) -> AnyArray:
    """``(scans, 2)`` int16 at rest; a period that no block divides."""
    drawn = np.random.default_rng(seed).normal(size=(scans, 2)) * noise + OFFSETS
    counts: AnyArray = np.rint(drawn).astype(np.int16)
    return counts


@contextmanager
def mocked_box(source: Callable[[Callable[[], bool]], Source], **options: object) -> Iterator[Bench]:
    """A box on ``source``, which is given the question whether the striker was fired since it last asked."""
    reading, writing = os.pipe()
    os.set_blocking(reading, False)

    def fired() -> bool:
        try:
            return bool(os.read(reading, 1))
        except BlockingIOError:
            return False

    box = DaqBox(source(fired), **options)  # type: ignore[arg-type]
    child = LabChild("hammer", box.serve)
    box.leave()
    try:
        child.wait_ready(10.0)
        yield Bench(box, child, writing)
    finally:
        child.kill()
        os.close(reading)
        os.close(writing)


def played(records: list[AnyArray], idle: AnyArray | None = None) -> Callable[[Callable[[], bool]], Source]:
    """Plays the next of ``records`` whenever the striker is fired."""

    def source(fired: Callable[[], bool]) -> Source:
        left, quiet = list(records), idle_counts() if idle is None else idle
        begin, record = 0, quiet[:0]

        def counts(first: int, count: int) -> AnyArray:
            nonlocal begin, record
            if fired() and left:
                begin, record = first, left.pop(0)
            numbers = np.arange(first, first + count)
            read: AnyArray = quiet[numbers % len(quiet)].copy()
            here = (numbers >= begin) & (numbers < begin + len(record))
            read[here] = record[numbers[here] - begin]
            return read

        return counts

    return source


def numbered(scans: AnyArray) -> AnyArray:
    """``(n, 2)`` counts that tell the scan's number: the force about its rest, the sound a hash of it."""
    force = OFFSETS[0] + scans % 61 - 30
    sound = ((scans * 2_654_435_761) >> 16) % 60_000 - 30_000
    counts: AnyArray = np.stack([force, sound], axis=1).astype(np.int16)
    return counts


def numbered_source(_: Callable[[], bool]) -> Source:
    """Every scan is known from its number alone."""
    return lambda first, count: numbered(np.arange(first, first + count))


def numbered_begin(counts: AnyArray, before: float) -> int:
    """The number of the first scan of ``counts``, which is less than ``before``."""
    alike = np.flatnonzero((numbered(np.arange(int(before))) == counts[0]).all(axis=1))
    return next(int(k) for k in alike if np.array_equal(numbered(np.arange(k, k + 50)), counts[:50]))


@contextmanager
def opened(bench: Bench, **options: object) -> Iterator[DataqHammer]:
    """The driver, open on the bench's box."""
    hammer = DataqHammer(**{"calibration": CALIBRATION, "port": bench.box.port, **options})  # type: ignore[arg-type]
    hammer.open()
    try:
        yield hammer
    finally:
        hammer.close()


def measured_delay(force: FloatArray, pressure: FloatArray, rate: float) -> float:
    """s by which the pressure is later, from the phase of the cross spectrum."""
    cross = np.fft.rfft(pressure) * np.conj(np.fft.rfft(force))
    omega = 2 * np.pi * np.fft.rfftfreq(len(force), 1 / rate)
    weight = np.abs(cross) * (np.abs(cross) > 1e-2 * np.abs(cross).max())
    return -float(np.sum(weight * omega * np.angle(cross)) / np.sum(weight * omega**2))
