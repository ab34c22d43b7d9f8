"""From strikes at several places of one object to what sets the places apart.

While microphone, room and object stay where they are, a strike ``k`` of force spectrum ``F_k``
is heard as ``S_k(f) = F_k(f) sum_m g_m(x_k) R_m(f)``: the response ``R_m`` of a mode, of the
room and of the microphone is common to all strikes, and only the gains ``g_m(x_k)`` differ. Around
a resonance the transfer functions ``S_k / F_k`` are therefore one waveform times one complex
number a strike. Those numbers, known up to a common complex factor, are what a peak says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy.fft import next_fast_len, rfft, rfftfreq
from scipy.signal import find_peaks

from harness.acquisition import Strike
from harness.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.errors import DataRefused

ComplexArray = npt.NDArray[np.complex128]
_Values = TypeVar("_Values", FloatArray, ComplexArray)

_RATE_TOLERANCE = 1.0e-3
_LEAST_NOISE_SAMPLES = 64
_LEAST_BINS = 5


@dataclass(frozen=True)
class Analysis:
    """How strikes are read.

    Attributes:
        decay: 1/s of the exponential window, against late reverberation. It is put on the force too:
            an exponential passes through a convolution, so that it changes no transfer function
            but by adding to the damping of every mode.
        duration: s of each strike that are read.
        before: s before the trigger at which reading begins.
        pulse: s of force that are read; what the cell shows later is its own noise (ISO 7626-5).
        force_floor: share of its greatest spectral value below which a force excites nothing: 26 dB
            against the 20 of ISO 7626-5, because what is too noisy is found out by itself.
        lowest: Hz; below it are the room and the object rocking on its stand.
        prominence: dB that a peak stands above its surroundings.
        above_noise: dB that it stands above what was heard before the strikes.
        above_floor: dB that it stands above the median about it: between resonances a room's echoes make
            peaks out of what all modes together answer, seldom 10 dB above their median.
        floor_reach: Hz to each side over which that median is taken.
        edge: share of a peak's power down to which its band reaches.
        residual: share of a band's energy that may differ from one waveform.
        skirt: dB that a peak must stand above the skirts of stronger ones, on which a room's echoes make
            peaks of their own.
        shared_skirt: the same for a peak whose shares are those of the stronger ones.
        shared: share of a peak's energy beyond which its shares are its own.
        most: peaks kept at most, strongest first.
    """

    decay: float = 20.0
    duration: float = 0.3
    before: float = 1.0e-3
    pulse: float = 4.0e-3
    force_floor: float = 0.05
    lowest: float = 150.0
    prominence: float = 6.0
    above_noise: float = 10.0
    above_floor: float = 9.0
    floor_reach: float = 250.0
    edge: float = 0.25
    residual: float = 0.12
    skirt: float = 6.0
    shared_skirt: float = 14.0
    shared: float = 0.1
    most: int = 40


@dataclass(frozen=True, eq=False)
class Peak:
    """One resonance as all strikes heard it.

    Attributes:
        frequency: Hz.
        damping: 1/s, the window's taken off; the scatter of the fit can bring it below zero.
        y: ``(K,)`` complex: the strikes' shares, of unit length; zero where ``heard`` is false.
        sigma: ``(K,)`` standard deviation of ``y`` by the noise before the strikes.
        heard: ``(K,)`` whether the strike excited this frequency.
        residual: share of the band's energy that is not one waveform.
        level: dB of its top against the strongest peak's.
    """

    frequency: float
    damping: float
    y: ComplexArray
    sigma: FloatArray
    heard: BoolArray
    residual: float
    level: float


@dataclass(frozen=True, eq=False)
class SoundEvidence:
    """What a run's strikes say.

    Attributes:
        used: ``(K,)`` whether each strike counts.
        reasons: why each does not; empty where it does.
        peaks: resonances that are one waveform, by ascending frequency.
        rejected: peaks that are not, being two modes at once or noise; and echoes' peaks on the skirts
            of stronger ones.
        band: Hz, least and greatest frequency that at least two strikes excited; zeros where none.
    """

    used: BoolArray
    reasons: tuple[str, ...]
    peaks: tuple[Peak, ...]
    rejected: tuple[Peak, ...]
    band: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Of the strikes that count: rows are strikes, columns frequencies."""

    frequencies: FloatArray
    transfer: ComplexArray
    excited: BoolArray
    noise: FloatArray


def analyse(strikes: Sequence[Strike], settings: Analysis | None = None) -> SoundEvidence:
    """The resonances that the strikes have in common, and each strike's share of every one.

    Args:
        strikes: of one object at rest, heard by one microphone at rest.
        settings: how they are read.

    Returns:
        No peaks where fewer than two strikes count: one alone cannot be told from the microphone's
        response.

    Raises:
        DataRefused: rates differ, or a signal is not finite.
    """
    settings = settings or Analysis()
    reasons = tuple(_why_not(strike, settings) for strike in strikes)
    used = np.array([reason == "" for reason in reasons], dtype=np.bool_)
    if used.sum() < 2:
        return SoundEvidence(read_only(used), reasons, (), (), (0.0, 0.0))
    heard = [strike for strike, counts in zip(strikes, used, strict=True) if counts]
    spectra = _spectra(heard, settings)
    usable = spectra.frequencies[spectra.excited.sum(axis=0) >= 2]
    if len(usable) == 0:
        return SoundEvidence(read_only(used), reasons, (), (), (0.0, 0.0))
    found = [_peak(spectra, low, top, high, used, settings) for low, top, high in _bands(spectra, settings)]
    kept, rejected = _sorted_out([peak for peak in found if peak is not None], settings)
    return SoundEvidence(read_only(used), reasons, kept, rejected, (float(usable[0]), float(usable[-1])))


