"""What strikes say of the size of a known object."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.sound.model import RingingModel
from experiments.scale_estimation.sound.peaks import Peaks, log_likelihood
from harness.basics.errors import FitRefused
from harness.basics.materials import Material
from harness.sim.modal.modes import dampings

FEWEST = 3
"""Peaks below which a match by chance is too likely."""

WORTH = 2.2
"""Nats a peak over chance, below which the object's modes do not explain what was heard."""

TEMPER = 0.5
"""Power of the likelihood: modes of one family are off together, so that peaks say less than their number."""


DAMPING_SIGMA = 0.8
"""Of the logarithm of a material's damping, as published values differ."""

PEAK_DAMPING_SIGMA = 0.5
"""Likewise, of one peak's."""

SHAPE_SIGMA = 0.028
"""Relative deviation of all frequencies together that is of wall and unevenness, not of the material."""

NINE_TENTHS = 1.645
"""Standard deviations within which nine tenths of a normal distribution lie, each way."""


@dataclass(frozen=True, eq=False)
class MaterialGuess:
    """What the object may be made of.

    Attributes:
        model: of the object, were it that.
        sigma: of the logarithm of sqrt(E / density).
    """

    model: RingingModel
    sigma: float


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


def by_sound(peaks: Peaks, materials: Sequence[MaterialGuess], nominal: float, sizes: SizeRange) -> Hearing:
    """The sizes at which the object's modes are heard where the peaks are.

    Args:
        peaks: heard.
        materials: that the object may be of, each as likely before anything is heard; what is stated first.
        nominal: m, the longest side of the model.
        sizes: asked about.

    Raises:
        FitRefused: too few peaks, or modes at no size and of no material explain them.
    """
    began = time.perf_counter()
    if len(peaks.frequencies) < FEWEST:
        raise FitRefused(
            f"{len(peaks.frequencies)} peaks were heard, and {FEWEST} are needed to tell a size; strike more "
            "places"
        )
    logs = sizes.logs - np.log(nominal)
    likelihoods = [log_likelihood(peaks, guess.model, logs) for guess in materials]
    matched = max(float(likelihood.max()) for likelihood in likelihoods) / len(peaks.frequencies)
    if matched < WORTH:
        raise FitRefused(
            f"what was heard fits this object's modes at no size: {matched:.1f} nats a peak over chance, and "
            f"{WORTH:g} are needed; check object and material, or strike more places"
        )
    density = np.full(len(logs), -np.inf)
    for guess, likelihood in zip(materials, likelihoods, strict=True):
        weight = float(np.logaddexp.reduce(TEMPER * likelihood)) + log_ringing(peaks, guess.model.material)
        sigma = float(np.hypot(guess.sigma, SHAPE_SIGMA))
        density = np.logaddexp(
            density, weight + Belief.of(sizes, TEMPER * likelihood).widened(sigma).log_density
        )
    match = Belief.of(sizes, TEMPER * likelihoods[0])
    return Hearing(Belief.of(sizes, density), match, matched, time.perf_counter() - began)


def log_ringing(peaks: Peaks, material: Material) -> float:
    """Of how long the peaks ring, were the object of that material: their mean over the material's own.

    At a heard frequency the damping is that of the material, whatever the size.
    """
    expected = dampings(peaks.frequencies, material)
    apart = np.log(np.maximum(peaks.decays, 0.1 * expected) / expected)
    sigma = np.hypot(DAMPING_SIGMA, PEAK_DAMPING_SIGMA / np.sqrt(len(apart)))
    return float(-0.5 * (np.median(apart) / sigma) ** 2)
