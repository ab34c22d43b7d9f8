"""The impact hammer: its force cell and a measurement microphone on one acquisition box.

The hammer is wired to input 0 and the microphone to input 1 of a DATAQ DI-2108 or DI-1110. The box
scans from ``open()`` to ``close()``, so that its clock is known by the time of the first strike; a process
of its own fetches the samples, so that no compiling or planning in this one loses any;
the trigger is in software, on the force. What is recorded are raw counts with true times: the two
channels are converted one after the other, and each has its own times. Newtons and pascals are
``harness.bench.acquisition``'s.
"""

from collections.abc import Callable

import numpy as np

from drivers.dataq.link import (
    DIVIDEND,
    MODEL,
    MODELS,
    SERIAL,
    DataqLink,
    divisor,
    find_port,
    packet_exponent,
)
from drivers.dataq.monitor import REST_WINDOW, Rests
from drivers.dataq.stream import Position, ScanStream
from harness.basics.arrays import AnyArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, WrongUse
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.acquisition_channels import BLOCK, CaptureForm, readings_of_capture
from harness.bench.clock_fit import ClockFit
from harness.bench.device import Health, Reading

_CHANNELS = 2
_CLOCK_PAIRS = 64


class DataqHammer:
    """A hammer and a microphone on a DATAQ box; an ``ImpactHammer``.

    Args:
        calibration: of the box with this hammer and microphone: tells their rest, by which a lost
            channel order is noticed.
        port: path of the device file; empty to look for the serial number among all DATAQ boxes.
        serial: number that the box must state; empty for any, with a ``port``.
        model: ``"DI-2108"`` or ``"DI-1110"``.
        rate: Hz, of each channel, nominal.
        threshold_counts: above rest, at which a strike begins.
        memory: s of samples kept; ``before + after`` of a capture must fit.
        name: of the instrument, as messages call it.

    Raises:
        WrongUse: no such model, neither port nor serial number, or a calibration of another converter.
    """

    def __init__(
        self,
        calibration: AcquisitionCalibration,
        port: str = "",
        serial: str = "",
        model: str = "DI-2108",
        rate: float = 50e3,
        threshold_counts: int = 100,
        memory: float = 10.0,
        name: str = "hammer",
    ) -> None:
        if not port and not serial:
            raise WrongUse(f"{name}: name the box's port or its serial number in the station")
        if model not in MODELS:
            raise WrongUse(f"no acquisition box {model!r} is known; there is {', '.join(MODELS)}")
        self._model = MODELS[model]
        if calibration.full_scale_counts != self._model.full_scale:
            raise WrongUse(
                f"{name}: the calibration is of a converter with full scale {calibration.full_scale_counts}; "
                f"a {model} has {self._model.full_scale}"
            )
        self._name = name
        self._model_name = model
        self._port = port
        self._serial = serial
        self._rate = rate
        self._threshold = threshold_counts
        self._memory = memory
        offsets = np.array([calibration.hammer_offset, calibration.microphone_offset])
        self._rests = Rests(offsets, calibration.offset_tolerance)
        self._link: DataqLink | None = None
        self._stream: ScanStream | None = None
        self._stated_serial = ""

    def open(self) -> None:
        """Find the box, set it up and let it scan; does nothing if already open.

        Raises:
            BenchFault: it is not there, does not answer, or is another one.
            WrongUse: it cannot sample at the station's rate.
        """
        if self._stream is not None:
            return
        link = DataqLink(self._name, self._port or find_port(self._name, self._serial))
        link.open()
        try:
            self._set_up(link)
            stream = ScanStream(link, self._model, self._rate, self._rests, self._memory)
            stream.start()
        except BaseException:
            link.close()
            raise
        self._link, self._stream = link, stream

    def close(self) -> None:
        """Stop scanning and release the port; does nothing if already closed."""
        if self._stream is not None and self._link is not None:
            try:
                self._stream.stop()
            finally:
                self._link.close()
                self._stream = self._link = None

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Call ``fire()`` and return what was read around the strike; see ``ImpactHammer.capture``.

        Raises:
            BenchFault: bytes were lost, the box's memory overflowed, it stalled or was unplugged; or the
                hammer was not at rest before ``fire()``.
            ValueError: ``before + after`` is not positive or more than is kept.
        """
        if self._stream is None:
            raise BenchFault(f"{self._name} was used before it was opened; open the bench first")
        stream = self._stream
        if not (before >= 0.0 and after > 0.0 and before + after + 2 * BLOCK / self._rate < self._memory):
            raise ValueError(
                f"{before:g} s before and {after:g} s after a strike were asked for; "
                f"{self._memory:g} s are kept"
            )
        # Where the stream is and what the force rests at, once that is as calibrated.
        if not self._rests.distinct:
            stream.restart()
        since = stream.settle()
        rest = float(np.median(stream.rest(REST_WINDOW)[:, 0]))
        if abs(rest - self._rests.offsets[0]) > self._rests.tolerance:
            raise BenchFault(
                f"{self._name}: before the strike the force is at {rest:.0f} counts, calibrated "
                f"{self._rests.offsets[0]:.0f} within {self._rests.tolerance:.0f}; check what leans on the "
                "hammer, its conditioner and its cable"
            )
        fire()
        onset = stream.find(since, lambda scans: scans[:, 0] - rest >= self._threshold, now() + timeout)
        lead = round(before * self._rate)
        count = -(-round((before + after) * self._rate) // BLOCK) * BLOCK
        if onset is None:
            first = Position(since.stretch, max(0, stream.settle().scan - count))
        else:
            first = Position(onset.stretch, max(0, onset.scan - lead))
        words, clock = stream.take(first, count)
        return self._readings(words, first, clock)

    def health(self) -> Health:
        """Rate on the bench clock and samples lost since opening; how old they arrive cannot be known."""
        identity = f"DATAQ {self._model_name} {self._stated_serial or self._serial} at {self._port}"
        stream = self._stream
        if stream is None:
            return Health(self._name, identity, 0.0, 0, None, "closed")
        clock = stream.clock()
        details = [stream.dead] if stream.dead else []
        if clock is not None:
            drift = (clock.rate / self._rate - 1.0) * 1e6
            details.append(
                f"crystal {drift:+.0f} ppm of nominal, arrivals {clock.residual * 1e6:.0f} us from the fit"
            )
        if not self._rests.distinct:
            details.append(
                "the channels rest too much alike for a swap to be seen; restarted before every strike"
            )
        details += [f"restarted: {loss}" for loss in stream.losses[-3:]]
        return Health(
            self._name, identity, clock.rate if clock else 0.0, stream.drops, None, "; ".join(details)
        )

    def _set_up(self, link: DataqLink) -> None:
        number = link.ask(f"info {MODEL}")
        if number != self._model.number:
            raise BenchFault(
                f"{self._name}: the box at {link.port} is a {number!r}; the station says {self._model_name}"
            )
        said = link.ask(f"info {SERIAL}")
        if self._serial and said != self._serial:
            raise BenchFault(
                f"{self._name}: the box at {link.port} has the serial number {said!r}; the station says "
                f"{self._serial!r}: check which box is plugged in, or the port in the station"
            )
        self._stated_serial, self._port = said, link.port
        dividend = link.ask(f"info {DIVIDEND}")
        if not dividend.isdigit():
            raise BenchFault(
                f"{self._name}: the box at {link.port} states the sample clock {dividend!r}, no number"
            )
        for reset in self._model.resets:
            link.ask(reset)
        for slot in range(_CHANNELS):
            link.ask(f"slist {slot} {slot}")
        link.ask(f"srate {divisor(int(dividend), self._rate, _CHANNELS, self._model)}")
        link.ask(f"ps {packet_exponent(self._rate, _CHANNELS)}")

    def _readings(self, words: AnyArray, first: Position, clock: ClockFit) -> tuple[Reading, ...]:
        starts = clock.time(first.scan), clock.time(first.scan + 1.0 / _CHANNELS)
        kept = np.unique(np.linspace(0, len(clock.samples) - 1, _CLOCK_PAIRS).round().astype(np.int64))
        arrivals = np.stack([clock.samples[kept], clock.arrivals[kept]], axis=1)
        late = clock.lateness[kept]
        form = CaptureForm(self._rate, self._threshold, self._model.full_scale)
        return readings_of_capture(words, starts, clock.rate, form, arrivals - (first.scan, 0.0), late)
