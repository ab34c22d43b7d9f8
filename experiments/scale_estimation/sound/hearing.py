"""What strikes say of the size of a known object."""

import time
from dataclasses import dataclass

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.sound.model import RingingModel
from experiments.scale_estimation.sound.peaks import Peaks, log_likelihood
from harness.basics.errors import FitRefused

FEWEST = 3
"""Peaks below which a match by chance is too likely."""

WORTH = 2.8
"""Nats a peak over chance, below which the object's modes do not explain what was heard."""

TEMPER = 0.5
"""Power of the likelihood: modes of one family are off together, so that peaks say less than their number."""


SHAPE_SIGMA = 0.028
"""Relative deviation of all frequencies together that is of wall and unevenness, not of the material."""

NINE_TENTHS = 1.645
"""Standard deviations within which nine tenths of a normal distribution lie, each way."""


@dataclass(frozen=True, eq=False)
class Hearing:
    """The answer by sound.

    Attributes:
        belief: over the size.
        match: the same were the material and the wall exactly as stated.
        matched: nats a peak over chance at the best size.
        seconds: s of the estimate.
    """

    belief: Belief
    match: Belief
    matched: float
    seconds: float

    def speed(self, stated: float, size: Belief) -> dict[str, float]:
        """The material's sqrt(E / density), where another sense knows the size; m/s, with a 90 % interval.

        Args:
            stated: m/s, of the material as stated.
            size: by the other senses.
        """
        value = stated * size.size / self.match.size
        sigma = float(np.sqrt(self.match.spread**2 + size.spread**2 + SHAPE_SIGMA**2))
        return {
            "value_m_per_s": value,
            "low90_m_per_s": value * float(np.exp(-NINE_TENTHS * sigma)),
            "high90_m_per_s": value * float(np.exp(NINE_TENTHS * sigma)),
            "stated_m_per_s": stated,
        }


def by_sound(
    peaks: Peaks, model: RingingModel, nominal: float, sizes: SizeRange, common_sigma: float
) -> Hearing:
    """The sizes at which the object's modes are heard where the peaks are.

    Args:
        peaks: heard.
        model: of the object at its nominal size.
        nominal: m, the longest side of the model.
        sizes: asked about.
        common_sigma: deviation of the logarithm of all frequencies together: of the material and the wall.

    Raises:
        FitRefused: too few peaks, or modes at no size explain them.
    """
    began = time.perf_counter()
    if len(peaks.frequencies) < FEWEST:
        raise FitRefused(
            f"{len(peaks.frequencies)} peaks were heard, and {FEWEST} are needed to tell a size; strike more "
            "places"
        )
    logs = sizes.logs - np.log(nominal)
    likelihood = log_likelihood(peaks, model, logs)
    best = int(likelihood.argmax())
    matched = float(likelihood[best]) / len(peaks.frequencies)
    if matched < WORTH:
        raise FitRefused(
            f"what was heard fits this object's modes at no size: {matched:.1f} nats a peak over chance, and "
            f"{WORTH:g} are needed; check object and material, or strike more places"
        )
    match = Belief.of(sizes, TEMPER * likelihood)
    return Hearing(match.widened(common_sigma), match, matched, time.perf_counter() - began)
