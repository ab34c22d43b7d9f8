"""Likelihood of a list of peaks at every size: a Poisson process over the logarithm of frequency.

``RingingModel`` gives the frequencies and levels of a known object's modes at any size.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr

from harness.basics.arrays import FloatArray, read_only
from harness.basics.compiled import compiled
from harness.basics.materials import Material
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_sound import radiation

LISTENED_FROM = 0.5
"""M between object and microphone where nobody says: half as far is 6 dB, less than a place's own."""


@dataclass(frozen=True, eq=False)
class RingingModel:
    """The modes of an object at its nominal size, and how strongly a typical strike excites each."""

    frequencies: FloatArray  #: ``(m,)`` Hz, ascending.
    amplitudes: FloatArray
    """``(m,)`` Pa s / N, rms over the surface: gain along the normal times radiation. The transfer function
    at a resonance is half of it over the decay."""
    material: Material  #: whose damping they have.

    @classmethod
    def of(cls, modes: Modes, material: Material, distance: float = LISTENED_FROM) -> "RingingModel":
        """From the modes of the nominal object; ``distance`` in m to the microphone."""
        along = np.einsum("nmd,nd->nm", modes.shapes, modes.normals)
        middling = np.sqrt(np.mean(along**2, axis=0))
        return cls(
            read_only(modes.frequencies.copy()), read_only(middling * radiation(modes, distance)), material
        )

    def made_of(self, material: Material) -> "RingingModel":
        """The same body of another material: frequencies as sqrt(E / density), amplitudes as 1 / density.

        Poisson's ratio stays as it was, which shifts modes against each other by a percent or two.
        """
        if material == self.material:
            return self
        faster = material.speed / self.material.speed
        lighter = self.material.density / material.density
        return RingingModel(
            read_only(self.frequencies * faster), read_only(self.amplitudes * lighter), material
        )

    def levels(self, log_sizes: FloatArray, window_decay: float) -> FloatArray:
        """``(k, m)`` dB re 1 Pa/N of each peak of an object larger by ``exp(log_sizes)``.

        Frequencies go with 1/s, amplitudes with s^-2: mass with s^3, and the flow of air with s^-1/2.

        Args:
            log_sizes: ``(k,)`` logarithms of the size over the nominal one.
            window_decay: 1/s that the analysis adds to every decay.
        """
        heard = self.frequencies * np.exp(-log_sizes[:, None])
        decays = dampings(heard, self.material) + window_decay
        found: FloatArray = 20.0 * np.log10(
            np.maximum(self.amplitudes * np.exp(-2.0 * log_sizes[:, None]) / (2.0 * decays), 1e-30)
        )
        return found


NARROW, WIDE = 0.008, 0.035
"""Deviations of a mode's frequency from its model's, relative: most, and the others."""

NARROW_SHARE = 0.8

LEVEL_SIGMA = 13.0
"""dB, of a peak's level about the model's: the struck places, the microphone's way, the wall. Measured on
strikes of mocked objects whose size was known."""

FOUND = 0.9
"""Chance that a mode loud enough is found as a peak of its own."""

WIDTHS = 3.0
"""Half widths of a resonance within which two are heard as one peak."""

CLUTTER = 1.5
"""Peaks a band that are no mode's: echoes of the room, and what noise leaves of the weakest."""

CLUTTER_FALL = 5.0
"""dB over which these become rarer by e above the faintest peak. Measured on mocked strikes: they stand 3.5
above it on average, peaks of modes 16."""

_REACH = 4.0
_PARTS = 16
"""Of the band above the solved modes, in each of which the rate of their peaks is taken as even."""


@dataclass(frozen=True, eq=False)
class Peaks:
    """What was heard."""

    frequencies: FloatArray  #: ``(p,)`` Hz.
    levels: FloatArray  #: ``(p,)`` dB re 1 Pa/N.
    band: tuple[float, float]  #: Hz, from and to, that the strikes excited.
    window_decay: float  #: 1/s that the analysis adds to every decay.
    decays: FloatArray  #: ``(p,)`` 1/s, the window's taken off.

    def apart(self) -> "Peaks":
        """Without those that stand within half a resonance's width of a louder one, which they are again.

        An analysis gives a resonance that several strikes rang, or whose decay is not even, more than once.
        Each would be evidence for a size that its neighbour is evidence for already.
        """
        half_widths = (np.maximum(self.decays, 0.0) + self.window_decay) / (2.0 * np.pi)
        kept: list[int] = []
        for peak in np.argsort(-self.levels, kind="stable"):
            away = np.abs(self.frequencies[peak] - self.frequencies[kept])
            if np.all(away > half_widths[kept]):
                kept.append(int(peak))
        own = np.sort(kept)
        return replace(
            self, frequencies=self.frequencies[own], levels=self.levels[own], decays=self.decays[own]
        )


