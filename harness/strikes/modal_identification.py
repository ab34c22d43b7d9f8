"""Modes of a struck object from what was measured: frequencies, dampings, and how well they are known.

Either from a free decay, the response after the blow is over, or from measured transfer functions.
Both are lines that poles explain (`harness.strikes.pole_fit`). How many poles there are is decided thus:
modes are added where what is left of the lines stands above the noise about it, with a stated chance of a
false alarm, and all poles are refined together after each round, until nothing stands out. What a
misfit of a strong mode leaves beside it, a non-linearity or a support that gives way, is no mode: where
the model explains all but a stated share of a line's power, nothing is added. A mode that lies elsewhere
in each row, of a structure that changed between them, is one mode (``merge_poles``); a pole
that does not decay is no mode of a passive structure.

Neighbouring shared poles may be one mode of the structure. Rows of transfer functions are often measured one
after another: a hammer roves, a sensor is moved, the structure warms up. A mode whose frequency differs from
row to row is not a pole that all rows share, and a fit of shared poles uses several poles for it. Mode shapes
separate it from modes that are really close together:

- Each row alone has one pole there. A row that has two shows two modes.
- The rows' own frequencies are all different. Frequencies that repeat in several rows are those of separate
  modes, each near a node in some of the rows.
- As many poles as rows are needed. Fewer that explain a hundred times more are the modes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import rfft, rfftfreq
from scipy.ndimage import uniform_filter1d
from threadpoolctl import threadpool_limits

from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only
from harness.basics.clipping import is_clipped
from harness.basics.errors import DataRefused, WrongUse
from harness.strikes.pole_fit import (
    APART,
    ComplexArray,
    PoleFit,
    PoleSearch,
    SpectralLines,
    fit_poles,
    new_poles,
)

_LEAST_SAMPLES = 64
_LINES_A_MODE = 6
"""Or modes could follow the noise of a short record."""

_UNEVEN = 0.01
"""Of a line: as printed frequencies are off by their rounding."""

_ROUNDING = 1e-13
"""Of the strongest line: what is left below it is arithmetic."""

_NEIGHBOURHOODS = (0.015, 0.005)
"""Greatest relative gap between poles of one mode, tried in this order. The modes of a ruler that a hammer
roved along moved by half a per cent between rows."""

_MIN_LINES = 16
"""Lines to each side of the poles that are fitted with them."""

_MIN_ROW_POWER = 1e-4
"""Fraction of the strongest row's power. Weaker rows are near a node and do not show the frequency."""

_MAX_RESIDUAL_RATIO = 0.5
"""Power that one pole a row leaves, over the power that one pole of all rows leaves."""

_NOISE = 2.0
"""Power that one pole a row may leave, over the power that the shared poles leave."""

_EXPLAINED = 0.01
"""Power that shared poles leave, over the power that one pole a row leaves, below which fewer poles than
rows are the modes."""

_SMOOTHED_LINES = 3
_PEAK_FRACTION = 0.1
"""Factor on ``PoleSearch.misfit``: a row's residual below this fraction of its highest line is no mode."""

_NOISE_PEAK = 8.0
"""Local residual power over that of the shared poles from which a row has another mode."""

_RESOLVED = 1.5
"""Half widths of the broader pole between two poles that a row alone can show as two peaks."""

_REPEATED = 0.2
"""Range of the rows' frequencies about one mode, over the gap to those about the next."""

_MIN_REPEATS = 2
"""Rows beyond one for each frequency from which coincidence does not explain that frequencies repeat."""


