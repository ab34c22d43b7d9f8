"""From pressures to the counts of a sound card's converter."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition import AcquisitionCalibration

NOISE = -110.0
"""dB of full scale, rms: a converter of 24 bits as sound cards have them."""


@dataclass(frozen=True)
class CardConverter:
    """A converter as it is, which a calibration only approximates.

    Attributes:
        counts_per_pascal: of microphone, preamplifier and converter.
        offset: counts at rest.
        full_scale: greatest count; beyond it the converter stays there.
    """

    counts_per_pascal: float
    offset: float
    full_scale: int

    @classmethod
    def of(cls, calibration: AcquisitionCalibration) -> "CardConverter":
        """The converter that a calibration of a microphone on a sound card speaks of."""
        return cls(
            1.0 / calibration.pascals_per_count,
            calibration.microphone_offset,
            calibration.microphone_full_scale_counts,
        )

    def counts(self, pressure: FloatArray, noise: np.random.Generator) -> AnyArray:
        """``(t,)`` int32 of ``(t,)`` Pa."""
        own = self.full_scale * 10.0 ** (NOISE / 20.0) * noise.standard_normal(len(pressure))
        wanted = np.rint(pressure * self.counts_per_pascal + self.offset + own)
        clipped: AnyArray = np.clip(wanted, -self.full_scale - 1, self.full_scale).astype(np.int32)
        return clipped