def log_likelihood(peaks: Peaks, model: RingingModel, log_sizes: FloatArray) -> FloatArray:
    """Of the peaks, at every size.

    Args:
        peaks: heard; one or more.
        model: of the object at its nominal size.
        log_sizes: ``(k,)`` evenly spaced: logarithms of the size over the nominal one.

    Returns:
        ``(k,)`` logarithm of the likelihood over that of chance peaks alone.
    """
    levels = model.levels(log_sizes, peaks.window_decay)
    threshold = float(peaks.levels.min()) - 0.5 * LEVEL_SIGMA
    low, high = np.log(peaks.band)
    logs = np.log(model.frequencies)
    heard = logs - log_sizes[:, None]
    alike = _overlapping(model, heard, peaks.window_decay)
    levels = levels + 10.0 * np.log10(alike)  # energies of modes that are heard as one add
    loud = FOUND * ndtr((levels - threshold) / LEVEL_SIGMA) / alike
    in_band = ndtr((heard - low) / NARROW) - ndtr((heard - high) / NARROW)
    expected = (loud * in_band).sum(axis=1)
    above = (peaks.levels - peaks.levels.min()) / CLUTTER_FALL
    clutter = CLUTTER / (high - low) * np.exp(-above) / CLUTTER_FALL
    beyond = UnsolvedModes.of(model)
    expected += beyond.expected(log_sizes, peaks, threshold)
    matches = _matched(
        np.log(peaks.frequencies), peaks.levels, logs, levels, loud, log_sizes, clutter,
        beyond.intensity(log_sizes, peaks, threshold),
    )  # fmt: skip
    return np.asarray(matches - expected)


def modes_a_peak(peaks: Peaks, model: RingingModel, log_size: float) -> float:
    """How many modes share a peak of the band, on average; 1 where none is in it.

    Args:
        peaks: heard.
        model: of the object at its nominal size.
        log_size: logarithm of the size over the nominal one.
    """
    heard = np.log(model.frequencies) - np.array([[log_size]])
    low, high = np.log(peaks.band)
    in_band = (heard >= low) & (heard <= high)
    return float(_overlapping(model, heard, peaks.window_decay)[in_band].mean()) if in_band.any() else 1.0


