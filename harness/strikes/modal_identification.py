"""Modes of a struck object from what was measured: frequencies, dampings, and how well they are known.

Either from a free decay, the response after the blow is over, or from measured transfer functions.
Both are lines that poles explain (`harness.strikes.pole_fit`). How many poles there are is decided thus:
modes are added where what is left of the lines stands above the noise about it, with a stated chance of a
false alarm, and all poles are refined together after each round, until nothing stands out. What a
misfit of a strong mode leaves beside it, a non-linearity or a support that gives way, is no mode: where
the model explains all but a stated share of a line's power, nothing is added. A mode that lies elsewhere
in each row, of a structure that changed between them, is one mode (`harness.strikes.moved_modes`); a pole
that does not decay is no mode of a passive structure.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import rfft, rfftfreq
from threadpoolctl import threadpool_limits

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, read_only
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused, WrongUse
from harness.strikes.moved_modes import MovedMode, merge_poles
from harness.strikes.pole_fit import ComplexArray, PoleFit, SpectralLines, fit_poles
from harness.strikes.pole_search import PoleSearch, new_poles

_LEAST_SAMPLES = 64
_LINES_A_MODE = 6
"""Or modes could follow the noise of a short record."""

_UNEVEN = 0.01
"""Of a line: as printed frequencies are off by their rounding."""

_ROUNDING = 1e-13
"""Of the strongest line: what is left below it is arithmetic."""


@dataclass(frozen=True, eq=False)
class IdentifiedMode:
    """One mode, as measured.

    Attributes:
        frequency: Hz, undamped.
        damping: 1/s.
        frequency_sigma: Hz, one standard deviation, by what the fit left about the peak.
        damping_sigma: 1/s.
        level: dB of its power in the band against the strongest mode's.
        lines: ``(k, f)`` what it adds to each line of the band.
        spread: Hz, one standard deviation from row to row of a mode that moved between them; zero of one that
            all rows have in one place.
    """

    frequency: float
    damping: float
    frequency_sigma: float
    damping_sigma: float
    level: float
    lines: ComplexArray
    spread: float = 0.0

    @property
    def ratio(self) -> float:
        """Damping ratio; one at critical damping."""
        return self.damping / (2.0 * np.pi * self.frequency)

    @property
    def ratio_sigma(self) -> float:
        """One standard deviation of ``ratio``."""
        return self.damping_sigma / (2.0 * np.pi * self.frequency)


@dataclass(frozen=True, eq=False)
class Identified:
    """What was found.

    Attributes:
        modes: by ascending frequency; each has a damping above zero.
        undamped: poles that do not decay, likewise: driven from outside, as by the mains, or sharper than the
            lines tell. No mode of a passive structure.
        frequencies: ``(f,)`` Hz, of the lines that were fitted.
        residual: ``(k, f)`` of them that no mode explains.
        unexplained: share of the lines' power in ``residual``.
        full: whether more modes stood out than were asked for.
        clipped: ``(k,)`` channels that read their greatest value again and again: what they say of dampings
            and of harmonics is not to be trusted.
    """

    modes: tuple[IdentifiedMode, ...]
    undamped: tuple[IdentifiedMode, ...]
    frequencies: FloatArray
    residual: ComplexArray
    unexplained: float
    full: bool
    clipped: BoolArray

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the modes, in sentences."""
        moved = (_moved_note(mode) for mode in self.modes if mode.spread > 0.0)
        clipped = (_clipped_note(int(channel)) for channel in np.flatnonzero(self.clipped))
        return (*clipped, *moved, *(_undamped_note(pole) for pole in self.undamped))


