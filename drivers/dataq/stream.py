"""The stream of a scanning DATAQ box: a thread that fetches, keeps, watches and, where it must, restarts."""

import contextlib
import os
import select
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.dataq.fetch_child import CUT, EMPTIED, HEADER
from drivers.dataq.link import MODEL, START, STOP, BoxModel, DataqLink, LinkCut, counts, without_start_echo
from drivers.dataq.monitor import Rests, StreamMonitor
from drivers.ur import pipe
from harness.basics.arrays import AnyArray, BoolArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault
from harness.basics.starvation import LATE, WATCH, name_cause
from harness.basics.worker_pool import end_process
from harness.bench.clock_fit import ClockFit

STALL = 2.0
"""s without a byte after which the box counts as stalled."""

_PROOF_TIMEOUT = 30.0
_UNREST = 0.5
_DEAF_TIMEOUT = 10.0
_LOOK_PERIOD = 5e-3
_FETCH_TIMEOUT = 0.1
_NEWS_TIMEOUT = 0.1
_SETTLE_TIMEOUT = 30.0


@dataclass(frozen=True)
class Arrival:
    """What the port held at one moment."""

    time: float  #: s on the bench clock.
    data: bytes  #: bytes; none where none came for a while.
    emptied: bool  #: whether nothing more was waiting behind them.
    cut: str  #: why no more can come; empty where more may.


@dataclass(frozen=True)
class Position:
    """A scan of one uninterrupted stretch of the stream."""

    stretch: int  #: 0 for the first, one more after every restart.
    scan: int  #: from 0 within the stretch.


