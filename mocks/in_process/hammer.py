"""The hammer without a cable, in simulated time: the counts that the box would have sent."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition_channels import BLOCK, CaptureForm, readings_of_capture
from harness.bench.device import Health, Reading
from harness.bench.instruments.sound import HammerSection
from mocks.daq.strike_counts import SKEW, StrikeCounts
from mocks.in_process.arm import InProcessArm, Stage

_REST = 2500


@dataclass(frozen=True, eq=False)
class Fired:
    """The newest firing."""

    time: float  #: s on the simulated bench clock.
    base_from_flange: FloatArray  #: ``(4, 4)``, where the flange was.
    step: int  #: of the run.
    sample: int  #: of the step.


class InProcessHammer:
    """An ``ImpactHammer`` that is fired by an output of the arm.

    Args:
        strikes: what the box reads.
        arm: whose output fires the striker.
        output: which of the tool's.
        stage: simulated time, step and sample.
        section: of the station: rate, threshold, calibration.
    """

    def __init__(
        self, strikes: StrikeCounts, arm: InProcessArm, output: int, stage: Stage, section: HammerSection
    ) -> None:
        self._strikes = strikes
        self._arm = arm
        self._output = output
        self._stage = stage
        self._rate = section.rate
        calibration = section.acquisition
        self._threshold = round(section.threshold / calibration.newtons_per_count)
        self._full_scale = calibration.full_scale_counts
        self._identity = f"{section.model} {section.serial} in process"
        self._idle = strikes.idle()
        self.fired: Fired | None = None
        """what was struck last, for a microphone of its own; None where the last capture had no blow."""

    def open(self) -> None:
        """Nothing to connect."""

    def close(self) -> None:
        """Nothing to release."""

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        """Call ``fire()`` and return what the box reads around the strike; see ``ImpactHammer``."""
        switched = len(self._arm.rises)
        fire()
        fired = [rise for rise in self._arm.rises[switched:] if rise.output == self._output]
        count = -(-round((before + after) * self._rate) // BLOCK) * BLOCK
        quiet = self._idle[np.arange(count) % len(self._idle)]
        record, self.fired = quiet, None
        if fired:
            pose, step, sample = fired[-1].base_from_flange, self._stage.step, self._stage.sample
            record = np.concatenate([quiet, self._strikes.record(pose, step, sample), quiet])
            self.fired = Fired(self._stage.time, pose, step, sample)
        level = np.median(self._idle[:_REST, 0]) + self._threshold
        reached = np.flatnonzero(record[:, 0] >= level)
        began = self._stage.time - count / self._rate
        if not len(reached):
            self._stage.pause(timeout)
            return self._readings(quiet, self._stage.time - count / self._rate)
        first = int(reached[0]) - round(before * self._rate)
        start = began + first / self._rate
        self._stage.time = start + count / self._rate
        return self._readings(record[first : first + count], start)

    def health(self) -> Health:
        """Every sample, on time."""
        return Health("hammer", self._identity, self._rate, 0, None, "simulated time")

    def _readings(self, counts: AnyArray, start: float) -> tuple[Reading, ...]:
        edges = np.array([0.0, float(len(counts))])
        form = CaptureForm(self._rate, self._threshold, self._full_scale)
        starts = start, start + SKEW / self._rate
        arrivals = np.stack([edges, start + edges / self._rate], axis=1)
        return readings_of_capture(counts, starts, self._rate, form, arrivals, np.zeros(2))
