"""From strikes at several places of one object to what sets the places apart.

While microphone, room and object stay where they are, a strike ``k`` of force spectrum ``F_k``
is heard as ``S_k(f) = F_k(f) sum_m g_m(x_k) R_m(f)``: the response ``R_m`` of a mode, of the
room and of the microphone is common to all strikes, and only the gains ``g_m(x_k)`` differ. Around
a resonance the transfer functions ``S_k / F_k`` are therefore one waveform times one complex
number a strike. Those numbers, known up to a common complex factor, are what a peak says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.basics.errors import DataRefused
from harness.bench.acquisition import Strike
from harness.strikes.spectra import Analysis, ComplexArray, Spectra, spectra_of

_Values = TypeVar("_Values", FloatArray, ComplexArray)

_LEAST_BINS = 5
_WIDTHS = 3
_LEAST_DECAY = 1.0
"""1/s: the scatter of a fit can bring a sharp peak's decay below zero."""


@dataclass(frozen=True, eq=False)
class Peak:
    """One resonance as all strikes heard it."""

    frequency: float  #: Hz.
    damping: float  #: 1/s, the window's taken off; the scatter of the fit can bring it below zero.
    y: ComplexArray  #: ``(K,)`` complex: the strikes' shares, of unit length; zero where ``heard`` is false.
    sigma: FloatArray  #: ``(K,)`` standard deviation of ``y`` by the noise before the strikes.
    heard: BoolArray  #: ``(K,)`` whether the strike excited this frequency.
    residual: float  #: share of the band's energy that is not one waveform.
    level: float  #: dB of its top against the strongest peak's.


@dataclass(frozen=True, eq=False)
class SoundEvidence:
    """What a run's strikes say."""

    used: BoolArray  #: ``(K,)`` whether each strike counts.
    reasons: tuple[str, ...]  #: why each does not; empty where it does.
    peaks: tuple[Peak, ...]  #: resonances that are one waveform, by ascending frequency.
    rejected: tuple[Peak, ...]
    """peaks that are not, being two modes at once or noise; and echoes' peaks on the skirts of stronger
    ones."""
    band: tuple[float, float]
    """Hz, least and greatest frequency that at least two strikes excited; zeros where none."""
    loudest: float = 0.0  #: dB re 1 Pa/N of the strongest peak's top, which the peaks' levels are against.


def analyse(strikes: Sequence[Strike], settings: Analysis | None = None) -> SoundEvidence:
    """Find the common resonances of strikes of one object, and the amplitude of each in every strike.

    Object and microphone are at rest.

    Returns:
        No peaks if fewer than two strikes are usable: a single strike does not separate the object from
        the microphone's response.

    Raises:
        DataRefused: rates differ, or a signal is not finite.
    """
    return _analysed(tuple(strikes), settings or Analysis())


@lru_cache(maxsize=32)
def _analysed(strikes: tuple[Strike, ...], settings: Analysis) -> SoundEvidence:
    """Analyse strikes once for the answers of all senses, the comparison and the report."""
    reasons = tuple(_why_not(strike, settings) for strike in strikes)
    used = np.array([reason == "" for reason in reasons], dtype=np.bool_)
    if used.sum() < 2:
        return SoundEvidence(read_only(used), reasons, (), (), (0.0, 0.0))
    heard = [strike for strike, counts in zip(strikes, used, strict=True) if counts]
    spectra = spectra_of(heard, settings)
    usable = spectra.frequencies[spectra.excited.sum(axis=0) >= 2]
    if len(usable) == 0:
        return SoundEvidence(read_only(used), reasons, (), (), (0.0, 0.0))
    found = [_peak(spectra, low, top, high, used, settings) for low, top, high in _bands(spectra, settings)]
    kept, rejected = _sorted_out([peak for peak in found if peak is not None], settings)
    band = (float(usable[0]), float(usable[-1]))
    loudest = max((peak.level for peak in found if peak is not None), default=0.0)
    return SoundEvidence(read_only(used), reasons, kept, rejected, band, loudest)