@dataclass(frozen=True)
class UnsolvedModes:
    """Modes above the highest that was solved: how many there are is known, not where each is.

    They go on at the spacing of those below, as a thin wall's do (Cremer, Heckl and Petersson,
    Structure-borne sound, 2005). Without them a peak up there would be chance at a large size and a mode's at
    a small one: things of a soft material, which have too many modes to solve all, would be called small.
    """

    top: float  #: Hz, of the nominal object, from where on modes were not solved.
    per_hz: float  #: modes a hertz of it.
    amplitude: float  #: Pa s / N, of a middling one.
    material: Material  #: whose damping they have.

    @classmethod
    def of(cls, model: RingingModel) -> "UnsolvedModes":
        """As the upper half of the modes that were solved goes on."""
        upper = model.frequencies[len(model.frequencies) // 2 :]
        amplitude = float(np.exp(np.log(model.amplitudes[-len(upper) :] + 1e-30).mean()))
        per_hz = (len(upper) - 1) / max(float(np.ptp(upper)), 1.0)
        return cls(float(upper[-1]), per_hz, amplitude, model.material)

    def expected(self, log_sizes: FloatArray, peaks: Peaks, threshold: float) -> FloatArray:
        """``(k,)`` how many of their peaks are in the band and likely louder than ``threshold`` dB."""
        low, high = np.log(peaks.band)
        begin = np.clip(np.log(self.top) - log_sizes, low, high)
        share = (np.arange(_PARTS) + 0.5) / _PARTS
        logs = begin[:, None] + (high - begin)[:, None] * share
        rate, _ = self._rate(np.exp(logs), log_sizes[:, None], peaks.window_decay, threshold)
        return np.asarray(rate.mean(axis=1) * (high - begin))

    def intensity(self, log_sizes: FloatArray, peaks: Peaks, threshold: float) -> FloatArray:
        """``(p, k)`` of them at every peak, per unit of log frequency and per dB; 0 below ``top``."""
        heard = peaks.frequencies[:, None]
        rate, levels = self._rate(heard, log_sizes, peaks.window_decay, threshold)
        off = (peaks.levels[:, None] - levels) / LEVEL_SIGMA
        loudness = np.exp(-0.5 * off**2) / (LEVEL_SIGMA * np.sqrt(2.0 * np.pi))
        return np.where(np.log(heard) + log_sizes > np.log(self.top), rate * loudness, 0.0)

    def _rate(
        self, heard: FloatArray, log_sizes: FloatArray, window_decay: float, threshold: float
    ) -> tuple[FloatArray, FloatArray]:
        """Peaks a unit of the logarithm at frequencies in Hz, and their levels in dB re 1 Pa/N."""
        decays = dampings(heard, self.material) + window_decay
        levels = 20.0 * np.log10(self.amplitude * np.exp(-2.0 * log_sizes) / (2.0 * decays))
        per_hz = self.per_hz * np.exp(log_sizes)
        apart = 1.0 + 2.0 * per_hz * WIDTHS * decays / (2.0 * np.pi)  # modes that share one peak
        levels = levels + 10.0 * np.log10(apart)
        found = FOUND * ndtr((levels - threshold) / LEVEL_SIGMA) / apart
        return np.asarray(per_hz * heard * found), np.asarray(levels)


def _overlapping(model: RingingModel, heard: FloatArray, window_decay: float) -> FloatArray:
    """``(k, m)``: how many modes share each mode's peak: those nearer than its own width, itself included."""
    frequencies = np.exp(heard)
    widths = WIDTHS * (dampings(frequencies, model.material) + window_decay) / (2.0 * np.pi)
    # Compared at the nominal size, where the modes are in order once and for all sizes.
    nominal = model.frequencies
    reach = widths * nominal / frequencies
    first = np.searchsorted(nominal, nominal - reach)
    last = np.searchsorted(nominal, nominal + reach)
    return np.asarray(last - first, dtype=np.float64)


def load_kernels() -> None:
    """Compile or load the kernel of a match, so that the seconds of no answer count it."""
    peaks, table = np.ones(2), np.ones((3, 2))
    _matched(peaks, peaks, peaks, table, table, np.linspace(0.0, 1.0, 3), peaks, np.ones((2, 3)))


@compiled
def _matched(
    heard: FloatArray,
    heard_levels: FloatArray,
    modes: FloatArray,
    levels: FloatArray,
    found: FloatArray,
    log_sizes: FloatArray,
    clutter: FloatArray,
    beyond: FloatArray,
) -> FloatArray:
    """``(k,)`` sum over peaks of the logarithm of their intensity over clutter's, at every size."""
    first, step, count = log_sizes[0], log_sizes[1] - log_sizes[0], len(log_sizes)
    total = np.zeros(count)
    intensity = np.empty(count)
    norm = 1.0 / np.sqrt(2.0 * np.pi)
    for peak in range(len(heard)):
        intensity[:] = beyond[peak]
        for mode in range(len(modes)):
            middle = modes[mode] - heard[peak]  # the size at which this mode is heard there
            low = max(0, int(np.ceil((middle - _REACH * WIDE - first) / step)))
            high = min(count - 1, int(np.floor((middle + _REACH * WIDE - first) / step)))
            for k in range(low, high + 1):
                apart = log_sizes[k] - middle
                narrow = NARROW_SHARE / NARROW * np.exp(-0.5 * (apart / NARROW) ** 2)
                wide = (1.0 - NARROW_SHARE) / WIDE * np.exp(-0.5 * (apart / WIDE) ** 2)
                off = (heard_levels[peak] - levels[k, mode]) / LEVEL_SIGMA
                loudness = norm / LEVEL_SIGMA * np.exp(-0.5 * off * off)
                intensity[k] += found[k, mode] * norm * (narrow + wide) * loudness
        for k in range(count):
            total[k] += np.log1p(intensity[k] / clutter[peak])
    return total
