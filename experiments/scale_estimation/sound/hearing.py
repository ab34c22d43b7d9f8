"""What strikes say of the size of a known object."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.sound.peaks import Peaks, RingingModel, log_likelihood, modes_a_peak
from harness.basics.errors import FitRefused
from harness.sim.modal.modes import dampings

FEWEST = 3
"""Peaks below which a match by chance is too likely."""

WORTH = 1.4
"""Minimum log-likelihood per peak over chance, for the object's modes to explain the recorded sound."""

TEMPER = 0.8
"""Power of the likelihood: modes of one family are off together, so that peaks say less than their number."""

ALIKE = 0.15
"""Of the logarithm of the size: sizes no further apart are one answer, not two."""

SURE = 0.8
"""Probability of the likeliest size and those alike, below which another one stands beside it: with modes
an octave off, a handful of peaks is matched by chance (tests/hard_cases). From there to nine tenths the
interval reaches into both."""

SHARED = 3.2
"""Modes that share a peak, on average, beyond which no peak is a mode's: a list of peaks then fits many
sizes, and how well it fits one says little. Wood and plastic are above it, hard objects below."""

GRID = 2.5e-3
"""Of the logarithm, between sizes at which the likelihood is computed: a third of the narrowest deviation of
a frequency, so that a straight line between is exact to a hundredth of a nat a peak."""

DAMPING_SIGMA = 0.8
"""Of the logarithm of a material's damping, as published values differ."""

PEAK_DAMPING_SIGMA = 0.5
"""Likewise, of one peak's."""

SHAPE_SIGMA = 0.024
"""Relative deviation of all frequencies together by wall and unevenness, not by the material."""

NINE_TENTHS = 1.645
"""Standard deviations within which nine tenths of a normal distribution lie, each way."""


@dataclass(frozen=True, eq=False)
class MaterialGuess:
    """What the object may be made of."""

    model: RingingModel  #: of the object, were it that.
    sigma: float  #: of the logarithm of sqrt(E / density).


@dataclass(frozen=True, eq=False)
class Match:
    """The sizes at which the modes are where the peaks are, were the object of one material."""

    belief: Belief  #: over the size, were the material and the wall exactly as stated.
    log_evidence: float  #: of the material, logarithm.
    sigma: float  #: of the logarithm of the size, which the material and the wall leave open.
    speed: float  #: sqrt(E / density) over that of the material stated first.
    nats: float  #: a peak over chance at the best size.


@dataclass(frozen=True, eq=False)
class Hearing:
    """The answer by sound."""

    belief: Belief  #: over the size.
    matches: tuple[Match, ...]  #: one a material; that stated first is first.
    seconds: float  #: s of the estimate.

    @property
    def match(self) -> Belief:
        """Over the size, were the stated material and the wall exactly as stated."""
        return self.matches[0].belief

    @property
    def matched(self) -> float:
        """Nats a peak over chance at the best size."""
        return max(one.nats for one in self.matches)

    def speed(self, stated: float, size: Belief) -> dict[str, float]:
        """The material's sqrt(E / density), where another sense knows the size; m/s, with a 90 % interval.

        Args:
            stated: m/s, of the material as stated.
            size: by the other senses.
        """
        about = []
        for one in self.matches:
            # Where the match should lie if the other sense is right: of several sizes that fit, one is meant.
            wide = np.hypot(one.sigma, size.spread)
            prior = -0.5 * ((size.range.logs - np.log(size.size)) / wide) ** 2 - np.log(wide)
            density = one.belief.log_density + prior
            overlap = float(np.logaddexp.reduce(density))
            about.append((one.log_evidence + overlap, one, Belief.of(size.range, density)))
        _, best, match = max(about, key=lambda found: found[0])
        value = stated * best.speed * size.size / match.size
        sigma = float(np.sqrt(match.spread**2 + size.spread**2 + SHAPE_SIGMA**2))
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
        FitRefused: too few peaks, modes at no size and of no material explain them, or at several sizes, or
            the modes are too dense to be told apart.
    """
    began = time.perf_counter()
    peaks = peaks.apart()
    if len(peaks.frequencies) < FEWEST:
        raise FitRefused(
            f"{len(peaks.frequencies)} peaks were heard, and {FEWEST} are needed to tell a size; strike more "
            "places"
        )
    matches = _matches(peaks, materials, nominal, sizes)
    nats = max(one.nats for one in matches)
    if nats < WORTH:
        raise FitRefused(
            f"what was heard fits this object's modes at no size: {nats:.1f} nats a peak over chance, and "
            f"{WORTH:g} are needed; check object and material, or strike more places"
        )
    exact = _mixed(matches, [one.belief for one in matches])
    sure = exact.share_about(exact.likeliest, ALIKE)
    if sure < SURE:
        raise FitRefused(
            f"what was heard fits this object's modes at several sizes, best at {1e2 * exact.likeliest:.1f} "
            f"cm with {100 * sure:.0f} %, and {100 * SURE:.0f} % are needed; strike more places, "
            "or say what it is made of"
        )
    likeliest = max(range(len(matches)), key=lambda k: matches[k].log_evidence)
    shared = modes_a_peak(peaks, materials[likeliest].model, float(np.log(exact.likeliest / nominal)))
    if shared > SHARED:
        raise FitRefused(
            f"{shared:.1f} modes share a peak of this object (limit {SHARED:g}): it is too soft or too thin "
            "for its modes to be told apart, and what was heard fits many sizes; look at it, or touch it"
        )
    belief = _mixed(matches, [one.belief.widened(one.sigma) for one in matches])
    return Hearing(belief, matches, time.perf_counter() - began)


def _matches(
    peaks: Peaks, materials: Sequence[MaterialGuess], nominal: float, sizes: SizeRange
) -> tuple[Match, ...]:
    """One a material, all from one likelihood: another material has the same frequencies at another size.

    So how well they match says nothing of the material: only how long the peaks ring does, and whether the
    size is one that was asked about.
    """
    logs = sizes.logs - np.log(nominal)
    speeds = np.array([guess.model.material.speed for guess in materials]) / materials[0].model.material.speed
    slower, faster = np.log(speeds.min()), np.log(speeds.max())
    few = np.linspace(logs[0] - faster, logs[-1] - slower, round((np.ptp(logs) + faster - slower) / GRID))
    likelihood = log_likelihood(peaks, materials[0].model, few)
    matches = []
    for guess, speed in zip(materials, speeds, strict=True):
        own = np.interp(logs - np.log(speed), few, likelihood)
        # How long the peaks ring: at a heard frequency the damping is the material's, whatever the size.
        expected = dampings(peaks.frequencies, guess.model.material)
        longer = np.log(np.maximum(peaks.decays, 0.1 * expected) / expected)
        spread = np.hypot(DAMPING_SIGMA, PEAK_DAMPING_SIGMA / np.sqrt(len(longer)))
        ringing = float(-0.5 * (np.median(longer) / spread) ** 2)
        evidence = float(np.logaddexp.reduce(TEMPER * own)) + ringing
        nats = float(own.max()) / len(peaks.frequencies)
        sigma = float(np.hypot(guess.sigma, SHAPE_SIGMA))
        matches.append(Match(Belief.of(sizes, TEMPER * own), evidence, sigma, float(speed), nats))
    return tuple(matches)


def _mixed(matches: Sequence[Match], beliefs: Sequence[Belief]) -> Belief:
    weighed = [one.log_evidence + belief.log_density for one, belief in zip(matches, beliefs, strict=True)]
    return Belief.of(beliefs[0].range, np.logaddexp.reduce(weighed, axis=0))