def _why_not(strike: Strike, settings: Analysis) -> str:
    if strike.fault:
        return strike.fault
    if not (np.isfinite(strike.force).all() and np.isfinite(strike.pressure).all()):
        raise DataRefused("a strike's force or pressure is not finite; calibrate the channels again")
    if len(strike.pressure) - strike.onset < 0.25 * settings.duration * strike.rate:
        return "the recording ends too early"
    return ""


def _bands(spectra: Spectra, settings: Analysis) -> list[tuple[int, int, int]]:
    """First, highest and last bin of every peak, strongest peak first."""
    excited = spectra.excited
    count = np.maximum(excited.sum(axis=0), 1)
    power = np.sum(np.abs(spectra.transfer) ** 2, axis=0) / count
    noise = np.sum(np.where(excited, spectra.noise, 0.0) ** 2, axis=0) / count
    open_bins = excited.sum(axis=0) >= 2
    level = np.where(open_bins, 10.0 * np.log10(np.maximum(power, 1e-300)), -3000.0)
    loudest = float(level.max())
    # Imported here, because it takes half a second and most commands do not need it.
    from scipy.signal import find_peaks

    tops, found = find_peaks(np.maximum(level, loudest - settings.range), prominence=min(settings.prominence))
    heard = (power[tops] > noise[tops] * 10.0 ** (settings.above_noise / 10.0)) & open_bins[tops]
    step = float(spectra.frequencies[1])
    reached = [_reach(power, int(top), settings.edge) for top in tops[heard]]
    bands = [
        band
        for band, stands in zip(reached, found["prominences"][heard], strict=True)
        if _stands_out(level, band, float(stands), step, settings)
    ]
    bands.sort(key=lambda band: -power[band[1]])
    return bands[: 2 * settings.most]


def _stands_out(
    level: FloatArray, band: tuple[int, int, int], prominence: float, step: float, settings: Analysis
) -> bool:
    """Whether a peak is too high, for its breadth, to be an echo's."""
    low, top, high = band
    broad = int((high - low) * step > settings.broad)
    # Several of its own widths where it is broad, or the floor would be its flanks.
    reach = max(settings.floor_reach / step, broad * _WIDTHS * (high - low))
    bins = round(reach)
    floor = float(np.median(level[max(0, top - bins) : top + bins + 1]))
    above = level[top] - floor
    return prominence >= settings.prominence[broad] and above > settings.above_floor[broad]


