"""Whether a stream without framing is still whole: nothing missing, every word in its channel.

Two witnesses. The clock: samples that are missing make all later ones late for good, while a
host or a cable that was merely slow catches up. And the rest: each channel rests at an offset of
its own, so a lost byte or word puts the wrong numbers into a channel.
"""

from dataclasses import dataclass

import numpy as np

from drivers.dataq.link import BoxModel, counts, likely_loss
from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.clock_fit import ArrivalClock, ClockFit

PROMPT = 2e-3
"""s of lateness up to which an arrival counts as proof that nothing is missing before it: a computer that
grows busier makes even its quickest arrivals a millisecond later. Whole scans of less than this in all
(100 at 50 kHz) can be lost unnoticed; a part of a scan cannot, nor can what a box loses whose memory of
20 ms was full while nobody fetched, but for a rare chance."""

_EQUALLY = 0.5e-3
_QUICK = 0.25

_PROMPT_EVEN = 6.0

STEADY = 0.25
"""s over which the quickest arrival is taken while none is prompt."""

STEADY_COUNT = 4
"""Such times in a row whose quickest arrivals must be equally late for samples to count as lost. A sender
or a host that is merely slow is late by ever other amounts, and catches up."""

SETTLED = 1.0
"""s of arrivals after which their own rate is believed rather than the nominal one, if they come evenly."""

REST_WINDOW = 0.05
"""s over which a rest is measured."""

_REFIT = 0.25
_CRYSTAL = 200e-6
_WANDER = 20e-6
_NO_CRYSTAL = 1e-3


@dataclass(frozen=True, eq=False)
class Rests:
    """What the channels rest at, as calibrated."""

    offsets: FloatArray  #: ``(channels,)`` counts; the force's first.
    tolerance: float  #: counts.

    @property
    def distinct(self) -> bool:
        """Whether swapped channels would be seen."""
        return bool(np.ptp(self.offsets) > 2.0 * self.tolerance)


class StreamMonitor:
    """Watches one uninterrupted stream.

    Args:
        nominal_rate: Hz, scans a second.
        model: of the box.
        rests: what its channels rest at.
    """

    def __init__(self, nominal_rate: float, model: BoxModel, rests: Rests) -> None:
        self.clock = ArrivalClock(nominal_rate)  #: of the scans, from prompt arrivals.
        self.prompt = 0  #: scans that a prompt arrival has shown to be complete.
        self.ordered = 0  #: scans up to which the channels have been seen in their order.
        self.fault = ""  #: what went wrong, in words; empty while all is well.
        self._model = model
        self._rests = rests
        self._rate = nominal_rate
        self._fit: ClockFit | None = None
        self._even = 0.0
        self._fitted_at = 0.0
        self._earliest = np.inf
        self._late: list[float] = []
        self._late_until = 0.0
        self._window: list[AnyArray] = []
        self._windowed = 0
        self._astray = 0

    def take(self, scans: AnyArray, total: int, time: float, emptied: bool) -> None:
        """Look at what arrived.

        Args:
            scans: ``(n, channels)`` int16 words, new ones.
            total: scans of this stream, with these.
            time: s on the bench clock, of their arrival.
            emptied: whether the port held nothing more.
        """
        if emptied:
            late = self.lateness(total, time)
            allowed = self._allowed(time)
            if late <= allowed:
                self.prompt, self._late = total, []
                self.clock.arrived(total - 1, time)
                self._refit(time)
            elif not self._late or time > self._late_until:
                self._judge_lateness()
                self._late.append(late)
                self._late_until = time + STEADY
            else:
                self._late[-1] = min(self._late[-1], late)
        self._window.append(scans)
        self._windowed += len(scans)
        if self._windowed >= REST_WINDOW * self._rate:
            self._see_rest(np.concatenate(self._window), total)
            self._window, self._windowed = [], 0

    @property
    def settled(self) -> bool:
        """Whether the arrivals tell the clock: long enough, for how evenly they come."""
        return self._fit is not None

    @property
    def fit(self) -> ClockFit | None:
        """The newest clock that is to be believed; None before one is."""
        return self._fit

    def lateness(self, total: int, time: float) -> float:
        """Seconds by which an arrival is later than the quickest ones."""
        if self._fit is not None:
            return time - self._fit.time(total - 1)
        nominal = time - (total - 1) / self._rate
        self._earliest = min(self._earliest, nominal)
        return nominal - self._earliest

    def _allowed(self, time: float) -> float:
        if self._fit is None:
            return PROMPT + _CRYSTAL * self.clock.span
        unsure = self._even / self._fit.span + _WANDER
        beyond = max(0.0, time - self._fit.arrivals[-1])
        return float(max(PROMPT, _PROMPT_EVEN * self._even) + unsure * beyond)

    def _judge_lateness(self) -> None:
        """Whether the quickest arrivals have been equally late for some time."""
        newest = self._late[-STEADY_COUNT:]
        if len(newest) < STEADY_COUNT:
            return
        if max(newest) - min(newest) <= max(_EQUALLY, self._even):
            self.fault = (
                f"about {min(newest) * self._rate:.0f} samples of each channel are missing: this computer "
                "did not fetch them in time and the box's memory overflowed; close what else runs on it"
            )

    def _refit(self, time: float) -> None:
        if self.clock.span < SETTLED or time - self._fitted_at < _REFIT:
            return
        fit, self._fitted_at = self.clock.fit(), time
        even = float(np.quantile(fit.lateness, _QUICK))
        # Few and uneven arrivals can make a line that no crystal keeps; more of them will not.
        if even <= _CRYSTAL * fit.span and abs(fit.rate / self._rate - 1.0) <= _NO_CRYSTAL:
            self._fit, self._even = fit, even

    def _see_rest(self, words: AnyArray, total: int) -> None:
        rest = float(np.median(counts(words[:, 0], self._model)))
        if abs(rest - self._rests.offsets[0]) <= self._rests.tolerance:
            self.ordered, self._astray = total, 0
            return
        missing = likely_loss(words, self._rests.offsets, self._rests.tolerance, self._model)
        self._astray = self._astray + 1 if missing else 0
        if missing and self._astray > 1:
            lost = "a byte" if missing % 2 else "a word"
            self.fault = (
                f"{lost} of the stream was lost on the way and the channels changed places; check the USB "
                "cable and any hub in between"
            )