class ScanStream:
    """Two channels, sampled until closed.

    Args:
        link: open, to a box that is set up and does not scan.
        model: of the box.
        nominal_rate: Hz, scans a second.
        rests: what the channels rest at.
        memory: s of samples kept.
    """

    def __init__(
        self, link: DataqLink, model: BoxModel, nominal_rate: float, rests: Rests, memory: float
    ) -> None:
        self.losses: list[str] = []  #: what went wrong since the beginning, in words.
        self.drops = 0  #: scans that were lost, or not taken while the box was being restarted.
        self._link = link
        self._model = model
        self._rate = nominal_rate
        self._rests = rests
        self._ring = np.zeros((int(memory * nominal_rate), len(rests.offsets)), np.int16)
        self._changed = threading.Condition()
        self._closing = threading.Event()
        self._dead = ""
        self._ended = ""
        self._asked = False
        self._stretch = 0
        self._total = 0
        self._monitor = StreamMonitor(nominal_rate, model, rests)
        self._partial = b""
        self._heard = now()
        self._fresh = True
        self._fetcher: Fetcher
        self._thread = threading.Thread(target=self._run, name=f"{link.name} stream", daemon=True)

    def start(self) -> None:
        """Begin to scan and to fetch."""
        self._begin()
        self._thread.start()

    def stop(self) -> None:
        """End fetching and scanning; silent where the box is gone."""
        self._closing.set()
        self._thread.join()
        self._fetcher.end()
        with contextlib.suppress(BenchFault):
            self._link.send(STOP)

    @property
    def dead(self) -> str:
        """Why nothing will come any more; empty while something may."""
        return self._dead

    def clock(self) -> ClockFit | None:
        """The clock of the present stretch; None before it has settled."""
        with self._changed:
            return self._monitor.fit

    def settle(self) -> Position:
        """Wait until the clock can be fitted; the newest scan then.

        Raises:
            BenchFault: it does not settle, or the box is gone.
        """

        def settled() -> bool:
            return bool(self._dead) or self._monitor.settled

        WATCH.start()
        began = now()
        with self._changed:
            done = self._changed.wait_for(settled, _SETTLE_TIMEOUT)
            if not done and WATCH.delay_since(began) >= LATE:
                done = self._changed.wait_for(settled, _SETTLE_TIMEOUT)
            if self._dead:
                raise BenchFault(self._dead)
            if not done:
                raise BenchFault(
                    f"{self._link.name}: the box sent no steady stream within {_SETTLE_TIMEOUT:g} s; "
                    + (self.losses[-1] if self.losses else name_cause("check its USB cable", began))
                )
            return Position(self._stretch, self._total)

    def find(
        self, since: Position, wanted: Callable[[AnyArray], BoolArray], deadline: float
    ) -> Position | None:
        """The first scan at or after ``since`` for which ``wanted`` holds; None by ``deadline``.

        Args:
            since: where to begin.
            wanted: from ``(n, channels)`` counts to ``(n,)`` truths.
            deadline: s on the bench clock.

        Raises:
            BenchFault: the stretch ended, or the box is gone.
        """
        seen = since.scan
        while True:
            with self._changed:
                self._changed.wait(_NEWS_TIMEOUT)
                self._raise_if_over(since)
                seen = max(seen, self._total - len(self._ring))
                new = self._kept(seen, self._total)
            found = np.flatnonzero(wanted(new))
            if len(found):
                return Position(since.stretch, seen + int(found[0]))
            seen += len(new)
            if now() > deadline:
                return None

    def take(self, first: Position, count: int) -> tuple[AnyArray, ClockFit]:
        """``(count, channels)`` counts from ``first``, proven whole and in order, and their clock.

        Waits until they are there, until a prompt arrival has shown that none is missing, and until
        the channels were seen in their order after them.

        Raises:
            BenchFault: the stretch ended, the box is gone, they are no longer kept, or there is no proof.
        """
        end = first.scan + count

        def decided() -> bool:
            restless = self._monitor.prompt >= end + _UNREST * self._rate
            return bool(self._dead) or self._stretch != first.stretch or restless or self._proven >= end

        with self._changed:
            timeout = max(0, end - self._total) / self._rate + _PROOF_TIMEOUT
            self._changed.wait_for(decided, timeout)
            self._raise_if_over(first)
            fit = self._monitor.fit
            if self._proven < end or fit is None:
                raise BenchFault(self._unproven(end))
            if first.scan < max(0, self._total - len(self._ring)):
                raise BenchFault(
                    f"{self._link.name}: the oldest of the {count} samples asked for is no longer kept; "
                    f"the newest {len(self._ring)} are"
                )
            return self._kept(first.scan, end).copy(), fit

    def rest(self, seconds: float) -> AnyArray:
        """``(n, channels)`` counts of the newest ``seconds``."""
        with self._changed:
            return self._kept(max(0, self._total - int(seconds * self._rate)), self._total).copy()

    def restart(self) -> None:
        """Begin anew, for a channel order that is certain.

        Raises:
            BenchFault: the box is gone, or does not begin.
        """
        with self._changed:
            before, self._asked = self._stretch, True
            done = self._changed.wait_for(lambda: self._dead or self._stretch != before, _SETTLE_TIMEOUT)
            if self._dead or not done:
                raise BenchFault(
                    self._dead or f"{self._link.name}: the box did not begin anew; check its cable"
                )

    @property
    def _proven(self) -> int:
        return min(self._monitor.prompt, self._monitor.ordered)

    def _unproven(self, end: int) -> str:
        if self._monitor.ordered < end <= self._monitor.prompt:
            rest = np.median(self.rest(0.05), axis=0)
            return (
                f"{self._link.name}: after the strike the force rests at {rest[0]:.0f} counts, calibrated "
                f"{self._rests.offsets[0]:.0f} within {self._rests.tolerance:.0f}: the channel order is not "
                "certain; check what leans on the hammer, its conditioner and its cable"
            )
        return f"{self._link.name}: samples arrive late for {_PROOF_TIMEOUT:g} s; close what else runs here"

    def _raise_if_over(self, position: Position) -> None:
        if self._dead:
            raise BenchFault(self._dead)
        if self._stretch != position.stretch:
            raise BenchFault(f"{self._link.name}: {self._ended}. It was started again: repeat the strike")

    def _kept(self, first: int, end: int) -> AnyArray:
        numbers = np.arange(first, end) % len(self._ring)
        kept: AnyArray = counts(self._ring[numbers], self._model)
        return kept

    def _begin(self) -> None:
        self._partial, self._fresh = b"", True
        self._monitor = StreamMonitor(self._rate, self._model, self._rests)
        self._total = 0
        self._fetcher = Fetcher(self._link.fileno())
        self._link.send(START)
        self._heard = now()

    def _run(self) -> None:
        while not self._closing.wait(_LOOK_PERIOD):
            try:
                for arrival in self._fetcher.read(_FETCH_TIMEOUT):
                    self._see(arrival)
                if self._monitor.fault or self._asked:
                    self._recover(self._monitor.fault or "begun anew", bool(self._monitor.fault))
            except BenchFault as fault:
                reason = str(fault)
                with self._changed:
                    self._dead = reason
                    self._changed.notify_all()
                return

    def _see(self, arrival: Arrival) -> None:
        if arrival.cut:
            raise self._link.cut(arrival.cut)
        if arrival.data:
            self._take(arrival)
        elif arrival.time - self._heard > STALL:
            self._monitor.fault = f"the box sent nothing for {STALL:g} s"

    def _take(self, arrival: Arrival) -> None:
        self._heard = arrival.time
        data = self._partial + arrival.data
        if self._fresh:
            self._fresh, data = without_start_echo(data)
        channels = self._ring.shape[1]
        whole = len(data) // (2 * channels) * (2 * channels)
        scans = np.frombuffer(data[:whole], "<i2").reshape(-1, channels)
        self._partial = data[whole:]
        with self._changed:
            self._ring[np.arange(self._total, self._total + len(scans)) % len(self._ring)] = scans
            self._total += len(scans)
            self._monitor.take(scans, self._total, arrival.time, arrival.emptied)
            self._changed.notify_all()

    def _recover(self, reason: str, lost: bool) -> None:
        """Stop, drain, start: the only way back to a known order."""
        with self._changed:
            fit = self._monitor.fit
            last = self._heard if fit is None else fit.time(self._monitor.prompt)
            if lost:
                self.losses.append(reason)
        self._fetcher.end()
        self._silence()
        with self._changed:
            self._begin()
            self._stretch += 1
            self._ended, self._asked = reason, False
            self.drops += max(1, round((now() - last) * self._rate)) if lost else 0
            self._changed.notify_all()

    def _silence(self) -> None:
        """Have the box stop, and answer: one that is deaf would later obey all it was told at once.

        Raises:
            BenchFault: it stays deaf, or the link is cut.
        """
        deadline = now() + _DEAF_TIMEOUT
        while True:
            self._link.send(STOP)
            self._link.drain()
            try:
                self._link.ask(f"info {MODEL}")
            except LinkCut:
                raise
            except BenchFault:
                if now() > deadline or self._closing.is_set():
                    raise
            else:
                self._link.drain()
                return