def _why_not(strike: Strike, settings: Analysis) -> str:
    if strike.silent:
        return "no strike came"
    if strike.overload:
        return "a channel was overloaded"
    if strike.double_hit:
        return "the hammer hit twice"
    if not (np.isfinite(strike.force).all() and np.isfinite(strike.pressure).all()):
        raise DataRefused("a strike's force or pressure is not finite; calibrate the channels again")
    if len(strike.pressure) - strike.onset < 0.25 * settings.duration * strike.rate:
        return "the recording ends too early"
    return ""


def _common_rate(strikes: Sequence[Strike]) -> float:
    rates = np.array([strike.rate for strike in strikes])
    rate = float(np.median(rates))
    if np.max(np.abs(rates / rate - 1.0)) > _RATE_TOLERANCE:
        raise DataRefused(
            f"the strikes were sampled at {rates.min():g} to {rates.max():g} Hz; "
            "strikes of one run must share one rate, to one part in a thousand"
        )
    return rate


def _spectra(strikes: Sequence[Strike], settings: Analysis) -> _Spectra:
    rate = _common_rate(strikes)
    samples = round(settings.duration * rate)
    size = int(next_fast_len(2 * samples, real=True))
    frequencies = rfftfreq(size, 1.0 / rate)
    window = np.exp(-settings.decay * np.arange(samples) / rate)
    force, pressure, noise = [], [], []
    for strike in strikes:
        start = max(0, strike.onset - round(settings.before * rate))
        pulse = round((settings.before + settings.pulse) * rate)
        force.append(rfft(_windowed(strike.force, start, window, pulse), size))
        pressure.append(rfft(_windowed(strike.pressure, start, window, samples), size))
        noise.append(_noise_density(strike.pressure[:start], window))
    forces = np.array(force)
    strength = np.abs(forces)
    excited = strength >= settings.force_floor * strength.max(axis=1, keepdims=True)
    excited &= (strength > 0.0) & (frequencies >= settings.lowest)
    safe = np.where(excited, forces, 1.0)
    transfer = np.where(excited, np.array(pressure) / safe, 0.0)
    return _Spectra(frequencies, transfer, excited, np.array(noise)[:, None] / np.abs(safe))


def _windowed(signal: FloatArray, start: int, window: FloatArray, length: int) -> FloatArray:
    rest = signal[:start].mean() if start >= _LEAST_NOISE_SAMPLES else 0.0
    piece = signal[start : start + min(length, len(window))] - rest
    return np.asarray(piece * window[: len(piece)])


def _noise_density(before: FloatArray, window: FloatArray) -> float:
    """Expected magnitude of a spectral line of what was heard before the strike, as if white."""
    if len(before) < _LEAST_NOISE_SAMPLES:
        return 0.0
    return float(before.std() * np.sqrt(np.sum(window**2)))


def _bands(spectra: _Spectra, settings: Analysis) -> list[tuple[int, int, int]]:
    """First, highest and last bin of every peak, strongest peak first."""
    excited = spectra.excited
    count = np.maximum(excited.sum(axis=0), 1)
    power = np.sum(np.abs(spectra.transfer) ** 2, axis=0) / count
    noise = np.sum(np.where(excited, spectra.noise, 0.0) ** 2, axis=0) / count
    open_bins = excited.sum(axis=0) >= 2
    level = np.where(open_bins, 10.0 * np.log10(np.maximum(power, 1e-300)), -3000.0)
    loudest = float(level.max())
    tops, _ = find_peaks(np.maximum(level, loudest - 120.0), prominence=settings.prominence)
    loud = power[tops] > noise[tops] * 10.0 ** (settings.above_noise / 10.0)
    reach = round(settings.floor_reach / float(spectra.frequencies[1]))
    floor = np.array([np.median(level[max(0, top - reach) : top + reach + 1]) for top in tops])
    tops = tops[loud & open_bins[tops] & (level[tops] > floor + settings.above_floor)]
    tops = tops[np.argsort(-power[tops], kind="stable")][: 2 * settings.most]
    return [_reach(power, int(top), settings.edge) for top in tops]


def _reach(power: FloatArray, top: int, edge: float) -> tuple[int, int, int]:
    low, high = top, top
    while low > 0 and edge * power[top] < power[low - 1]:
        low -= 1
    while high < len(power) - 1 and edge * power[top] < power[high + 1]:
        high += 1
    return min(low, top - _LEAST_BINS // 2), top, max(high, top + _LEAST_BINS // 2)


def _peak(
    spectra: _Spectra, low: int, top: int, high: int, used: BoolArray, settings: Analysis
) -> Peak | None:
    band = slice(max(low, 0), high + 1)
    heard = spectra.excited[:, band].all(axis=1)
    if heard.sum() < 2:
        return None
    noise = spectra.noise[heard, top]
    # Rows of equal noise, so that a weak strike's noise does not pose as signal.
    whitening = noise.min() / noise if noise.min() > 0.0 else np.ones(len(noise))
    left, strengths, right = np.linalg.svd(
        whitening[:, None] * spectra.transfer[heard, band], full_matrices=False
    )
    y = left[:, 0] / whitening
    length = np.linalg.norm(y)
    frequency, damping = _resonance(spectra.frequencies[band], right[0], settings.decay)
    everyone = np.nonzero(used)[0][heard]
    return Peak(
        frequency=frequency,
        damping=damping,
        y=read_only(_spread(y / length, everyone, len(used))),
        sigma=read_only(_spread(noise / (strengths[0] * length), everyone, len(used))),
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