def modes_of_decay(decays: AnyArray, rate: float, search: PoleSearch | None = None) -> Identified:
    """The modes of free decays of one structure.

    Seconds grow with the lines of the band and the square of the modes: say the band of interest.

    Args:
        decays: ``(k, t)`` responses after the force has ended, of several blows or several places; any unit,
            one of all.
        rate: samples per second.
        search: how modes are looked for.

    Raises:
        DataRefused: silence, values that are not finite, or too few.
        WrongUse: a rate or a band that cannot be.
    """
    search = search or PoleSearch()
    signals = np.atleast_2d(np.asarray(decays, np.float64))
    if not (np.isfinite(rate) and rate > 0.0):
        raise WrongUse(f"a rate of {rate:g} samples per second; say one above 0")
    _check(signals, "the decay", "sample")
    samples = signals.shape[1]
    inner = slice(1, (samples + 1) // 2)
    lines = SpectralLines(rfftfreq(samples, 1.0 / rate)[inner], rfft(signals)[:, inner], rate)
    rounding = float(np.finfo(np.asarray(decays).dtype).eps) if np.asarray(decays).dtype.kind == "f" else 0.0
    found = _identified(_banded(lines, search), search, max(rounding * np.sqrt(samples), _ROUNDING))
    return replace(found, clipped=read_only(np.array([is_clipped(signal) for signal in signals])))


def modes_of_response(
    frequencies: FloatArray, responses: ComplexArray, search: PoleSearch | None = None, decay: float = 0.0
) -> Identified:
    """The modes of measured transfer functions of one structure.

    Accelerance or mobility: receptance grows without end towards 0 Hz where the structure is free, which
    no skirt follows.

    Args:
        frequencies: ``(f,)`` Hz, evenly spaced but for the rounding of printed ones, up to a hundredth of a
            line; a line at 0 Hz is left out.
        responses: ``(k, f)``, one row a pair of places.
        search: how modes are looked for.
        decay: 1/s of an exponential window that was put on forces and responses; dampings are freed of it.

    Raises:
        DataRefused: silence, values that are not finite, too few, or lines that are not evenly spaced.
        WrongUse: a band that cannot be.
    """
    search = search or PoleSearch()
    values = np.atleast_2d(np.asarray(responses, np.complex128))
    _check(values, "the transfer function", "line")
    even = _evenly_spaced(np.asarray(frequencies, np.float64), values.shape[1])
    inner = even > 0.5 * (even[1] - even[0])
    lines = SpectralLines(even[inner], values[:, inner], None)
    found = _identified(_banded(lines, search), search, _ROUNDING)
    if not decay:
        return found
    modes, undamped = _parted([_without(pole, decay) for pole in (*found.modes, *found.undamped)])
    return replace(found, modes=modes, undamped=undamped)


def _evenly_spaced(frequencies: FloatArray, lines: int) -> FloatArray:
    """``(f,)`` Hz: the straight line through frequencies that were rounded."""
    steps = np.diff(frequencies)
    if frequencies.shape != (lines,) or not (np.isfinite(frequencies).all() and steps.min() > 0.0):
        raise DataRefused(
            f"{lines} lines at frequencies of shape {frequencies.shape}, the least step "
            f"{steps.min(initial=np.inf):g} Hz; give one rising frequency a line"
        )
    number = np.arange(lines, dtype=np.float64)
    even = np.polyval(np.polyfit(number, frequencies, 1), number)
    off = float(np.abs(frequencies - even).max())
    if off > _UNEVEN * float(steps.mean()):
        raise DataRefused(
            f"the frequencies are up to {off:g} Hz off evenly spaced ones of {steps.mean():g} Hz (at most "
            f"{_UNEVEN:g} of a line); a response is read on evenly spaced frequencies, one a line"
        )
    return np.asarray(even)


def _without(mode: IdentifiedMode, decay: float) -> IdentifiedMode:
    """A mode whose pole an exponential window has moved: back, at the same damped frequency."""
    omega, damping = 2.0 * np.pi * mode.frequency, mode.damping - decay
    squared = omega**2 - mode.damping**2 + damping**2
    return replace(mode, frequency=float(np.sqrt(max(squared, 0.0)) / (2.0 * np.pi)), damping=damping)


def _check(values: AnyArray, what: str, each: str) -> None:
    if values.ndim != 2 or values.shape[1] < _LEAST_SAMPLES:
        raise DataRefused(
            f"{what} has shape {values.shape}; it must be (channels, {each}s), with at least "
            f"{_LEAST_SAMPLES} {each}s"
        )
    if not np.isfinite(values).all():
        raise DataRefused(
            f"{what} holds values that are not finite; leave the channel out or calibrate again"
        )
    if not (values != values[:, :1]).any():
        raise DataRefused(f"{what} is silent: every {each} has one value; there is nothing to identify")


def _banded(lines: SpectralLines, search: PoleSearch) -> SpectralLines:
    high = float(lines.frequencies[-1]) if search.high is None else search.high
    kept = lines.between(search.low, high)
    if len(kept.frequencies) < _LEAST_SAMPLES // 2:
        raise WrongUse(
            f"{search.low:g} to {high:g} Hz holds {len(kept.frequencies)} lines {lines.step:g} Hz apart; "
            f"say a band of {_LEAST_SAMPLES // 2} and more"
        )
    return kept


def _identified(lines: SpectralLines, search: PoleSearch, rounding: float) -> Identified:
    # The products are too small for a second core, which would wait for them where anything else runs.
    with threadpool_limits(limits=1, user_api="blas"):
        return _searched(lines, search, rounding)


def _searched(lines: SpectralLines, search: PoleSearch, rounding: float) -> Identified:
    fit = fit_poles(lines, np.zeros(0), np.zeros(0), search.skirt)
    most = min(search.most, len(lines.frequencies) // _LINES_A_MODE)
    moved, full = merge_poles(lines, fit, search), False
    while not full:
        new = [one for one in new_poles(lines, fit, search, rounding) if not _stands_for(moved, one[0])]
        room = most - len(fit.omegas)
        full = len(new) > room
        if len(new) == 0 or room == 0:
            break
        omegas = np.concatenate([fit.omegas, [omega for omega, _ in new[:room]]])
        decays = np.concatenate([fit.decays, [decay for _, decay in new[:room]]])
        fit = fit_poles(lines, omegas, decays, search.skirt)
        moved = merge_poles(lines, fit, search)
    return _described(lines, fit, moved, full)


def _stands_for(moved: Sequence[MovedMode], omega: float) -> bool:
    return any(mode.contains(omega) for mode in moved)


def _described(lines: SpectralLines, fit: PoleFit, moved: Sequence[MovedMode], full: bool) -> Identified:
    grouped = {int(member) for mode in moved for member in mode.members}
    poles = [_pole(fit, k) for k in range(len(fit.omegas)) if k not in grouped]
    poles += [_moved_pole(fit, mode) for mode in moved]
    loudest = max((pole.level for pole in poles), default=0.0)
    low, high = lines.frequencies[[0, -1]]
    inside = [pole for pole in poles if low <= pole.frequency <= high and pole.level > 0.0]
    levelled = [replace(pole, level=float(10.0 * np.log10(pole.level / loudest))) for pole in inside]
    whole = float(np.sum(np.abs(lines.values) ** 2))
    modes, undamped = _parted(levelled)
    return Identified(
        modes=modes,
        undamped=undamped,
        frequencies=read_only(lines.frequencies),
        residual=read_only(fit.residual),
        unexplained=float(np.sum(np.abs(fit.residual) ** 2)) / whole,
        full=full,
        clipped=read_only(np.zeros(len(lines.values), np.bool_)),
    )


def _parted(
    poles: Sequence[IdentifiedMode],
) -> tuple[tuple[IdentifiedMode, ...], tuple[IdentifiedMode, ...]]:
    """Those that decay and those that do not, each by ascending frequency."""
    ordered = sorted(poles, key=lambda pole: pole.frequency)
    decaying = tuple(pole for pole in ordered if pole.damping > 0.0)
    return decaying, tuple(pole for pole in ordered if not pole.damping > 0.0)


def _pole(fit: PoleFit, k: int) -> IdentifiedMode:
    """A pole that all rows share; its level is still a power."""
    omega, sigmas = float(fit.omegas[k]), np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    return IdentifiedMode(
        frequency=omega / (2.0 * np.pi),
        damping=float(fit.decays[k]),
        frequency_sigma=omega / (2.0 * np.pi) * float(sigmas[k]),
        damping_sigma=omega * float(sigmas[len(fit.omegas) + k]),
        level=float(np.sum(np.abs(fit.model[k]) ** 2)),
        lines=read_only(fit.model[k]),
    )


def _moved_pole(fit: PoleFit, mode: MovedMode) -> IdentifiedMode:
    """A mode that several shared poles stood for; its level is still a power."""
    lines = fit.model[mode.members].sum(axis=0)
    return IdentifiedMode(
        frequency=mode.omega / (2.0 * np.pi),
        damping=mode.decay,
        frequency_sigma=mode.omega_sigma / (2.0 * np.pi),
        damping_sigma=mode.decay_sigma,
        level=float(np.sum(np.abs(lines) ** 2)),
        lines=read_only(lines),
        spread=mode.spread / (2.0 * np.pi),
    )


def _clipped_note(channel: int) -> str:
    return (
        f"row {channel + 1} of the decays is clipped: its modes, dampings and levels are not those of the "
        "object; leave it out, and strike softer or set a wider range"
    )


def _moved_note(mode: IdentifiedMode) -> str:
    return (
        f"the structure changed between the rows: the mode at {mode.frequency:.6g} Hz lies "
        f"{mode.spread:.2g} Hz (one standard deviation) elsewhere from row to row"
    )


def _undamped_note(pole: IdentifiedMode) -> str:
    return (
        f"{pole.frequency:.6g} Hz does not decay (damping {pole.damping:.2g} 1/s, one standard deviation "
        f"{pole.damping_sigma:.2g}): driven from outside, or sharper than the lines tell; it is no mode"
    )