_READY: Final = 20.0
_END: Final = 2.0
_LARGEST: Final = 1 << 20


class Fetcher:
    """A process that empties a port, from now until ``end``.

    Args:
        port: file descriptor; nobody else may read it meanwhile.

    Raises:
        BenchFault: the process does not begin.
    """

    def __init__(self, port: int) -> None:
        command = [sys.executable, "-P", "-m", "drivers.dataq.fetch_child", str(port)]
        self._process = pipe.start_process(command, (port,))
        assert self._process.stdout is not None
        self._out = self._process.stdout.fileno()
        pipe.prepare_to_write(self._out)  # roomy, and never waited for
        self._waiting = bytearray()
        if not self.read(_READY):
            self.end()
            raise BenchFault("the process that fetches the box's samples did not begin; see its words above")

    @property
    def pid(self) -> int:
        """Of the process."""
        return self._process.pid

    def read(self, timeout: float) -> list[Arrival]:
        """What has arrived since the last time; waits at most ``timeout`` s for something."""
        if not select.select([self._out], [], [], timeout)[0]:
            return []
        data = os.read(self._out, _LARGEST)
        if not data:
            return [Arrival(0.0, b"", False, "the process that fetches its samples ended")]
        self._waiting += data
        return list(self._frames())

    def end(self) -> None:
        """End the process; the port is this program's again."""
        assert self._process.stdout is not None
        end_process(self._process, _END)
        self._process.stdout.close()

    def _frames(self) -> Iterator[Arrival]:
        start = 0
        while len(self._waiting) - start >= HEADER.size:
            time, kind, length = HEADER.unpack_from(self._waiting, start)
            end = start + HEADER.size + length
            if len(self._waiting) < end:
                break
            data = bytes(self._waiting[start + HEADER.size : end])
            cut = data.decode("utf-8", "replace") if kind == CUT else ""
            yield Arrival(time, b"" if cut else data, kind == EMPTIED, cut)
            start = end
        del self._waiting[:start]