@dataclass(frozen=True, eq=False)
class IdentifiedMode:
    """One mode, as measured."""

    frequency: float  #: Hz, undamped.
    damping: float  #: 1/s.
    frequency_sigma: float  #: Hz, one standard deviation, by what the fit left about the peak.
    damping_sigma: float  #: 1/s.
    level: float  #: dB of its power in the band against the strongest mode's.
    lines: ComplexArray  #: ``(k, f)`` what it adds to each line of the band.
    spread: float = 0.0
    """Hz, one standard deviation from row to row of a mode that moved between them; zero of one that all rows
    have in one place."""

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
    """What was found."""

    modes: tuple[IdentifiedMode, ...]  #: by ascending frequency; each has a damping above zero.
    undamped: tuple[IdentifiedMode, ...]
    """poles that do not decay, likewise: driven from outside, as by the mains, or sharper than the lines
    tell. No mode of a passive structure."""
    frequencies: FloatArray  #: ``(f,)`` Hz, of the lines that were fitted.
    residual: ComplexArray  #: ``(k, f)`` of them that no mode explains.
    unexplained: float  #: share of the lines' power in ``residual``.
    full: bool  #: whether more modes stood out than were asked for.
    clipped: BoolArray
    """``(k,)`` channels that read their greatest value again and again: what they say of dampings and of
    harmonics is not to be trusted."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the modes, in sentences."""
        clipped = [
            f"row {int(channel) + 1} of the decays is clipped: its modes, dampings and levels are not those "
            "of the object; leave it out, and strike softer or set a wider range"
            for channel in np.flatnonzero(self.clipped)
        ]
        moved = [
            f"the structure changed between the rows: the mode at {mode.frequency:.6g} Hz lies "
            f"{mode.spread:.2g} Hz (one standard deviation) elsewhere from row to row"
            for mode in self.modes
            if mode.spread > 0.0
        ]
        undamped = [
            f"{pole.frequency:.6g} Hz does not decay (damping {pole.damping:.2g} 1/s, one standard deviation "
            f"{pole.damping_sigma:.2g}): driven from outside, or sharper than the lines tell; it is no mode"
            for pole in self.undamped
        ]
        return (*clipped, *moved, *undamped)


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
        new = [
            one
            for one in new_poles(lines, fit, search, rounding)
            if not any(mode.contains(one[0]) for mode in moved)
        ]
        room = most - len(fit.omegas)
        full = len(new) > room
        if len(new) == 0 or room == 0:
            break
        omegas = np.concatenate([fit.omegas, [omega for omega, _ in new[:room]]])
        decays = np.concatenate([fit.decays, [decay for _, decay in new[:room]]])
        fit = fit_poles(lines, omegas, decays, search.skirt)
        moved = merge_poles(lines, fit, search)
    return _described(lines, fit, moved, full)


@dataclass(frozen=True, eq=False)
class MovedMode:
    """One mode for which the fit used several shared poles."""

    members: IntArray  #: ``(m,)`` indices of the shared poles.
    reach: tuple[float, float]  #: lowest and highest frequency, in rad/s, at which the mode explains a line.
    omega: float  #: mean frequency over the rows in rad/s, weighted by their power.
    decay: float  #: mean damping in 1/s, weighted likewise.
    omega_sigma: float  #: standard deviation of ``omega`` in rad/s.
    decay_sigma: float  #: standard deviation of ``decay`` in 1/s.
    spread: float  #: standard deviation of the frequency from row to row in rad/s; zero where the rows agree.

    def contains(self, omega: float) -> bool:
        """Return whether a pole at ``omega`` rad/s belongs to this mode."""
        return self.reach[0] <= omega <= self.reach[1]


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


@dataclass(frozen=True, eq=False)
class _RowPoles:
    """One pole of each row, fitted to that row alone."""

    omegas: FloatArray  #: ``(r,)`` rad/s.
    decays: FloatArray  #: ``(r,)`` 1/s.
    residual: ComplexArray  #: ``(r, f)`` lines that the poles leave.


def merge_poles(lines: SpectralLines, fit: PoleFit, search: PoleSearch) -> list[MovedMode]:
    """Return the groups of neighbouring shared poles that are one mode each.

    Args:
        lines: spectral lines of two rows or more; a single row has no such group.
        fit: fit of shared poles.
        search: settings; ``misfit`` is the fraction of a line's power that one pole a row may leave.
    """
    if len(lines.values) < 2:
        return []
    merged: list[MovedMode] = []
    for gap in _NEIGHBOURHOODS:
        taken = {int(member) for mode in merged for member in mode.members}
        for group in _neighbours(fit, gap):
            if len(group) > 1 and not taken.intersection(group.tolist()):
                mode = _merge_rows(lines, fit, search, group)
                merged += [] if mode is None else [mode]
    return merged


def _neighbours(fit: PoleFit, gap: float) -> list[IntArray]:
    """Return groups of pole indices whose neighbours are within a relative gap or ``APART`` half widths."""
    order = np.argsort(fit.omegas)
    if len(order) == 0:
        return []
    omegas, widths = fit.omegas[order], np.abs(fit.decays[order])
    limits = np.maximum(gap * omegas[1:], APART * np.maximum(widths[1:], widths[:-1]))
    return np.split(order, np.flatnonzero(np.diff(omegas) > limits) + 1)