def _reach(power: FloatArray, top: int, edge: float) -> tuple[int, int, int]:
    low, high = top, top
    while low > 0 and edge * power[top] < power[low - 1]:
        low -= 1
    while high < len(power) - 1 and edge * power[top] < power[high + 1]:
        high += 1
    return min(low, top - _LEAST_BINS // 2), top, max(high, top + _LEAST_BINS // 2)


def _peak(
    spectra: Spectra, low: int, top: int, high: int, used: BoolArray, settings: Analysis
) -> Peak | None:
    band = slice(max(low, 0), high + 1)
    heard = spectra.excited[:, band].all(axis=1)
    if heard.sum() < 2:
        return None
    noise = spectra.noise[heard, top]
    # Rows of equal noise, so that a weak strike's noise does not pose as signal.
    whitening = noise.min() / noise if noise.min() > 0.0 else np.ones(len(noise))
    transfer = spectra.transfer[heard, band]
    _, strengths, waves = np.linalg.svd(whitening[:, None] * transfer, full_matrices=False)
    frequency, damping = _resonance(spectra.frequencies[band], waves[0], settings.decay)
    pole = frequency + 1j * max((damping + settings.decay), _LEAST_DECAY) / (2.0 * np.pi)
    wave = 1.0 / (spectra.frequencies[band] - pole)
    wave /= np.linalg.norm(wave)
    inverse = np.linalg.pinv(np.column_stack([wave, np.ones(len(wave))]))[0]
    y, unit = np.asarray(transfer @ inverse), float(np.linalg.norm(inverse))
    length = np.linalg.norm(y)
    everyone = np.nonzero(used)[0][heard]
    return Peak(
        frequency=frequency,
        damping=damping,
        y=read_only(_spread(y / length, everyone, len(used))),
        sigma=read_only(_spread(noise * unit / length, everyone, len(used))),
        heard=read_only(np.isin(np.arange(len(used)), everyone)),
        residual=float(1.0 - strengths[0] ** 2 / np.sum(strengths**2)),
        level=float(10.0 * np.log10(np.mean(np.abs(spectra.transfer[heard, top]) ** 2))),
    )


def _spread(values: _Values, where: IntArray, count: int) -> _Values:
    result = np.zeros(count, dtype=values.dtype)
    result[where] = values
    return result


def _resonance(frequencies: FloatArray, wave: ComplexArray, decay: float) -> tuple[float, float]:
    """Frequency in Hz and damping in 1/s of ``r / (f - z) + a``: ``f v = z v + (r - a z) + a f``.

    The constant ``a`` is the skirts of the neighbours; ``z`` is ``f0 + i d / (2 pi)``.
    """
    middle = float(frequencies[len(frequencies) // 2])
    offsets = frequencies - middle
    design = np.column_stack([wave, np.ones(len(wave)), offsets.astype(np.complex128)])
    pole = np.linalg.lstsq(design, offsets * wave, rcond=None)[0][0]
    frequency = middle + float(pole.real)
    if not frequencies[0] <= frequency <= frequencies[-1]:
        frequency = float(frequencies[int(np.argmax(np.abs(wave)))])
    return frequency, float(2.0 * np.pi * pole.imag - decay)


def _sorted_out(peaks: list[Peak], settings: Analysis) -> tuple[tuple[Peak, ...], tuple[Peak, ...]]:
    """Kept and rejected, by frequency; ``peaks`` come strongest first."""
    standing: list[Peak] = []
    kept: list[Peak] = []
    rejected: list[Peak] = []
    for peak in peaks:
        if _is_ripple(peak, standing, settings):
            rejected.append(peak)
            continue
        standing.append(peak)
        clean = peak.residual < settings.residual and len(kept) < settings.most
        (kept if clean else rejected).append(peak)
    loudest = max((peak.level for peak in peaks), default=0.0)

    def ascending(some: list[Peak]) -> tuple[Peak, ...]:
        relative = [replace(peak, level=peak.level - loudest) for peak in some]
        return tuple(sorted(relative, key=lambda peak: peak.frequency))

    return ascending(kept), ascending(rejected)


def _is_ripple(peak: Peak, stronger: list[Peak], settings: Analysis) -> bool:
    """Whether a peak is an echo's, on the skirts of stronger ones."""
    if not stronger:
        return False
    gaps = peak.frequency - np.array([other.frequency for other in stronger])
    widths = np.array([max(other.damping, 0.0) + settings.decay for other in stronger]) / (2.0 * np.pi)
    powers = 10.0 ** (np.array([other.level for other in stronger]) / 10.0)
    skirts = powers * widths**2 / (widths**2 + gaps**2)
    above = peak.level - 10.0 * np.log10(float(skirts.sum()))
    if above < settings.skirt:
        return True
    # Few enough that a mode of its own would still point elsewhere.
    few = max(1, int(peak.heard.sum()) // 2)
    leaking = [stronger[k].y for k in np.argsort(-skirts)[:few]]
    basis = np.linalg.qr(np.array(leaking).T)[0]
    own = 1.0 - float(np.linalg.norm(basis.conj().T @ peak.y) ** 2)
    return above < settings.shared_skirt and own < settings.shared