def _merge_rows(
    lines: SpectralLines, fit: PoleFit, search: PoleSearch, members: IntArray
) -> MovedMode | None:
    """Return the mode that moved from row to row, or None where the poles are several modes."""
    width = float(np.median(np.abs(fit.decays[members])))
    pad = max(APART * width, 2.0 * np.pi * _MIN_LINES * lines.step)
    reach = float(fit.omegas[members].min()) - pad, float(fit.omegas[members].max()) + pad
    inside = (lines.frequencies >= reach[0] / (2.0 * np.pi)) & (lines.frequencies <= reach[1] / (2.0 * np.pi))
    shared = fit.residual[:, inside]
    values = shared + fit.model[members][:, :, inside].sum(axis=0)
    powers = np.sum(np.abs(values) ** 2, axis=1)
    rows = np.flatnonzero(powers > _MIN_ROW_POWER * powers.max())
    if len(rows) < 2:
        return None
    values, shared, powers = values[rows], shared[rows], powers[rows]
    fits = [_fit_one_pole(lines, inside, row[None], width) for row in values]
    alone = _RowPoles(
        np.array([float(fit.omegas[0]) for fit in fits]),
        np.array([float(fit.decays[0]) for fit in fits]),
        np.array([fit.residual[0] for fit in fits]),
    )
    left = float(np.sum(np.abs(alone.residual) ** 2))
    unexplained = float(np.sum(np.abs(shared) ** 2))
    allowed = search.misfit * powers.sum() + _NOISE * unexplained
    common = _fit_one_pole(lines, inside, values, width)
    if left > min(allowed, _MAX_RESIDUAL_RATIO * float(np.sum(np.abs(common.residual) ** 2))):
        return None
    if len(members) < len(rows) and unexplained < _EXPLAINED * left:
        return None
    # Two peaks in one row need neighbouring poles that are far enough apart.
    order = members[np.argsort(fit.omegas[members])]
    widths = np.abs(fit.decays[order])
    are_resolved = bool(np.any(np.diff(fit.omegas[order]) > _RESOLVED * np.maximum(widths[1:], widths[:-1])))
    second = are_resolved and _has_second_mode(values, alone.residual, shared, search.misfit)
    if second or _repeats(alone.omegas):
        return None
    return _average(members, reach, alone.omegas, alone.decays, powers)


def _fit_one_pole(lines: SpectralLines, inside: BoolArray, values: ComplexArray, width: float) -> PoleFit:
    """Fit one pole to ``(k, f)`` rows of a band; ``width`` is the damping to start from in 1/s."""
    frequencies = lines.frequencies[inside]
    top = 2.0 * np.pi * float(frequencies[int(np.argmax(np.sum(np.abs(values) ** 2, axis=0)))])
    return fit_poles(SpectralLines(frequencies, values, lines.rate), np.array([top]), np.array([width]), 1)


def _has_second_mode(
    values: ComplexArray, residual: ComplexArray, shared: ComplexArray, misfit: float
) -> bool:
    """Return whether the one pole of a row leaves a peak that the shared poles explain.

    Args:
        values: ``(r, f)`` lines of the group.
        residual: ``(r, f)`` lines that one pole a row leaves.
        shared: ``(r, f)`` lines that the shared poles leave.
        misfit: fraction of a line's power that may stay unexplained.
    """

    def smooth(signal: ComplexArray) -> FloatArray:
        return np.asarray(uniform_filter1d(np.abs(signal) ** 2, _SMOOTHED_LINES, axis=1, mode="nearest"))

    power, left, explained = smooth(values), smooth(residual), smooth(shared)
    limit = np.maximum(misfit * power, _PEAK_FRACTION * misfit * power.max(axis=1, keepdims=True))
    noise = np.maximum(explained, np.mean(explained, axis=1, keepdims=True))
    return bool(np.any(left > np.maximum(limit, _NOISE_PEAK * noise)))


def _repeats(omegas: FloatArray) -> bool:
    """Return whether the rows' frequencies are a few values, each the same in several rows."""
    ordered = np.sort(omegas)
    gaps = np.diff(ordered)
    for count in range(2, min(len(ordered) // 2, len(ordered) - _MIN_REPEATS) + 1):
        splits = np.sort(np.argsort(gaps)[-(count - 1) :])
        ranges = [float(np.ptp(part)) for part in np.split(ordered, splits + 1)]
        if max(ranges) <= _REPEATED * float(gaps[splits].min()):
            return True
    return False


def _average(
    members: IntArray,
    reach: tuple[float, float],
    omegas: FloatArray,
    decays: FloatArray,
    powers: FloatArray,
) -> MovedMode:
    """Average poles, weighted by their power; deviations are those of their scatter."""
    weights = powers / powers.sum()
    count = float(1.0 / np.sum(weights**2))  # effective number of poles of equal weight

    def scatter(values: FloatArray) -> tuple[float, float]:
        mean = float(weights @ values)
        variance = float(weights @ (values - mean) ** 2)
        return mean, float(np.sqrt(variance * count / max(count - 1.0, 1e-9)))

    (omega, spread), (decay, uneven) = scatter(omegas), scatter(decays)
    return MovedMode(
        read_only(members), reach, omega, decay, spread / count**0.5, uneven / count**0.5, spread
    )
